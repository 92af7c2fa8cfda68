"""The whole exploration without ROS: a flying camera in a box with a shelf, on the real map and evaluation."""

import numpy as np
import pytest
from flying_camera import FlyingCamera, Rooted, make

from fv_exploration.known_since import NEVER, KnownSince
from fv_exploration.outcome import SEEN_SHARE, Decision, Reason, nothing_left
from fv_exploration.robot import Plan, PlanStatus, Scan
from fv_exploration.strategy.ranking import Funnel


def test_a_room_is_explored_until_nothing_is_left():
    exploration, occupancy_map, listener = make(FlyingCamera())
    outcome = exploration.run()
    assert outcome.reason is Reason.COMPLETE
    assert outcome.views >= 3
    assert outcome.known_share > 0.8
    shares = [step.known_share for step in listener.steps]
    assert shares == sorted(shares)
    assert len(listener.steps) == outcome.views + 1, "the first scan is a step of its own"
    assert all(step.expected_gain_m3 > 0 for step in listener.steps[1:])
    wall = occupancy_map.classify(np.array([[0.55, 0.05, 0.5], [-0.4, 0.0, 1.0]]))
    assert wall.tolist() == [1, 0]


def test_equal_seeds_give_equal_views():
    robots = [FlyingCamera(), FlyingCamera()]
    for robot in robots:
        make(robot, max_views=5)[0].run()
    assert np.array_equal(np.array(robots[0].visited), np.array(robots[1].visited))


def test_every_plan_is_asked_for_on_the_newest_map():
    robot = FlyingCamera()
    exploration, occupancy_map, _ = make(robot, max_views=4)
    exploration.run()
    assert robot.map_sequences == sorted(robot.map_sequences)
    assert robot.map_sequences[-1] <= occupancy_map.sequence


def test_the_view_budget_ends_it():
    outcome = make(FlyingCamera(), max_views=2)[0].run()
    assert (outcome.reason, outcome.views) == (Reason.VIEW_BUDGET, 2)


def test_the_time_budget_ends_it():
    outcome = make(FlyingCamera(), max_seconds=5.0)[0].run()
    assert (outcome.reason, outcome.views) == (Reason.TIME_BUDGET, 3)


def test_a_cancelled_exploration_says_so_and_keeps_its_map():
    asked = []
    outcome = make(FlyingCamera())[0].run(stop=lambda: len(asked) > 5 or bool(asked.append(1)))
    assert outcome.reason is Reason.CANCELLED
    assert outcome.known_share > 0


def test_views_that_cannot_be_planned_from_the_first_on_are_a_failure():
    robot = FlyingCamera(plans_fail=True)
    outcome = make(robot)[0].run()
    assert (outcome.reason, outcome.views) == (Reason.FAILED, 0)
    assert "no view was reached: the planner found no motion to any of" in outcome.message
    assert "no path" in outcome.message
    assert robot.visited == []


def test_views_that_cannot_be_planned_after_others_end_it():
    robot = FlyingCamera()
    robot.planning = robot.plan
    robot.plan = lambda *asked: (
        Plan(PlanStatus.NO_PATH, "no path") if robot.visited else robot.planning(*asked)
    )
    outcome = make(robot)[0].run()
    assert (outcome.reason, outcome.views) == (Reason.COMPLETE, 1)
    assert "no path" in outcome.message


@pytest.mark.parametrize("views", [0, 2])
def test_a_robot_that_cannot_leave_where_it_is_is_a_failure_at_once(views):
    robot = FlyingCamera()
    robot.planning, refusals = robot.plan, []

    def plan(*asked):
        if len(robot.visited) < views:
            return robot.planning(*asked)
        refusals.append(1)
        return Plan(PlanStatus.START_IN_UNKNOWN, "start: link 'hand' meets the unknown voxel")

    robot.plan = plan
    outcome = make(robot)[0].run()
    assert (outcome.reason, outcome.views) == (Reason.FAILED, views)
    assert "cannot move: start: link 'hand' meets" in outcome.message
    assert len(refusals) == 1


def test_an_arm_that_reaches_no_view_is_a_failure():
    outcome = make(FlyingCamera(), capability=Rooted())[0].run()
    assert (outcome.reason, outcome.views) == (Reason.FAILED, 0)
    assert "can be held by the arm" in outcome.message


def test_a_camera_that_sees_nothing_of_the_volume_is_a_failure_that_says_so():
    robot = FlyingCamera()
    robot.scan = lambda: Scan(np.full((100, 3), np.nan), robot.pose)
    exploration, _, listener = make(robot)
    outcome = exploration.run()
    assert (outcome.reason, outcome.views) == (Reason.FAILED, 0)
    assert "known free space" in outcome.message
    assert "no scan had a usable return" in outcome.message
    assert "100 points: 100 without return" in listener.warnings[0]


def test_returns_out_of_range_are_told_with_what_was_seen():
    robot = FlyingCamera()
    robot.scan = lambda: Scan(np.full((100, 3), 1000.0), robot.pose)
    exploration, _, listener = make(robot)
    outcome = exploration.run()
    assert outcome.reason is Reason.FAILED, "free space alone is not an exploration"
    assert "usable return" in outcome.message
    assert "ranges are 1732 to 1732 m" in listener.warnings[0]
    assert "valid: 0.05 to 3 m; they look like millimetres" in listener.warnings[0]


def test_points_that_no_sensor_sees_are_told_and_change_nothing():
    maps, told = [], []
    for extra in (np.zeros((0, 3)), np.array([[0, 0, 0], [1e-29, 0, 0], [1e30, 0, 0], [1e300, 1, 1]])):
        robot = FlyingCamera()
        sees = robot.scan
        robot.scan = lambda sees=sees, extra=extra: Scan(np.concatenate([sees().points, extra]), np.eye(4))
        exploration, occupancy_map, listener = make(robot, max_views=1)
        exploration.run()
        maps.append(occupancy_map.full_data())
        told.append(listener.warnings)
    assert maps[0] == maps[1]
    assert not any("no sensor sees" in text for text in told[0])
    assert "4 of 3076 points (0.13 %)" in told[1][0]


def test_views_that_are_worth_nothing_are_a_failure_where_little_is_known():
    outcome = make(FlyingCamera(), min_gain_m3=50.0)[0].run()
    assert (outcome.reason, outcome.views) == (Reason.FAILED, 0)
    assert "expected to show 50 m^3 or more" in outcome.message


def test_a_volume_that_the_first_scan_shows_whole_is_complete_and_says_so():
    exploration, occupancy_map, _ = make(FlyingCamera())
    grid = np.arange(-0.95, 1.0, 0.1)
    occupancy_map.mark_free(np.stack(np.meshgrid(grid, grid, grid + 1.0), -1).reshape(-1, 3))
    outcome = exploration.run()
    assert (outcome.reason, outcome.views) == (Reason.COMPLETE, 0)
    assert outcome.known_share > SEEN_SHARE
    assert "the first scan has shown it all" in outcome.message


@pytest.mark.parametrize("known_share", [0.0, 1.0])
@pytest.mark.parametrize("refused", [0, 3])
@pytest.mark.parametrize("hidden", [0, 2])
@pytest.mark.parametrize("left", range(5))
def test_without_a_view_it_is_complete_only_when_all_is_known_and_nothing_was_refused(
    left, hidden, refused, known_share
):
    funnel = Funnel(*(9 if sieve < left else 0 for sieve in range(4)))
    decision = Decision(funnel, refused, "no path", hidden)
    reason, message = nothing_left(decision, 0, known_share, 0.1)
    complete = not refused and funnel.reachable > 0 and known_share == 1.0
    assert (reason is Reason.COMPLETE) == complete
    assert len(message.split()) > 5
    assert nothing_left(decision, 1, known_share, 0.1)[0] is Reason.COMPLETE


def test_a_time_budget_without_a_view_is_a_failure():
    robot = FlyingCamera(motions_fail=True)
    outcome = make(robot, max_seconds=1.0)[0].run()
    assert (outcome.reason, outcome.views) == (Reason.FAILED, 0)
    assert "time budget" in outcome.message
    assert "stuck" in outcome.message


def test_motions_that_keep_failing_are_a_failure():
    outcome = make(FlyingCamera(motions_fail=True))[0].run()
    assert outcome.reason is Reason.FAILED
    assert "stuck" in outcome.message


def test_a_camera_without_clouds_is_a_failure_that_says_why():
    outcome = make(FlyingCamera(blind=range(1, 1000)))[0].run()
    assert outcome.reason is Reason.FAILED
    assert "no cloud" in outcome.message
    outcome = make(FlyingCamera(blind=range(3, 1000)))[0].run()
    assert (outcome.reason, outcome.views) == (Reason.FAILED, 5)


@pytest.mark.parametrize("blind", [range(1, 3), range(4, 5), range(4, 7)])
def test_scans_that_fail_now_and_then_do_not_end_it(blind):
    exploration, _, listener = make(FlyingCamera(blind=blind))
    outcome = exploration.run()
    assert outcome.reason is Reason.COMPLETE
    assert outcome.known_share > 0.8
    missed = [step for step in listener.steps if "integrate" not in step.seconds]
    assert len(missed) == (len(blind) if blind[0] > 1 else 0)
    assert all(step.real_gain_m3 == 0 and step.known_share > 0 and step.counts for step in missed)


def test_a_view_that_the_robot_hides_stands_back_for_one_that_it_does_not():
    robot = FlyingCamera(arm=True)
    exploration, _, listener = make(robot, max_views=6)
    assert exploration.run().views == 6
    assert robot.hidden_plans > 0, "some motions end where the arm is in the way"
    assert not any(robot.turned), "none of them is executed as long as there are others"
    assert all(step.real_gain_m3 > 0 for step in listener.steps[1:])


def test_a_robot_that_always_hides_its_view_does_not_move():
    robot = FlyingCamera(arm=True)
    robot.hides = lambda rays_m, joints: np.ones(len(rays_m), dtype=bool)
    outcome = make(robot)[0].run()
    assert (outcome.reason, outcome.views, robot.visited) == (Reason.FAILED, 0, [])
    assert "the robot itself would hide" in outcome.message


def test_a_motion_that_was_cancelled_is_no_view():
    robot = FlyingCamera(motions_fail=True)
    exploration, _, listener = make(robot)
    outcome = exploration.run(stop=lambda: robot.time_s > 0)
    assert (outcome.reason, outcome.views) == (Reason.CANCELLED, 0)
    assert [step.view for step in listener.steps] == [0]


def test_a_motion_that_was_not_finished_is_no_new_view():
    robot = FlyingCamera(motions_fail=True)
    exploration, _, listener = make(robot, max_failed_motions=3)
    outcome = exploration.run()
    assert (outcome.reason, outcome.views) == (Reason.FAILED, 0)
    assert [step.view for step in listener.steps] == [0, 0, 0], "scans from where it stopped are kept"


def test_known_since_remembers_the_first_view(tmp_path):
    known = KnownSince(np.zeros(3), np.array([0.2, 0.1, 0.1]), 0.1)
    known.update(1, lambda centres: np.where(centres[:, 0] < 0.1, 0, -1).astype(np.int8))
    known.update(2, lambda centres: np.zeros(len(centres), dtype=np.int8))
    known.write(tmp_path / "known.npz")
    assert np.load(tmp_path / "known.npz")["view"].ravel().tolist() == [1, 2]
    never = KnownSince(np.zeros(3), np.array([0.1, 0.1, 0.1]), 0.1)
    never.write(tmp_path / "never.npz")
    assert np.load(tmp_path / "never.npz")["view"].ravel().tolist() == [NEVER]


@pytest.mark.parametrize("reason", list(Reason))
def test_every_reason_is_a_sentence(reason):
    assert len(reason.value.split()) >= 2
