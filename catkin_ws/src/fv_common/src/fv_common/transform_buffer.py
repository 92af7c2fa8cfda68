"""tf2's buffer, for nodes that anybody may send stamps to."""

from __future__ import annotations

import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped

LAST_STAMP_S = 2**31 - 1
"""The differences of stamps up to there fit into the 32 bits that tf2 has for them."""


class TransformBuffer(tf2_ros.Buffer):
    """Takes no stamp after ``LAST_STAMP_S``: what tf2 throws then ends a Python process by a signal."""

    def set_transform(self, transform: TransformStamped, authority: str) -> None:
        """As tf2's; a stamp that it cannot take is told, and left out."""
        if transform.header.stamp.secs > LAST_STAMP_S:
            rospy.logwarn_throttle(
                10.0,
                f"TF of '{transform.child_frame_id}' is left out: its stamp is {transform.header.stamp.secs} s; "
                f"valid: up to {LAST_STAMP_S} s",
            )
        else:
            super().set_transform(transform, authority)

    def lookup_transform(
        self,
        target_frame: str,
        source_frame: str,
        time: rospy.Time,
        timeout: rospy.Duration = rospy.Duration(0.0),  # noqa: B008  as tf2's
    ) -> TransformStamped:
        """As tf2's.

        :raises tf2_ros.TransformException: as tf2's, and for a stamp that it cannot take.
        """
        if time.secs > LAST_STAMP_S:
            raise tf2_ros.ExtrapolationException(
                f"the stamp {time.secs} s lies beyond {LAST_STAMP_S} s, where no transform can be"
            )
        return super().lookup_transform(target_frame, source_frame, time, timeout)
