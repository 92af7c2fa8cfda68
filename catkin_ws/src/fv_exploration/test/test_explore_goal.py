"""Goals of the explore action, the checks of a start, and the warnings that both give."""

import math
from dataclasses import replace

import numpy as np
import pytest
from fv_msgs.msg import Box, ExploreGoal
from geometry_msgs.msg import Point
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fv_exploration import start_checks
from fv_exploration.bounds import enclosing_box
from fv_exploration.explore_config import ExploreConfig
from fv_exploration.ros.explore_goal import configured, volume
from fv_exploration.warning_list import MOST, WarningList

CONFIG = ExploreConfig()


def goal(low=(-1.0, -1.0, 0.0), high=(1.0, 1.0, 2.0), frame="", **values):
    message = ExploreGoal(bounds=Box(Point(*low), Point(*high)), **values)
    message.header.frame_id = frame
    return message


def pose(rotation=None, at=(0.0, 0.0, 0.0)):
    T = np.eye(4)
    T[:3, :3] = np.eye(3) if rotation is None else rotation.as_matrix()
    T[:3, 3] = at
    return T


def nobody(frame):
    raise AssertionError(f"nobody should ask where {frame} is")


@pytest.mark.parametrize("frame", ["", "world", "/world"])
def test_bounds_of_the_map_frame_are_taken_as_they_are(frame):
    found = volume(goal(frame=frame), "world", CONFIG, nobody)
    assert np.array_equal(found.bounds, [[-1, -1, 0], [1, 1, 2]])
    assert found.warnings == ()


def test_a_frame_elsewhere_shifts_the_bounds():
    found = volume(goal(frame="/table"), "world", CONFIG, lambda frame: pose(at=(1.0, 2.0, len(frame))))
    assert np.allclose(found.bounds, [[0, 1, 5], [2, 3, 7]])
    assert found.warnings == ()


@pytest.mark.parametrize("seed", range(24))
def test_quarter_turns_are_exact(seed):
    rotation = Rotation.create_group("O")[seed]
    low, high = np.array([0.1, 0.2, 0.3]), np.array([1.1, 1.6, 3.3])
    found = enclosing_box((low, high), pose(rotation, (0.5, 0.0, 0.0)), "table", "world")
    corners = rotation.apply([low, high]) + np.array([0.5, 0.0, 0.0])
    assert np.allclose(found.bounds, [corners.min(axis=0), corners.max(axis=0)], atol=1e-12)
    assert found.warnings == ()


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**31))
def test_any_other_turn_gives_the_box_around_all_corners_and_says_how_much_larger_it_is(seed):
    random = np.random.default_rng(seed)
    rotation = Rotation.random(random_state=seed)
    low = random.uniform(-2, 0, 3)
    high = low + random.uniform(0.2, 2, 3)
    T = pose(rotation, random.uniform(-3, 3, 3))
    found = enclosing_box((low, high), T, "table", "world")
    corners = np.array([[x, y, z, 1.0] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    corners[:, :3] = low + corners[:, :3] * (high - low)
    placed = corners @ T.T
    assert np.allclose(found.bounds, [placed[:, :3].min(axis=0), placed[:, :3].max(axis=0)])
    growth = np.prod(found.bounds[1] - found.bounds[0]) / np.prod(high - low)
    assert f"{growth:.2f} times as large" in found.warnings[0]
    assert "'table'" in found.warnings[0]
    assert "'world'" in found.warnings[0]


@pytest.mark.parametrize(
    ("low", "high", "said"),
    [
        ((1, 1, 1), (0, 2, 2), "each minimum below its maximum"),
        ((0, 0, 0), (0, 1, 1), "each minimum below its maximum"),
        ((0, 0, math.nan), (1, 1, 1), "nan"),
        ((0, 0, 0), (1, 1, math.inf), "inf"),
        ((-1e300, 0, 0), (1e300, 1e300, 1), "metres"),
        ((-1.7e308, -1.7e308, 0), (1.7e308, 1.7e308, 1), "metres"),
        ((-1000, -1000, 0), (1000, 1000, 2000), "resolution_m"),
        ((0, 0, 0), (0.1, 0.1, 0.1), "min_gain_m3"),
        ((0, 0, 0), (1e-9, 1e-9, 1e-9), "min_gain_m3"),
    ],
)
@pytest.mark.parametrize("frame", ["", "table"])
def test_bounds_that_cannot_be_explored_are_refused_by_name(low, high, said, frame):
    T = pose(Rotation.from_euler("z", 0.0 if frame == "" else 90.0, degrees=True))
    with pytest.raises(ValueError, match="bounds") as caught:
        volume(goal(low, high, frame), "world", CONFIG, lambda _frame: T)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("seconds", [math.nan, -1.0, math.inf, -math.inf])
def test_an_absurd_budget_is_refused(seconds):
    with pytest.raises(ValueError, match="max_seconds is"):
        configured(goal(max_seconds=seconds), CONFIG)


def test_the_policy_of_the_goal_comes_before_that_of_the_configuration():
    own = replace(CONFIG, policy="lab.views:Best", policy_parameters={"drawn": 3})
    assert configured(goal(), own) == configured(goal(policy="lab.views:Best"), own) == own
    other = configured(goal(policy="frontier_void"), own)
    assert (other.policy, other.policy_parameters) == ("frontier_void", {}), (
        "parameters are those of the other"
    )


def test_budgets_of_the_goal_come_before_those_of_the_configuration():
    stop = configured(goal(max_views=7, max_seconds=3.5), CONFIG).stop
    assert (stop.max_views, stop.max_seconds) == (7, 3.5)
    assert stop.max_failed_motions == CONFIG.stop.max_failed_motions


BOUNDS = np.array([0.2, -0.8, 0.0]), np.array([1.2, 0.8, 1.5])


def test_links_outside_of_the_bounds_are_named_with_bounds_that_hold_them():
    balls = {
        "base": np.array([[0.0, 0.0, 0.1, 0.02]]),
        "hand": np.array([[0.5, 0.0, 0.5, 0.02]]),
        "elbow": np.array([[0.5, 0.0, 0.5, 0.02], [0.5, 0.0, 1.63, 0.02]]),
    }
    text = start_checks.body_outside(balls, BOUNDS)
    assert "'base', 'elbow'" in text
    assert "'hand'" not in text
    assert "(-0.05, -0.8, 0) to (1.2, 0.8, 1.65)" in text
    assert start_checks.body_outside({"hand": balls["hand"]}, BOUNDS) == ""
    assert start_checks.body_outside({}, BOUNDS) == ""


def test_a_camera_and_a_clearance_outside_are_told():
    assert "(0.00, 0.00, 1.00)" in start_checks.camera_outside(np.array([0.0, 0.0, 1.0]), BOUNDS)
    assert start_checks.camera_outside(np.array([0.5, 0.0, 1.0]), BOUNDS) == ""
    voxels = np.array([[0.5, 0.0, 0.5], [0.5, 0.0, 2.5], [0.5, 0.0, -2.5], [9.0, 0.0, 0.5]])
    assert "75 % of the clearance" in start_checks.clearance_outside(voxels, BOUNDS)
    assert start_checks.clearance_outside(voxels[:1], BOUNDS) == ""
    assert start_checks.clearance_outside(np.empty((0, 3)), BOUNDS) == ""


def test_warnings_are_told_once_and_counted():
    said = []
    warnings = WarningList(said.append)
    for seconds in (0.5, 0.75, 1.0):
        warnings.add(f"joints are {seconds} s\naway")
    warnings.add("link_1 has no shape")
    warnings.add("link_2 has no shape")
    assert said == ["joints are 0.5 s away", "link_1 has no shape", "link_2 has no shape"]
    assert warnings.lines() == ["joints are 0.5 s away (3 times)", *said[1:]]
    warnings.clear()
    assert warnings.lines() == []


def test_warnings_without_end_are_cut_and_their_number_is_told():
    warnings = WarningList()
    for index in range(MOST + 7):
        warnings.add(f"link_{index} has no shape")
    assert len(warnings.lines()) == MOST + 1
    assert warnings.lines()[-1].startswith("7 further")
