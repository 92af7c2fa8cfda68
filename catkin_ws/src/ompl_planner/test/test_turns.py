"""Joints that turn all the way round and further: which of the equal angles a motion ends at."""

import numpy as np
import pytest
from ompl_planner import _core
from planar_arm import SRDF, URDF, make_request, pillar

SUCCESS = _core.PlanStatus.SUCCESS
TURN = 2.0 * np.pi
STATE = """<group_state name="ready" group="arm">
  <joint name="shoulder" value="0.2"/><joint name="elbow" value="0"/></group_state>"""


def planner_with(kind: str, limits: str) -> _core.MotionPlanner:
    """The planar arm with another elbow: its type, and its limits as URDF attributes."""
    before, after = URDF.split('<joint name="elbow" type="revolute">')
    urdf = f'{before}<joint name="elbow" type="{kind}">' + after.replace(
        'lower="-2.9" upper="2.9"', limits, 1
    )
    return _core.MotionPlanner(
        urdf=urdf,
        srdf=SRDF.replace("<disable", STATE + "<disable", 1),
        rates={"shoulder": (1.0, 2.0), "elbow": (1.5, 3.0)},
    )


@pytest.fixture(scope="module")
def continuous():
    return planner_with("continuous", "")


@pytest.fixture(scope="module")
def two_turns():
    return planner_with("revolute", 'lower="-6.28" upper="6.28"')


def end_of(planner, request):
    """The last joint values, after a trajectory that begins at the start."""
    result = planner.solve(request)
    assert result["status"] == SUCCESS, result["message"]
    positions = result["trajectory"]["positions"]
    np.testing.assert_allclose(positions[0], request.start_all, atol=1e-9)
    np.testing.assert_allclose(result["waypoints"][0], request.start_all, atol=1e-9)
    assert np.abs(np.diff(positions, axis=0)).max() < 0.1
    assert planner.judge(request, result["trajectory"]) == ""
    return positions[-1]


def named(request, name="ready"):
    request.goal_type = _core.GoalType.NAMED
    request.goal_name = name
    return request


def posed(planner, request, *states):
    request.goal_type = _core.GoalType.POSES
    request.set_goal_poses([planner.tip_pose("arm", np.array(q)) for q in states])
    return request


@pytest.mark.parametrize("start", [6.58, -3.1, 4 * TURN + 0.3, -50.0, 0.4])
def test_joint_values_are_reached_at_the_nearest_equal_angle(continuous, start):
    request = make_request(continuous, start=(0.2, start), goal=(0.1, 0.0))
    for goal in (0.0, 3.0, -3.0, 7.0):
        request.goal_joints = [("shoulder", 0.1), ("elbow", goal)]
        end = end_of(continuous, request)
        assert end[0] == pytest.approx(0.1)
        assert abs(end[1] - start) <= np.pi + 1e-6
        assert np.remainder(end[1] - goal + 1e-6, TURN) == pytest.approx(1e-6, abs=1e-5)


@pytest.mark.parametrize("turns", [0, 1, -1, 5])
def test_named_poses_and_goal_poses_end_on_the_starts_turn(continuous, turns):
    start = (0.2, turns * TURN + 0.3)
    assert end_of(continuous, named(make_request(continuous, start=start)))[1] == pytest.approx(turns * TURN)
    request = posed(continuous, make_request(continuous, start=start), (0.4, -0.5))
    assert end_of(continuous, request) == pytest.approx([0.4, turns * TURN - 0.5], abs=1e-4)


def test_a_pose_beyond_half_a_turn_is_reached_across_it(continuous):
    request = posed(continuous, make_request(continuous, start=(0.0, 3.0)), (0.1, -3.0))
    assert end_of(continuous, request) == pytest.approx([0.1, TURN - 3.0], abs=1e-4)


def test_exact_turns_unwind(continuous):
    request = named(make_request(continuous, start=(0.2, 6.58)))
    request.exact_turns = True
    assert end_of(continuous, request)[1] == pytest.approx(0.0)
    request = make_request(continuous, start=(0.2, 0.3), goal=(0.2, 2 * TURN))
    request.exact_turns = True
    assert end_of(continuous, request)[1] == pytest.approx(2 * TURN)


def test_a_way_round_an_obstacle_is_found_turns_off_zero(continuous):
    wall = pillar(np.pi / 2, inner=0.6)
    request = make_request(continuous, occupied=wall, start=(0.0, 3 * TURN), goal=(2.5, 0.0))
    assert end_of(continuous, request) == pytest.approx([2.5, 3 * TURN])


@pytest.mark.parametrize(
    ("start", "expected"), [(5.0, TURN - 1.5), (-5.0, -1.5), (1.0, -1.5), (6.2, TURN - 1.5)]
)
def test_poses_take_the_equal_angle_nearest_to_the_start_that_the_limits_allow(two_turns, start, expected):
    request = posed(two_turns, make_request(two_turns, start=(0.0, start)), (0.3, -1.5))
    assert end_of(two_turns, request) == pytest.approx([0.3, expected], abs=1e-4)


def test_a_nearer_equal_angle_beyond_the_limits_is_not_taken(two_turns):
    request = posed(two_turns, make_request(two_turns, start=(0.0, 5.5)), (0.3, 2.0))
    assert end_of(two_turns, request) == pytest.approx([0.3, 2.0], abs=1e-4)


def test_joint_values_of_a_bounded_joint_are_taken_as_they_are(two_turns):
    request = make_request(two_turns, start=(0.0, 6.0), goal=(0.0, -0.2))
    assert end_of(two_turns, request) == pytest.approx([0.0, -0.2])
