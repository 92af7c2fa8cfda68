"""Reachable views and the choice among candidate views, against obvious slow versions."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fv_exploration.explore_config import ViewSettings
from fv_exploration.strategy.frontier_void import Candidates, ViewChooser
from fv_exploration.strategy.reachable_views import ReachableViews
from fv_exploration.strategy.view_geometry import spread_out, upright_poses


class BallArm:
    """An arm that reaches every pose within a ball about its base, looking away from the base only."""

    def __init__(self, reach_m: float = 0.5) -> None:
        self.radius = 0.05
        grid = np.arange(-reach_m, reach_m + 1e-9, 0.1)
        self.centres = np.stack(np.meshgrid(grid, grid, grid, indexing="ij"), -1).reshape(-1, 3)
        self.directions = np.array(
            [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float
        )
        self.reach_m = reach_m
        looking = -self.directions
        positions = self.centres[:, None] - self.radius * looking[None]
        flat = positions.reshape(-1, 3)
        answers = self.query(flat, np.tile(looking, (len(self.centres), 1)))
        self.valid = answers.reshape(len(self.centres), 6) > 0.5

    def query(self, positions, directions, interpolate=True):
        inside = np.linalg.norm(positions, axis=1) <= self.reach_m
        return (inside & (np.einsum("ij,ij->i", positions, directions) >= 0)).astype(np.float32)


def turned(angle: float, offset=(0.0, 0.0, 0.0)) -> np.ndarray:
    T = np.eye(4)
    T[:2, :2] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    T[:3, 3] = offset
    return T


unit_vectors = st.tuples(*[st.floats(-1, 1) for _ in range(3)]).filter(lambda v: np.linalg.norm(v) > 0.1)


@given(unit_vectors)
def test_upright_poses_are_rotations_that_look_along_the_direction(vector):
    direction = np.array([vector]) / np.linalg.norm(vector)
    pose = upright_poses(np.array([[1.0, 2.0, 3.0]]), direction)[0]
    assert np.allclose(pose[:3, :3].T @ pose[:3, :3], np.eye(3), atol=1e-9)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
    assert np.allclose(pose[:3, 2], direction[0])
    assert pose[2, 1] <= 1e-3, (
        "the image's down axis must not point up, but for directions that count as vertical"
    )


@pytest.mark.parametrize("direction", [[0, 0, 1], [0, 0, -1]])
def test_a_camera_that_looks_along_the_vertical_has_a_pose(direction):
    pose = upright_poses(np.zeros((1, 3)), np.array([direction], dtype=float))[0]
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**31), st.floats(0.05, 0.5), st.floats(0.1, 3.0))
def test_spread_out_equals_the_greedy_definition(seed, spread_m, spread_rad):
    random = np.random.default_rng(seed)
    directions = random.normal(size=(40, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    poses = upright_poses(random.uniform(0, 1, (40, 3)), directions)
    scores = random.integers(0, 5, 40).astype(float)
    expected: list[int] = []
    for index in sorted(range(40), key=lambda i: (-scores[i], i)):
        alike = [
            np.linalg.norm(poses[index][:3, 3] - poses[kept][:3, 3]) <= spread_m
            and math.acos(np.clip(poses[index][:3, 2] @ poses[kept][:3, 2], -1, 1)) <= spread_rad
            for kept in expected
        ]
        if not any(alike):
            expected.append(index)
    assert spread_out(scores, poses, 40, spread_m, spread_rad).tolist() == expected


def test_reachability_is_the_best_over_all_base_poses():
    arm = BallArm()
    bases = np.array([turned(0.3, (0, 0, 1)), turned(-1.2, (0.4, 0, 1))])
    reachable = ReachableViews(arm, bases)
    random = np.random.default_rng(5)
    positions = random.uniform([-1, -1, 0], [1, 1, 2], (300, 3))
    directions = random.normal(size=(300, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    got = reachable.reachability(positions, directions)
    for position, direction, answer in zip(positions, directions, got, strict=True):
        answers = []
        for T in bases:
            local = np.linalg.inv(T) @ np.append(position, 1)
            answers.append(arm.query(local[None, :3], (T[:3, :3].T @ direction)[None])[0])
        assert answer == max(answers)


def test_sampled_views_are_reachable_and_differ_by_seed_only():
    reachable = ReachableViews(BallArm(), np.array([turned(0.0, (0, 0, 1)), turned(2.0, (0, 0, 1))]))
    positions, directions = reachable.sample(500, np.random.default_rng(1))
    assert (reachable.reachability(positions, directions) == 1).all()
    assert reachable.within_reach(positions).all()
    again = reachable.sample(500, np.random.default_rng(1))
    assert np.array_equal(positions, again[0])
    assert not np.array_equal(positions, reachable.sample(500, np.random.default_rng(2))[0])


def test_an_arm_that_reaches_nothing_gives_no_views():
    arm = BallArm()
    arm.valid[:] = False
    positions, directions = ReachableViews(arm, np.array([np.eye(4)])).sample(10, np.random.default_rng(1))
    assert positions.shape == (0, 3)
    assert directions.shape == (0, 3)


class Utility:
    """Utility of a few voxels."""

    def __init__(self, points=(), values=(), directions=()):
        self.points = np.array(points, dtype=np.float32).reshape(-1, 3)
        self.utility = np.array(values, dtype=np.float32)
        self.direction = np.array(directions, dtype=np.float32).reshape(-1, 3)


class Gain:
    """What views show in a world in which only those towards +x show something."""

    def __init__(self, poses):
        self.void_volume_m3 = np.maximum(0, poses[:, 0, 2]) * 0.5
        self.unknown_volume_m3 = self.void_volume_m3 * 2
        self.frontier_area_m2 = np.zeros(len(poses))


class Judge:
    """Sees the same with the robot in the image, but for what the joint ``elbow`` covers of it (0..1)."""

    def gains(self, poses):
        return Gain(poses)

    def gain_at(self, pose, joints):
        gain = Gain(pose[None])
        gain.void_volume_m3 *= 1 - joints["elbow"]
        gain.unknown_volume_m3 *= 1 - joints["elbow"]
        return gain


def make_chooser(**changes) -> ViewChooser:
    values = {"utility_voxels": 20, "sampled": 400, "shortlist": 8, **changes}
    return ViewChooser(
        ViewSettings(**values),
        ReachableViews(BallArm(), np.array([np.eye(4)])),
        Judge(),
        lambda positions: np.zeros(len(positions), dtype=np.int8),
    )


def test_the_shortlist_is_ranked_reachable_and_spread():
    chooser = make_chooser()
    chooser.prepare(0, np.eye(4), Utility([[0.2, 0, 0]], [3.0], [[1, 0, 0]]))
    found = chooser.shortlist()
    assert 0 < len(found) <= 8
    assert (np.diff(found.scores) <= 0).all()
    assert (found.reachability >= 0.5).all()
    assert (found.gains >= ViewSettings().min_gain_m3).all()
    assert (found.poses[:, 0, 2] > 0).all()


def test_the_voxel_of_highest_utility_is_a_candidate_along_its_direction():
    chooser = make_chooser(sampled=0)
    chooser.prepare(0, np.eye(4), Utility([[0.2, 0, 0], [9, 9, 9]], [3.0, 5.0], [[1, 0, 0], [1, 0, 0]]))
    found = chooser.shortlist()
    assert len(found) == 1, "the voxel out of reach must not be proposed"
    assert np.allclose(found.poses[0][:3, 3], [0.2, 0, 0])
    assert found.utility[0] == 3.0


def test_no_candidate_means_an_empty_shortlist():
    chooser = make_chooser(sampled=0)
    chooser.prepare(0, np.eye(4), Utility())
    assert len(chooser.shortlist()) == 0


def test_voxels_that_are_not_free_are_no_candidates():
    chooser = ViewChooser(
        ViewSettings(),
        ReachableViews(BallArm(), np.array([np.eye(4)])),
        Judge(),
        lambda positions: np.full(len(positions), -1, dtype=np.int8),
    )
    chooser.prepare(0, np.eye(4), Utility())
    assert len(chooser.shortlist()) == 0


def test_rejected_views_are_not_proposed_again_until_the_map_grows():
    chooser = make_chooser()
    chooser.prepare(0, np.eye(4), Utility())
    first = chooser.shortlist()
    chooser.reject(first)
    chooser.prepare(1, np.eye(4), Utility())
    spread_rad = math.radians(ViewSettings().spread_deg)
    again = chooser.shortlist()
    for pose in again.poses:
        near = np.linalg.norm(first.poses[:, :3, 3] - pose[:3, 3], axis=1) <= ViewSettings().spread_m
        angle = np.arccos(np.clip(first.poses[:, :3, 2] @ pose[:3, 2], -1, 1))
        assert not (near & (angle <= spread_rad)).any()


def test_a_view_that_disappointed_is_worth_as_little_the_next_time():
    chooser = make_chooser()
    chooser.prepare(0, np.eye(4), Utility())
    best = chooser.shortlist()
    chooser.expect(best.poses[0], float(best.gains[0]))
    chooser.learn(0.0)
    chooser.prepare(0, np.eye(4), Utility())
    values = ViewSettings()
    for pose in chooser.shortlist().poses:
        near = np.linalg.norm(best.poses[0][:3, 3] - pose[:3, 3]) <= values.doubt_m
        angle = math.acos(np.clip(best.poses[0][:3, 2] @ pose[:3, 2], -1, 1))
        assert not (near and angle <= math.radians(values.doubt_deg))


def test_what_the_robot_covers_is_taken_off_the_gain_of_a_view():
    chooser = make_chooser()
    chooser.prepare(0, np.eye(4), Utility())
    best = chooser.shortlist()
    gain = float(best.gains[0])
    assert chooser.gain_at(best.poses[0], {"elbow": 0.0}) == pytest.approx(gain)
    assert chooser.gain_at(best.poses[0], {"elbow": 0.75}) == pytest.approx(gain / 4)


def test_a_view_that_is_left_out_comes_back_with_the_next_decision():
    chooser = make_chooser()
    chooser.prepare(0, np.eye(4), Utility())
    best = chooser.shortlist().poses[0]
    chooser.leave_out(best)
    assert not any(np.array_equal(pose, best) for pose in chooser.shortlist().poses)
    chooser.prepare(0, np.eye(4), Utility())
    assert np.array_equal(chooser.shortlist().poses[0], best)


def test_candidates_are_taken_row_by_row():
    chooser = make_chooser()
    chooser.prepare(0, np.eye(4), Utility())
    found = chooser.shortlist()
    part = found.take(np.array([1, 0]))
    assert isinstance(part, Candidates)
    assert np.array_equal(part.scores, found.scores[[1, 0]])
    assert np.array_equal(part.poses, found.poses[[1, 0]])
