"""The transforms of a recording, against plain walks over all ways from frame to frame."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recorded import UNTURNED
from scipy.spatial.transform import Rotation, Slerp

from fv_exploration.recordings import RecordingError
from fv_exploration.recordings.transforms import OutsideSpan, TransformTree

FRAMES = "abcdef"


def tree_of(*links, static=True):
    """A tree of (parent, child, x [m])."""
    tree = TransformTree()
    for parent, child, x in links:
        tree.add(parent, child, 0, np.array([x, 0, 0]), np.array(UNTURNED), static=static)
    return tree


def ways(edges, source, target):
    """The offsets of all ways from source to target that meet no frame twice: every edge is its own."""
    found = []

    def walk(frame, seen, offset):
        if frame == target:
            found.append(offset)
            return
        for parent, child, x in edges:
            for here, there, step in ((child, parent, x), (parent, child, -x)):
                if here == frame and there not in seen:
                    walk(there, {*seen, there}, offset + step)

    walk(source, {source}, 0.0)
    return found


PAIRS = [pair for pair in itertools.permutations(FRAMES, 2)]


@settings(max_examples=300, deadline=None)
@given(st.sets(st.sampled_from(PAIRS), max_size=9), st.sampled_from(PAIRS))
def test_a_way_is_used_if_it_is_the_only_one(pairs, asked):
    edges = [(parent, child, float(2**i)) for i, (parent, child) in enumerate(sorted(pairs))]
    source, target = asked
    expected = ways(edges, source, target)
    tree = tree_of(*edges)
    if len(expected) == 1:
        assert np.isclose(tree.lookup(target, source, 5)[0, 3], expected[0])
        return
    with pytest.raises(RecordingError) as error:
        tree.lookup(target, source, 5)
    assert "\n" not in str(error.value)
    assert not expected or "has the loop" in str(error.value) or "has the parents" in str(error.value)


def is_root(edges, frame, source):
    def below(start):
        found, waiting = {start}, [start]
        while waiting:
            at = waiting.pop()
            for parent, child, _ in edges:
                if child == at and parent not in found:
                    found.add(parent)
                    waiting.append(parent)
        return found

    return frame in below(source) and not any(child == frame for _, child, _ in edges)


@settings(max_examples=200, deadline=None)
@given(st.sets(st.sampled_from(PAIRS), max_size=9), st.sampled_from(FRAMES))
def test_the_root_is_the_only_frame_above_that_has_no_parent(pairs, source):
    edges = [(parent, child, 1.0) for parent, child in sorted(pairs)]
    roots = [frame for frame in FRAMES if is_root(edges, frame, source)]
    if len(roots) == 1:
        assert tree_of(*edges).root(source) == roots[0]
        return
    with pytest.raises(RecordingError, match="has the parents" if roots else "has the loop"):
        tree_of(*edges).root(source)


def test_long_chains_and_wide_trees_are_walked():
    count = 2000
    tree = tree_of(
        *((str(i), str(i + 1), 1.0) for i in range(count)), *(("0", f"w{i}", 0) for i in range(count))
    )
    assert tree.root(str(count)) == "0"
    assert np.isclose(tree.lookup("0", str(count), 0)[0, 3], count)
    assert np.isclose(tree.lookup("w7", "w8", 0)[0, 3], 0)


@pytest.mark.parametrize(
    ("links", "frames"),
    [
        ([("odom", "base", 1), ("base", "odom", 1), ("base", "cam", 1)], ["base", "odom"]),
        ([("a", "b", 1), ("b", "c", 1), ("c", "a", 1), ("a", "cam", 0)], ["a", "b", "c"]),
    ],
)
def test_loops_are_named_by_their_frames(links, frames):
    tree = tree_of(*links)
    for ask in (
        lambda: tree.root("cam"),
        lambda: tree.lookup("world", "cam", 0),
        lambda: tree.lookup(frames[-1], "cam", 0),
    ):
        with pytest.raises(RecordingError, match="has the loop") as error:
            ask()
        assert all(repr(frame) in str(error.value) for frame in frames)


def test_of_several_parents_the_way_to_the_asked_frame_counts_alone():
    tree = tree_of(("odom", "cam", 1.0), ("map", "cam", 5.0), ("lab", "map", 10.0))
    assert tree.lookup("map", "cam", 0)[0, 3] == 5
    assert tree.lookup("lab", "cam", 0)[0, 3] == 15
    assert tree.lookup("odom", "cam", 0)[0, 3] == 1
    with pytest.raises(RecordingError, match="'cam' has the parents 'odom', 'map'") as error:
        tree.root("cam")
    assert "'odom', 'lab'" in str(error.value)
    both = tree_of(("odom", "cam", 1.0), ("map", "cam", 5.0), ("map", "odom", 1.0))
    with pytest.raises(RecordingError, match="'cam' has the parents 'odom', 'map'"):
        both.lookup("map", "cam", 0)


def test_poses_between_samples_lie_on_line_and_arc_and_none_lie_beyond():
    random = np.random.default_rng(2)
    stamps = np.cumsum(random.integers(1, 10**9, size=20)) + 1_700_000_000 * 10**9
    turns, places = Rotation.random(20, random_state=3), random.normal(size=(20, 3))
    tree = TransformTree()
    for i in random.permutation(20):
        tree.add("map", "cam", int(stamps[i]), places[i], turns[i].as_quat() * (-1) ** i)
    slerp = Slerp((stamps - stamps[0]) / 1e9, turns)
    for stamp in [*stamps, *random.integers(stamps[0], stamps[-1], size=50)]:
        pose, at = tree.lookup("map", "cam", int(stamp)), (stamp - stamps[0]) / 1e9
        assert np.allclose(pose[:3, :3], slerp(at).as_matrix(), atol=1e-6)
        expected = [np.interp(at, (stamps - stamps[0]) / 1e9, places[:, k]) for k in range(3)]
        assert np.allclose(pose[:3, 3], expected, atol=1e-6)
    for stamp, beyond_s in ((stamps[0] - 1500_000_000, 1.5), (stamps[-1] + 1, 1e-9)):
        with pytest.raises(OutsideSpan, match="'map' -> 'cam'") as error:
            tree.lookup("map", "cam", int(stamp))
        assert np.isclose(error.value.beyond_s, beyond_s)


def test_static_transforms_hold_always_and_the_last_one_counts():
    tree = tree_of(("map", "cam", 1.0))
    assert tree.lookup("map", "cam", 10**18)[0, 3] == 1
    tree.add("map", "cam", 5, np.array([2.0, 0, 0]), np.array(UNTURNED), static=True)
    assert tree.lookup("map", "cam", 0)[0, 3] == 2
    assert "other values" in tree.noted()
    tree.add("map", "cam", 5, np.array([2.0, 0, 0]), np.array(UNTURNED))
    assert tree.lookup("map", "cam", 10**18)[0, 3] == 2, "sent on both topics, but the same"
    tree.add("map", "cam", 6, np.array([3.0, 0, 0]), np.array(UNTURNED))
    with pytest.raises(RecordingError, match="is static and also moves"):
        tree.lookup("map", "cam", 6)


@pytest.mark.parametrize(
    ("parent", "child", "x", "quaternion", "text"),
    [
        ("cam", "cam", 0.0, UNTURNED, "two named frames"),
        ("", "cam", 0.0, UNTURNED, "two named frames"),
        ("map", "", 0.0, UNTURNED, "two named frames"),
        ("map", "cam", np.nan, UNTURNED, "not finite"),
        ("map", "cam", 0.0, (0, 0, 0, np.inf), "not finite"),
        ("map", "cam", 0.0, (0, 0, 0, 0), "no direction"),
    ],
)
def test_transforms_that_say_nothing_are_left_out_and_noted(parent, child, x, quaternion, text):
    tree = TransformTree()
    for _ in range(3):
        tree.add(parent, child, 0, np.array([x, 0, 0]), np.array(quaternion, dtype=float))
    assert text in tree.noted()
    assert "3 times" in tree.noted()
    with pytest.raises(RecordingError, match=r"does not lead.*left out"):
        tree.lookup("world", "cam", 0)


def test_quaternions_of_another_length_turn_as_far_and_are_noted():
    turned = Rotation.from_rotvec([0, 0, 1]).as_quat()
    tree = TransformTree()
    tree.add("map", "cam", 0, np.zeros(3), 3 * turned)
    assert np.allclose(tree.lookup("map", "cam", 0)[:3, :3], Rotation.from_quat(turned).as_matrix())
    assert "length 1" in tree.noted()
