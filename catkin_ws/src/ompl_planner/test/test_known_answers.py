"""Problems that are solvable, or not, by construction; and what the answers say."""

import numpy as np
import pytest
from ompl_planner import _core
from planar_arm import URDF, make_planner, make_request, pillar

Status = _core.PlanStatus
SUCCESS, NO_PATH, NO_MAP, CANCELLED = Status.SUCCESS, Status.NO_PATH, Status.NO_MAP, Status.CANCELLED
INVALID, NO_IK, GOALS_HIT = Status.INVALID_REQUEST, Status.NO_IK_SOLUTION, Status.GOALS_IN_COLLISION
START_HIT, START_UNKNOWN = Status.START_IN_COLLISION, Status.START_IN_UNKNOWN
RIGHT, LEFT = -np.pi / 2, np.pi / 2


@pytest.fixture(scope="module")
def planner():
    return make_planner(time_budget_s=2.0)


def test_open_space_is_crossed_straight(planner):
    result = planner.solve(make_request(planner, goal=(2.0, 0.5)))
    assert result["status"] == SUCCESS, result["message"]
    assert len(result["waypoints"]) == 2
    assert result["path_length"] == pytest.approx(np.hypot(2.0, 0.5))


def test_a_wall_that_leaves_a_gap_is_passed_by_folding(planner):
    request = make_request(planner, occupied=pillar(LEFT, inner=0.6), goal=(2.5, 0.0))
    result = planner.solve(request)
    assert result["status"] == SUCCESS, result["message"]
    assert np.abs(result["trajectory"]["positions"][:, 1]).max() > 1.0  # the elbow folded
    assert planner.judge(request, result["trajectory"]) == ""


def test_an_arm_that_touches_itself_at_the_start_is_told_the_pair_and_what_helps():
    post = "<link name='base'><collision><origin xyz='0.2 0.07 0.55'/><geometry><box size='0.04 0.04 0.04'/></geometry>"
    planner = make_planner(urdf=URDF.replace('<link name="base"/>', post + "</collision></link>"))
    result = planner.solve(make_request(planner, start=(0.0, 2.8), goal=(0.0, 0.0)))
    assert result["status"] == START_HIT
    assert "links 'base' and 'fore' touch" in result["message"]
    assert "compute_disabled_pairs --robot" in result["message"]
    assert planner.solve(make_request(planner, start=(0.0, 1.0), goal=(0.0, 0.0)))["status"] == SUCCESS


# RRTstar gives different paths for equal seeds, and roadmaps are kept; the README says so.
@pytest.mark.parametrize("name", ["RRTConnect", "BITstar"])
def test_planners_find_the_gap_twice_alike(planner, name):
    request = make_request(planner, occupied=pillar(LEFT, inner=0.6), goal=(2.5, 0.0))
    request.planner = name
    first, second = planner.solve(request), planner.solve(request)
    assert first["status"] == SUCCESS, first["message"]
    np.testing.assert_array_equal(first["trajectory"]["positions"], second["trajectory"]["positions"])


@pytest.mark.parametrize("name", _core.planner_names())
def test_every_planner_finds_the_gap(planner, name):
    request = make_request(planner, occupied=pillar(LEFT, inner=0.6), goal=(2.5, 0.0))
    request.planner = name
    result = planner.solve(request)
    assert result["status"] == SUCCESS, result["message"]
    assert planner.judge(request, result["trajectory"]) == ""


@pytest.mark.parametrize("name", ["PRM", "LazyPRM"])
class TestRoadmaps:
    """A roadmap serves the next query; new obstacles are never passed because of what it remembers."""

    def test_it_is_kept_while_the_map_only_becomes_freer(self, name):
        # As fine as the check of the result: a path that only a finer search mends would end the roadmap.
        planner = make_planner(time_budget_s=5.0, search_step_rad=0.0087, joint_step_rad=0.0087)
        request = make_request(planner, occupied=pillar(LEFT, inner=0.6), goal=(2.5, 0.0))
        request.planner = name
        first = planner.solve(request)
        assert first["status"] == SUCCESS and first["roadmap_states"] > 0
        freer = make_request(planner, occupied=pillar(LEFT, inner=0.65), goal=(2.4, 0.3))
        freer.planner = name
        second = planner.solve(freer)
        assert second["status"] == SUCCESS
        assert second["roadmap_states"] > first["roadmap_states"]
        assert planner.judge(freer, second["trajectory"]) == ""

    def test_what_it_remembers_is_no_way_through_a_new_wall(self, name):
        planner = make_planner(time_budget_s=1.0)
        request = make_request(planner, occupied=pillar(LEFT, inner=0.6), goal=(2.5, 0.0))
        request.planner = name
        assert planner.solve(request)["status"] == SUCCESS
        closed = make_request(planner, occupied=pillar(LEFT, inner=0.2), goal=(2.5, 0.0))
        closed.planner = name
        assert planner.solve(closed)["status"] == NO_PATH
        assert planner.solve(request)["status"] == SUCCESS


def test_a_wall_without_a_gap_is_never_passed(planner):
    request = make_request(planner, occupied=pillar(LEFT, inner=0.2), goal=(2.5, 0.0))
    result = planner.solve(request)
    assert result["status"] == NO_PATH
    assert "states checked" in result["message"]


def test_the_other_way_round_a_joint_limit_bars_the_way(planner):
    occupied = pillar(LEFT, inner=0.2) + pillar(RIGHT, inner=0.2)
    assert planner.solve(make_request(planner, occupied=occupied, goal=(-2.5, 0.0)))["status"] == NO_PATH


@pytest.mark.parametrize("policy", ["OBSTACLE", "FREE"])
def test_unknown_space_bars_the_way_as_asked(planner, policy):
    request = make_request(planner, unknown=pillar(LEFT, inner=0.2), goal=(2.5, 0.0))
    request.unknown_space = getattr(_core.UnknownSpace, policy)
    expected = SUCCESS if policy == "FREE" else NO_PATH
    assert planner.solve(request)["status"] == expected


def test_a_bubble_frees_unknown_space_near_the_start_only(planner):
    near, far = pillar(0.3, inner=0.2), pillar(2.5, inner=0.2)
    request = make_request(planner, unknown=near + far, goal=(1.5, 0.0))
    request.unknown_space = _core.UnknownSpace.FREE_NEAR_START
    request.bubble_radius_m = 0.4
    assert planner.solve(request)["status"] == SUCCESS
    request.goal_joints = [("shoulder", 2.8), ("elbow", 0.0)]
    assert planner.solve(request)["status"] == NO_PATH


@pytest.mark.parametrize("checker", ["distance_field", "judge", "fcl_octree"])
def test_all_checkers_take_unknown_space_as_asked(planner, checker):
    request = make_request(planner, unknown=pillar(LEFT, inner=0.2))
    inside = np.array([[LEFT, 0.0]])
    assert planner.check_states(request, inside, checker=checker) == [False]
    request.unknown_space = _core.UnknownSpace.FREE
    assert planner.check_states(request, inside, checker=checker) == [True]


def test_a_start_inside_an_obstacle_names_link_and_voxel(planner):
    result = planner.solve(make_request(planner, occupied=pillar(0.0, inner=0.2), goal=(2.0, 0.0)))
    assert result["status"] == START_HIT
    assert "link 'upper'" in result["message"] and "occupied voxel" in result["message"]


def test_a_start_in_unknown_space_says_so(planner):
    result = planner.solve(make_request(planner, unknown=pillar(0.0, inner=0.2), goal=(2.0, 0.0)))
    assert result["status"] == START_UNKNOWN


def test_a_start_that_grazes_a_voxel_may_leave_but_not_go_deeper(planner):
    # The fore link's edge is at y = 0.02; the voxels begin there, so only padding and tolerance overlap.
    grazed = [[0.5, 0.02, 0.3, 0.7, 0.08, 0.8]]
    away = make_request(planner, occupied=grazed, goal=(-1.0, 0.0))
    assert planner.solve(away)["status"] == SUCCESS
    into = make_request(planner, occupied=grazed, goal=(0.15, 0.0))
    assert planner.solve(into)["status"] == GOALS_HIT


def test_what_one_link_grazes_is_no_hole_for_another(planner):
    grazed = [[0.5, 0.02, 0.3, 0.7, 0.08, 0.8]]
    request = make_request(planner, occupied=grazed, goal=(0.5, -0.8))
    result = planner.solve(request)
    assert result["status"] in (GOALS_HIT, SUCCESS)
    if result["status"] == SUCCESS:
        assert planner.judge(request, result["trajectory"]) == ""


def test_a_plan_stands_when_judged_again_with_everything_known(planner):
    request = make_request(planner, occupied=pillar(LEFT, inner=0.6), goal=(2.5, 0.0))
    trajectory = planner.solve(request)["trajectory"]
    blocked = make_request(planner, occupied=pillar(LEFT, inner=0.2), goal=(2.5, 0.0))
    assert "link" in planner.judge(blocked, trajectory)


def test_poses_out_of_reach_have_no_solution(planner):
    request = make_request(planner)
    request.goal_type = _core.GoalType.POSES
    far = np.eye(4)
    far[:3, 3] = [3.0, 0.0, 0.55]
    request.set_goal_poses([far])
    result = planner.solve(request)
    assert result["status"] == NO_IK and result["poses_tried"] == 1


def poses_around(planner, *states):
    """T_map_tip (4, 4) of the joint states."""
    return [planner.tip_pose("arm", np.array(q)) for q in states]


def test_one_pose_of_many_is_reached(planner):
    request = make_request(planner)
    request.goal_type = _core.GoalType.POSES
    far = np.eye(4)
    far[:3, 3] = [3.0, 0.0, 0.55]
    poses = [far, *poses_around(planner, (0.4, 1.2))]
    request.set_goal_poses(poses)
    result = planner.solve(request)
    assert result["status"] == SUCCESS and result["goal_index"] == 1
    end = planner.tip_pose("arm", result["trajectory"]["positions"][-1])
    np.testing.assert_allclose(end, poses[1], atol=1e-5)


def test_a_roll_about_the_named_axis_is_free(planner):
    request = make_request(planner)
    request.goal_type = _core.GoalType.POSES
    pose = poses_around(planner, (0.4, 1.2))[0]
    turned = np.eye(4)
    turned[1:3, 1:3] = [[0.0, -1.0], [1.0, 0.0]]  # a quarter turn about x: the arm never leaves its plane
    request.set_goal_poses([pose @ turned])
    assert planner.solve(request)["status"] == NO_IK
    request.free_roll = True
    assert planner.solve(request)["status"] == NO_IK  # about z, that is
    request.roll_axis = np.array([1.0, 0.0, 0.0])
    assert planner.solve(request)["status"] == SUCCESS


def test_a_seed_helps_inverse_kinematics_and_must_fit(planner):
    request = make_request(planner)
    request.goal_type = _core.GoalType.POSES
    request.set_goal_poses(poses_around(planner, (-1.0, 2.0)))
    request.goal_seeds = [np.array([-1.1, 1.9])]
    result = planner.solve(request)
    assert result["status"] == SUCCESS
    np.testing.assert_allclose(result["trajectory"]["positions"][-1], [-1.0, 2.0], atol=1e-4)
    request.goal_seeds = [np.array([0.0])]
    result = planner.solve(request)
    assert result["status"] == INVALID and "seed" in result["message"]


def test_a_goal_where_the_arm_stands_is_no_motion(planner):
    result = planner.solve(make_request(planner, goal=(0.0, 0.0)))
    assert result["status"] == SUCCESS and result["path_length"] == 0.0
    assert len(result["trajectory"]["times"]) == 1


def test_cancelled_is_said(planner):
    request = make_request(planner, occupied=pillar(LEFT, inner=0.6), goal=(2.5, 0.0))
    assert planner.solve(request, cancelled=True)["status"] == CANCELLED


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("group", "leg", "arm"),
        ("planner", "Magic", "RRTConnect"),
        ("time_budget_s", -1.0, "time_budget"),
        ("time_budget_s", float("nan"), "time_budget"),
        ("bubble_radius_m", -1.0, "bubble_radius"),
        ("start_all", np.array([np.nan, 0.0]), "shoulder"),
        ("start_all", np.array([3.5, 0.0]), "limits"),
        ("goal_joints", [("shoulder", 9.0)], "shoulder"),
        ("goal_joints", [("wrist", 0.0)], "elbow"),
        ("goal_joints", [("elbow", float("inf"))], "elbow"),
        ("goal_joints", [("elbow", 0.1), ("shoulder", 0.2), ("elbow", 0.3)], "'elbow' more than once"),
    ],
)
def test_bad_requests_are_refused_with_a_reason(planner, field, value, words):
    request = make_request(planner, goal=(2.5, 0.0), occupied=pillar(LEFT, inner=0.6))
    setattr(request, field, value)
    result = planner.solve(request)
    assert result["status"] == INVALID and words in result["message"]


def test_no_map_is_said(planner):
    request = make_request(planner, goal=(1.0, 0.0))
    request.map = _core.PlanRequest().map
    assert planner.solve(request)["status"] == NO_MAP


@pytest.mark.parametrize(
    ("config", "words"),
    [
        ({"paddding_m": 0.1}, "padding_m"),
        ({"padding_m": "wide"}, "number"),
        ({"limit_share": 2.0}, "limit_share"),
    ],
)
def test_bad_configuration_names_the_parameter(config, words):
    with pytest.raises(ValueError, match=words):
        make_planner(**config)


def test_what_the_arm_holds_collides_too(planner):
    # The wall begins beyond the bare arm's reach of 0.8 m; a stick of 0.2 m reaches into it.
    free = [[-1.2, -1.2, 0.3, 1.2, 1.2, 0.8]]
    stick = {"name": "stick", "link": "fore", "edges_m": [0.2, 0.02, 0.02], "T_link_box": np.eye(4)}
    stick["T_link_box"][0, 3] = 0.5
    holding = planner.holding_box(**stick, touch_links=["tip"])
    occupied = pillar(1.2, inner=0.86, outer=1.1)
    for arm, start_waypoints in ((planner, 2), (holding, 3)):
        request = make_request(arm, occupied=occupied, free=free, goal=(2.0, 0.0))
        result = arm.solve(request)
        assert result["status"] == SUCCESS, result["message"]
        assert len(result["waypoints"]) >= start_waypoints
    assert "stick" in holding.judge(request, planner.solve(request)["trajectory"])
    with pytest.raises(ValueError, match="fore"):
        planner.holding_box(**{**stick, "link": "leg"})
    with pytest.raises(ValueError, match="tip"):
        planner.holding_box(**{**stick, "name": "tip"})
