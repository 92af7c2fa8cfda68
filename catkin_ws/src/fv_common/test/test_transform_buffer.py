"""Stamps that tf2 answers with a signal."""

import subprocess
import sys

import pytest
import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped

from fv_common.transform_buffer import LAST_STAMP_S, TransformBuffer

FIRST_WRONG_S = LAST_STAMP_S + 1


def sent(secs, parent="map", child="cam"):
    transform = TransformStamped()
    transform.header.stamp.secs = secs
    transform.header.frame_id, transform.child_frame_id = parent, child
    transform.transform.rotation.w = 1.0
    return transform


def buffer_of(*stamps_s):
    buffer = TransformBuffer(debug=False)
    for secs in stamps_s:
        buffer.set_transform(sent(secs), "test")
    return buffer


def test_stamps_up_to_the_last_one_are_tf2s():
    buffer = buffer_of(0, 5, 10, LAST_STAMP_S)
    newest = buffer.lookup_transform("map", "cam", rospy.Time(0))
    assert newest.header.stamp.secs == LAST_STAMP_S
    with pytest.raises(tf2_ros.TransformException):
        buffer_of(1, 2).lookup_transform("map", "cam", rospy.Time(LAST_STAMP_S))


@pytest.mark.parametrize("secs", [FIRST_WRONG_S, 4_000_000_000, 2**32 - 1])
def test_stamps_beyond_are_refused_or_left_out(secs, monkeypatch):
    told = []
    monkeypatch.setattr(rospy, "logwarn_throttle", lambda seconds, text: told.append(text))
    buffer = buffer_of(100, 101)
    with pytest.raises(tf2_ros.ExtrapolationException, match=f"stamp {secs} s lies beyond"):
        buffer.lookup_transform("map", "cam", rospy.Time(secs))
    buffer.set_transform(sent(secs), "test")
    assert buffer.lookup_transform("map", "cam", rospy.Time(0)).header.stamp.secs == 101
    assert [f"TF of 'cam' is left out: its stamp is {secs} s" in text for text in told] == [True]


def test_tf2_itself_still_ends_by_a_signal():
    """Once it does not, the class under test can go."""
    code = (
        "import rospy, tf2_py\nfrom geometry_msgs.msg import TransformStamped\nb = tf2_py.BufferCore()\n"
        "for s in (1, 2):\n    t = TransformStamped()\n    t.header.stamp.secs = s\n    t.header.frame_id = 'a'\n"
        "    t.child_frame_id = 'b'\n    t.transform.rotation.w = 1\n    b.set_transform(t, 'x')\n"
        "b.lookup_transform_core('a', 'b', rospy.Time(4000000000))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False)
    assert done.returncode < 0
