"""Bags as others record them: every cloud where it was taken, or one line that says why not."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from recorded import cloud, wall, write_bag

from fv_exploration.recordings import RecordingError, read_scans

POINTS = np.array([[1.0, 0.5, 0.25], [np.nan] * 3, [2.0, -0.5, 0.75]])
CLOUD = cloud(POINTS)


def clouds(*stamps_s, frame="cam", topic="/points"):
    return [(topic, stamp, frame, CLOUD) for stamp in stamps_s]


def moving(*stamps_s, parent="map", child="cam", topic="/tf"):
    """Transforms whose x is the stamp."""
    return [(topic, stamp, parent, child, stamp) for stamp in stamps_s]


def read(path, clouds, transforms=(), **options):
    """x of every scan's pose, and the warnings."""
    path.unlink(missing_ok=True)
    write_bag(path, clouds, transforms)
    warnings = []
    scans = list(read_scans(path, warn=warnings.append, **options))
    for scan in scans:
        assert np.allclose(scan.points_sensor, POINTS, equal_nan=True)
    assert all(str(path) in text and "\n" not in text for text in warnings)
    return [float(scan.T_map_sensor[0, 3]) for scan in scans], warnings


def refuse(path, text, clouds, transforms=(), **options):
    with pytest.raises(RecordingError, match=text) as error:
        read(path, clouds, transforms, **options)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "scans.bag"


def test_clouds_are_read_with_the_transform_of_their_stamp(path):
    assert read(path, clouds(20.0), moving(10.0, 30.0)) == ([20.0], [])
    refuse(path, "valid: /points", clouds(20.0), topic="/other")
    refuse(
        path,
        "does not lead from 'cam' to 'moon'; valid: 'map'",
        clouds(20.0),
        moving(10.0, 30.0),
        map_frame="moon",
    )


def test_slashes_before_frames_and_map_frame_mean_nothing(path):
    transforms = moving(10.0, 30.0, parent="/map", child="cam")
    assert read(path, clouds(20.0, frame="/cam"), transforms, map_frame="/map") == ([20.0], [])


def test_transforms_of_the_static_topic_alone_hold_always(path):
    static = moving(5.0, topic="/tf_static")
    assert read(path, clouds(1.0, 2000.0), static) == ([5.0, 5.0], [])


def test_map_frames_beside_the_chain_are_found(path):
    transforms = moving(3.0, parent="map", child="tag", topic="/tf_static") + moving(10.0, 30.0)
    assert read(path, clouds(20.0), transforms, map_frame="tag") == ([17.0], [])


def test_a_motion_in_a_gap_of_tf_is_told(path):
    stamps = [10.0, 10.1, 10.2, 13.0, 13.1]
    poses, warnings = read(path, clouds(10.15, 11.6, 13.05), moving(*stamps))
    assert poses == pytest.approx([10.15, 11.6, 13.05])
    assert len(warnings) == 1
    assert "'map' -> 'cam' moved in a gap of 2.8 s without samples" in warnings[0]
    standing = [("/tf", stamp, "map", "cam", 5.0) for stamp in stamps]
    assert read(path, clouds(11.6), standing) == ([5.0], [])
    assert read(path, clouds(25.0), moving(10.0, 20.0, 30.0, 40.0)) == ([25.0], [])  # as seldom as always


@pytest.mark.parametrize("apart_s", [0.0, 0.0005])
def test_transforms_that_two_nodes_send_are_told(path, apart_s):
    first, second = moving(10.0, 10.1, 10.2), [
        ("/tf", stamp + apart_s, "map", "cam", stamp + 1.5) for stamp in (10.0, 10.1, 10.2)
    ]  # fmt: skip
    _, warnings = read(path, clouds(10.1), first + second)
    assert len(warnings) == 1
    assert "'map' -> 'cam' jumps" in warnings[0] and "sent twice" in warnings[0]
    turned = [("/tf", stamp + apart_s, "map", "cam", stamp, (0.0, 0.0, 1.0, 0.0)) for stamp in (10.0, 10.1)]
    assert "jumps" in read(path, clouds(10.1), first + turned)[1][0]
    assert read(path, clouds(10.1), first + first) == ([10.1], [])


def test_trees_of_tf_that_nothing_connects_are_told(path):
    apart = moving(10.0, 30.0, parent="odom", child="base") + moving(1.0, parent="mount", topic="/tf_static")
    poses, warnings = read(path, clouds(10.0, 20.0), apart)
    assert poses == [1.0, 1.0]
    assert len(warnings) == 1
    assert "does not connect 'cam' with 'base', 'odom': the map is in frame 'mount'" in warnings[0]
    assert read(path, clouds(10.0), apart, map_frame="mount") == ([1.0], [])


def test_clouds_outside_of_the_span_are_left_out_and_told(path):
    poses, warnings = read(path, clouds(9.5, 10.0, 20.0, 30.0, 31.0), moving(10.0, 20.0, 30.0))
    assert poses == [10.0, 20.0, 30.0]
    assert len(warnings) == 1
    assert "2 of 5 clouds were left out" in warnings[0]
    assert "'map' -> 'cam', 10.000 to 30.000 s, by 0.500 to 1.000 s" in warnings[0]


def test_clouds_of_another_clock_are_refused_by_how_far_they_lie_off(path):
    error = refuse(path, "of another clock", clouds(100.0, 101.0), moving(2000.0, 2001.0, 2002.0))
    assert "stamps 100.000 to 101.000 s" in error
    assert "2000.000 to 2002.000 s, by 1899.000 to 1900.000 s" in error


def test_one_sample_of_a_moving_transform_is_no_span(path):
    assert read(path, clouds(10.0), moving(10.0)) == ([10.0], [])
    refuse(path, "of another clock", clouds(11.0), moving(10.0))


def test_a_cloud_without_tf_stays_in_its_own_frame_if_it_is_the_only_one(path):
    poses, warnings = read(path, clouds(1.0))
    assert poses == [0.0]
    assert "no TF of frame 'cam'" in warnings[0]
    refuse(path, "several clouds in frame 'cam' and no TF", clouds(1.0, 2.0))
    refuse(
        path, "several clouds in frame 'cam' and no TF", clouds(1.0, 2.0), moving(1.0, parent="a", child="b")
    )
    assert read(path, clouds(1.0, 2.0), map_frame="cam") == ([0.0, 0.0], [])
    refuse(path, "does not lead from 'cam' to 'map'; it does not know 'cam'", clouds(1.0), map_frame="map")


def test_tf_of_other_topics_is_named(path):
    refuse(path, "/robot/tf was not read", clouds(1.0, 2.0), moving(1.0, 2.0, topic="/robot/tf"))


def test_clouds_without_a_frame_are_refused_where_there_is_tf(path):
    refuse(path, "frame_id of a cloud is empty", clouds(1.0, frame=""), moving(1.0), map_frame="map")
    refuse(path, "several clouds in frame ''", clouds(1.0, 1.0, frame=""), moving(1.0))


def test_clouds_in_the_root_frame_are_told(path):
    poses, warnings = read(path, clouds(1.0, 2.0, frame="map"), moving(1.0, 2.0))
    assert poses == [0.0, 0.0]
    assert "root of TF" in warnings[0]


def test_loops_and_several_parents_are_refused_by_name(path):
    loop = moving(1.0, 2.0, parent="odom", child="base") + moving(1.0, 2.0, parent="base", child="odom")
    below = moving(1.0, 2.0, parent="base")
    for options in ({}, {"map_frame": "world"}):
        refuse(path, "has the loop 'base' -> 'odom' -> 'base'", clouds(1.0), loop + below, **options)
    twice = moving(0.5, 1.5, 2.5) + moving(1.0, 2.0, parent="odom", topic="/tf_static")
    refuse(path, "'cam' has the parents 'map', 'odom'", clouds(1.0), twice)
    assert read(path, clouds(1.0, 2.0), twice, map_frame="map")[0] == [1.0, 2.0]


def test_transforms_that_say_nothing_are_told(path):
    own = [("/tf", 1.0, "cam", "cam", 0.0), ("/tf", 1.0, "map", "cam", 0.0, (0.0, 0.0, 0.0, 0.0))]
    poses, warnings = read(path, clouds(1.0), own + moving(1.0))
    assert poses == [1.0]
    assert "two named frames" in warnings[0]
    assert "no direction" in warnings[0]
    refuse(path, "no direction", clouds(1.0, 1.5), own)


def test_several_cloud_topics_are_listed_in_one_line(path):
    both = clouds(1.0, topic="/left") + clouds(1.0, topic="/right")
    refuse(path, "choose one: /left, /right", both)
    assert read(path, both, moving(1.0), topic="/right") == ([1.0], [])
    refuse(path, "has no clouds", [], moving(1.0))


def test_a_lie_about_the_byte_order_is_told_once(path):
    points = wall(10)
    write_bag(
        path, [("/points", t, "cam", cloud(points, is_bigendian=True)) for t in (1.0, 2.0)], moving(1.0, 2.0)
    )
    warnings = []
    scans = list(read_scans(path, warn=warnings.append))
    assert all(np.array_equal(scan.points_sensor, points) for scan in scans)
    assert len(scans) == 2
    assert len(warnings) == 1


def test_clouds_whose_layout_does_not_fit_are_refused(path):
    refuse(path, "do not fit together", [("/points", 1.0, "cam", cloud(POINTS, width=7))])


@settings(max_examples=150, deadline=10_000, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_damaged_bags_are_read_or_refused_by_name(tmp_path, data):
    whole = tmp_path / "whole.bag"
    if not whole.exists():
        write_bag(whole, clouds(1.0, 2.0), moving(1.0, 2.0))
    content = bytearray(whole.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    if data.draw(st.booleans()):
        del content[data.draw(st.integers(0, len(content))) :]
    damaged = tmp_path / "damaged.bag"
    damaged.write_bytes(content)
    try:
        for scan in read_scans(damaged, warn=[].append):
            assert scan.points_sensor.shape[1] == 3
            assert np.isfinite(scan.T_map_sensor).all()
    except RecordingError as error:
        assert "damaged.bag" in str(error)
        assert "\n" not in str(error)
