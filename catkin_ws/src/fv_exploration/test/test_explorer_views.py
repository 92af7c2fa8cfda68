"""Geometry of views and which of them can be held, against obvious slow versions."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_world import BallArm

from fv_exploration.strategy.reachable_views import ReachableViews
from fv_exploration.view_geometry import spread_out, upright_poses


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
