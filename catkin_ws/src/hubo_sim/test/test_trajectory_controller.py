"""Behaviours of the trajectory controller, without ROS or physics: the joints follow the set-points exactly."""

import math

import numpy as np
import pytest
from plant import STEP_S, Plant, goal, joint, refusal

from hubo_sim.control.trajectory_controller import ControllerConfig
from hubo_sim.control.trajectory_goal import Code, Tolerance, TrajectoryGoal


def test_reaches_the_goal_and_says_so():
    plant = Plant()
    plant.start(goal())
    plant.run(1.2)
    assert plant.codes == [("goal", "succeeded", Code.SUCCESSFUL)]
    assert plant.position == pytest.approx([1.0, -1.0])


def test_joints_may_be_named_in_any_order():
    plant = Plant()
    plant.start(goal(positions=((-1.0, 1.0),), names=("b", "a")))
    assert plant.run(1.2).position == pytest.approx([1.0, -1.0])


@pytest.mark.parametrize("names", [("a", "x"), ("a",), ("a", "b", "c"), ()])
def test_wrong_or_missing_joints_are_rejected(names):
    assert refusal(goal(positions=([0.0] * len(names),), names=names)).code == Code.INVALID_JOINTS


@pytest.mark.parametrize("names", [("a", "a"), ("a", "b", "a"), ("b", "a", "a")])
@pytest.mark.parametrize("partial", [False, True])
def test_joint_named_twice_is_rejected_by_name(names, partial):
    plant = Plant(allow_partial_joints_goal=partial)
    refused = refusal(goal(positions=([0.0, 0.1, 0.2][: len(names)],), names=names), plant)
    assert refused.code == Code.INVALID_JOINTS and "joint a more than once" in str(refused)


def test_tolerance_of_a_joint_that_is_not_the_controllers_is_rejected():
    refused = refusal(goal(path_tolerance={"c": Tolerance(0.1)}))
    assert refused.code == Code.INVALID_JOINTS and "'c'" in str(refused) and "a, b" in str(refused)


@pytest.mark.parametrize("times", [(1.0, 1.0), (2.0, 1.0), (-1.0, 1.0), (math.nan, 1.0)])
def test_times_that_do_not_grow_are_rejected(times):
    assert refusal(goal(times, ((0.1, 0.1), (0.2, 0.2)))).code == Code.INVALID_GOAL


@pytest.mark.parametrize("positions", [((1.0,),), ((1.0, 1.0, 1.0),), ((),)])
def test_wrong_sizes_are_rejected(positions):
    assert refusal(goal(positions=positions)).code == Code.INVALID_GOAL


def test_wrong_number_of_velocities_is_rejected():
    assert refusal(goal(velocities=[[1.0]])).code == Code.INVALID_GOAL


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_positions_that_are_not_finite_are_rejected(bad):
    assert refusal(goal(positions=((bad, 0.0),))).code == Code.INVALID_GOAL


def test_position_beyond_its_limit_is_rejected_by_name():
    err = refusal(goal(positions=((0.0, 2.5),)))
    assert err.code == Code.INVALID_GOAL
    assert "b" in str(err) and "2.5" in str(err)


def test_trajectory_wholly_in_the_past_is_rejected():
    assert refusal(goal(stamp_s=5.0), now=7.0).code == Code.OLD_HEADER_TIMESTAMP


def test_points_in_the_past_are_dropped():
    plant = Plant()
    plant.now = 5.5
    plant.start(goal((0.2, 1.0), ((2.0, 2.0), (0.5, 0.5)), stamp_s=5.0))
    plant.run(0.6)
    assert max(p.max() for _, p, _ in plant.log) <= 0.5 + 1e-9
    assert plant.position == pytest.approx([0.5, 0.5])


def test_start_time_in_the_future_is_waited_for():
    plant = Plant()
    plant.start(goal(stamp_s=1.0))
    assert plant.run(0.9).position == pytest.approx([0.0, 0.0])
    assert plant.run(1.2).position == pytest.approx([1.0, -1.0])
    assert plant.codes == [("goal", "succeeded", Code.SUCCESSFUL)]


def test_replacement_joins_smoothly_and_preempts():
    plant = Plant()
    plant.start(goal((2.0,), ((1.0, 1.0),), [[0.0, 0.0]]), "first")
    plant.run(1.0)
    plant.start(goal((1.0,), ((-1.0, 0.5),), [[0.0, 0.0]]), "second")
    plant.run(1.2)
    assert plant.codes == [("first", "canceled", Code.SUCCESSFUL), ("second", "succeeded", Code.SUCCESSFUL)]
    speeds = np.array([v for _, _, v in plant.log])
    assert np.abs(np.diff(speeds, axis=0)).max() < 0.1  # no jump in velocity


def test_replacement_in_the_future_lets_the_old_one_run_until_then():
    plant = Plant()
    plant.start(goal((2.0,), ((1.0, 1.0),)), "first")
    plant.start(goal((1.0,), ((0.0, 0.0),), stamp_s=1.0), "second")
    assert plant.run(1.0).position == pytest.approx([0.5, 0.5], abs=0.01)
    assert plant.run(1.1).position == pytest.approx([0.0, 0.0])


def test_partial_goal_is_rejected_unless_allowed():
    assert refusal(goal(positions=((1.0,),), names=("b",))).code == Code.INVALID_JOINTS
    plant = Plant(allow_partial_joints_goal=True, position=(0.3, 0.0))
    plant.start(goal(positions=((1.0,),), names=("b",)))
    assert plant.run(1.2).position == pytest.approx([0.3, 1.0])


def test_joints_that_a_partial_goal_leaves_out_go_on_along_their_trajectory():
    plant = Plant(allow_partial_joints_goal=True)
    plant.start(goal((2.0,), ((1.0, 1.0),), [[0.0, 0.0]]), "both")
    plant.run(1.0)
    plant.start(goal((0.5,), ((-0.5,),), [[0.0]], names=("b",)), "b alone")
    plant.run(0.6)
    assert plant.codes[-1] == ("b alone", "succeeded", Code.SUCCESSFUL)
    assert plant.position[1] == pytest.approx(-0.5) and 0.7 < plant.position[0] < 1.0
    assert plant.run(0.6).position == pytest.approx([1.0, -0.5])
    speeds = np.array([v for _, _, v in plant.log])
    assert np.abs(np.diff(speeds[:, 0])).max() < 0.05  # a's velocity has no jump


def test_empty_trajectory_stops_and_holds():
    plant = Plant()
    plant.start(goal((2.0,), ((1.0, 1.0),), [[0.0, 0.0]]), "first")
    plant.run(1.0)
    plant.start(TrajectoryGoal(["a", "b"], [], [], [], []), "stop")
    plant.run(1.0)
    stopped = plant.position
    assert np.all(stopped < 0.8) and np.all(plant.velocity == 0.0)
    assert plant.run(0.5).position == pytest.approx(stopped)
    assert plant.codes == [("first", "canceled", Code.SUCCESSFUL), ("stop", "succeeded", Code.SUCCESSFUL)]


def test_stop_close_to_a_limit_ends_within_it():
    plant = Plant(constraints={"a": {"goal": 0.01}, "goal_time": 0.1})
    plant.start(goal((0.5, 1.0), ((1.9, 0.0), (1.9, 0.0)), [[3.0, 0.0], [0.0, 0.0]]), "first")
    plant.run(0.5)
    plant.start(TrajectoryGoal(["a", "b"], [], [], [], []), "stop")  # from 3 rad/s, 0.1 rad before the limit
    plant.run(1.5)
    assert plant.codes[-1] == ("stop", "succeeded", Code.SUCCESSFUL)
    assert plant.position[0] == pytest.approx(2.0)


def test_cancel_brakes_and_holds():
    plant = Plant()
    plant.start(goal((2.0,), ((1.0, 1.0),), [[0.0, 0.0]]))
    plant.run(1.0)
    at_cancel = plant.position
    plant.controller.cancel(plant.now, "goal")
    plant.run(1.0)
    assert plant.codes == [("goal", "canceled", Code.SUCCESSFUL)]
    assert np.all(np.abs(plant.position - at_cancel) < 0.1)
    assert np.all(plant.velocity == 0.0)


def test_cancel_of_another_goal_changes_nothing():
    plant = Plant()
    plant.start(goal())
    plant.controller.cancel(plant.now, "an older goal")
    assert plant.run(1.2).codes == [("goal", "succeeded", Code.SUCCESSFUL)]


def test_path_tolerance_of_the_parameters_aborts_and_names_the_joint():
    plant = Plant(constraints={"b": {"trajectory": 0.05}})
    plant.start(goal())
    plant.run(0.5)
    plant.disturbance = np.array([0.0, 0.1])
    plant.run(0.1)
    assert plant.codes == [("goal", "aborted", Code.PATH_TOLERANCE_VIOLATED)]
    assert "b is off" in plant.outcomes[0].text


def test_path_tolerance_of_the_goal_wins_and_negative_lifts_it():
    plant = Plant(constraints={"b": {"trajectory": 0.05}})
    plant.start(goal(path_tolerance={"b": Tolerance(-1.0)}))
    plant.disturbance = np.array([0.0, 0.1])
    plant.run(0.9)
    assert plant.codes == []


def test_path_tolerance_of_the_velocity_aborts():
    plant = Plant([joint("a"), joint("b")])
    plant.start(goal((1.0,), ((0.5, 0.0),), [[0.0, 0.0]], path_tolerance={"a": Tolerance(velocity=0.2)}))
    assert plant.run(0.3).codes == []
    plant.velocity = np.array([5.0, 0.0])
    point = plant.controller.update(plant.now, STEP_S, plant.position, plant.velocity)
    assert np.isfinite(point.position).all()
    assert [o.code for o in plant.controller.ended()] == [Code.PATH_TOLERANCE_VIOLATED]


@pytest.mark.parametrize("speed", [1e7, 1e200, 1e305])
def test_velocities_that_no_joint_has_are_rejected_with_their_value(speed):
    refused = refusal(goal((1.0, 2.0), ((1.0, 0.0), (0.5, 0.0)), [[speed, 0.0], [0.0, 0.0]]))
    assert refused.code == Code.INVALID_GOAL
    assert f"{speed:g}" in str(refused) and "point 0" in str(refused)


@pytest.mark.parametrize("kind", ["path_tolerance", "goal_tolerance"])
def test_tolerance_that_is_not_a_number_is_rejected(kind):
    assert refusal(goal(**{kind: {"a": Tolerance(math.nan)}})).code == Code.INVALID_GOAL


def test_goal_tolerance_violated_after_the_goal_time():
    plant = Plant(constraints={"goal_time": 0.5, "a": {"goal": 0.02}})
    plant.disturbance = np.array([0.1, 0.0])
    plant.start(goal())
    assert plant.run(1.4).codes == []
    assert plant.run(0.2).codes == [("goal", "aborted", Code.GOAL_TOLERANCE_VIOLATED)]


def test_goal_reached_within_the_goal_time_succeeds():
    plant = Plant(constraints={"goal_time": 0.5, "a": {"goal": 0.02}})
    plant.disturbance = np.array([0.1, 0.0])
    plant.start(goal())
    plant.run(1.2)
    plant.disturbance = np.zeros(2)
    assert plant.run(0.1).codes == [("goal", "succeeded", Code.SUCCESSFUL)]


def test_goal_time_of_the_goal_wins():
    plant = Plant(constraints={"goal_time": 0.1, "a": {"goal": 0.02}})
    plant.disturbance = np.array([0.1, 0.0])
    plant.start(goal(goal_time_tolerance_s=1.0))
    assert plant.run(1.9).codes == []
    assert plant.run(0.2).codes == [("goal", "aborted", Code.GOAL_TOLERANCE_VIOLATED)]


def test_set_points_never_exceed_velocity_limits():
    plant = Plant([joint("a", velocity=0.5), joint("b")], constraints={"goal_time": 3.0})
    plant.start(goal((0.5,), ((1.0, 1.0),)))
    plant.run(3.0)
    steps = np.diff(np.array([p for _, p, _ in plant.log])[:, 0])
    assert np.abs(steps).max() <= 0.5 * STEP_S + 1e-9
    assert plant.position == pytest.approx([1.0, 1.0])


def test_velocity_limit_that_held_a_goal_back_is_reported_by_name():
    plant = Plant([joint("a", velocity=0.5), joint("b")])
    plant.start(goal((0.5,), ((1.0, 1.0),)))
    plant.run(1.0)
    assert plant.controller.held_back == ["velocity limit of a"]
    assert "velocity limit of a" in plant.outcomes[0].text
    plant.run(2.0)
    plant.start(goal((3.0,), ((0.0, 0.0),)))
    plant.run(3.1)
    assert (plant.controller.held_back, plant.outcomes[-1].text) == ([], "")


def test_spline_overshoot_is_kept_within_position_limits():
    plant = Plant()
    plant.start(goal((0.5, 1.0), ((1.99, 0.0), (1.5, 0.0)), [[8.0, 0.0], [0.0, 0.0]]))
    plant.run(1.5)
    assert max(p[0] for _, p, _ in plant.log) <= 2.0


def test_continuous_joint_takes_the_short_way_round():
    turning = joint("a", -math.inf, math.inf, continuous=True)
    plant = Plant([turning, joint("b")], position=(3.0, 0.0))
    plant.start(goal(positions=((-3.0, 0.0),)))
    plant.run(1.2)
    assert plant.position[0] == pytest.approx(2 * math.pi - 3.0)
    assert plant.codes == [("goal", "succeeded", Code.SUCCESSFUL)]


@pytest.mark.parametrize("turns", [-3, -1, 1, 4])
def test_continuous_joint_several_turns_off_stays_on_its_turn_and_reaches_the_goal(turns):
    turning = joint("a", -math.inf, math.inf, continuous=True)
    at = 2 * math.pi * turns + 0.3
    plant = Plant(
        [turning, joint("b")], position=(at, 0.0), constraints={"a": {"trajectory": 0.1, "goal": 0.01}}
    )
    plant.start(goal((1.0, 2.0), ((0.1, 0.0), (0.0, 0.0)), [[0.0, 0.0]] * 2))
    plant.run(2.2)
    assert plant.position[0] == pytest.approx(at - 0.3)
    assert plant.codes == [("goal", "succeeded", Code.SUCCESSFUL)]


def test_continuous_joint_that_joins_a_long_turn_late_does_not_go_back():
    turning = joint("a", -math.inf, math.inf, continuous=True)
    plant = Plant([turning, joint("b")], position=(6.0, 0.0))
    plant.now = 3.0
    plant.start(goal((1.0, 2.9, 3.5), ((0.0, 0.0), (6.0, 0.0), (7.0, 0.0)), stamp_s=0.05))
    plant.run(0.8)
    assert plant.position[0] == pytest.approx(7.0)
    assert min(p[0] for _, p, _ in plant.log) > 5.9


def test_positions_alone_slow_a_moving_joint_down_first():
    plant = Plant()
    plant.start(goal((1.0,), ((1.5, 0.0),), [[0.0, 0.0]]), "first")
    plant.run(0.5)
    plant.start(goal((1.0,), ((0.5, 0.0),)), "second")
    plant.run(1.2)
    assert plant.codes[-1] == ("second", "succeeded", Code.SUCCESSFUL)
    speeds = np.array([v for _, _, v in plant.log])[:, 0]
    slowing = np.diff(speeds)[120:]
    assert slowing[speeds[120:-1] > 0.01].min() >= -5.0 * STEP_S - 1e-6  # joints without a limit: 5 rad/s^2


def test_reset_aborts_the_active_goal_and_holds_there():
    plant = Plant()
    plant.start(goal())
    plant.run(0.5)
    plant.controller.reset(np.array([0.2, 0.2]))
    plant.position = np.array([0.2, 0.2])
    plant.run(0.5)
    assert [o.status for o in plant.outcomes] == ["aborted"]
    assert plant.position == pytest.approx([0.2, 0.2])


def test_unknown_controller_type_and_constraint_are_named():
    with pytest.raises(ValueError, match="velocity_controllers"):
        ControllerConfig("velocity_controllers/JointTrajectoryController", ["a"])
    with pytest.raises(ValueError, match="a is there more than once"):
        ControllerConfig("position_controllers/JointTrajectoryController", ["a", "b", "a"])
    for constraints, words in (
        ({"a": 0.1}, "constraints: a"),
        ({"a": {"trajectory": "wide"}}, "trajectory"),
        ({"a": {"gaol": 0.1}}, "gaol"),
        ({"goal_time": [1.0]}, "goal_time"),
    ):
        with pytest.raises(ValueError, match=words):
            ControllerConfig("position_controllers/JointTrajectoryController", ["a"], constraints=constraints)
    with pytest.raises(ValueError, match="goal_tiem"):
        ControllerConfig(
            "position_controllers/JointTrajectoryController", ["a"], constraints={"goal_tiem": 1.0}
        )
