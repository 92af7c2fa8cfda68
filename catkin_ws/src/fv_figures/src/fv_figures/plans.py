"""The robot on the stage, and a real plan of the real planner for figure 5.8."""

from __future__ import annotations

import actionlib
import numpy as np
import rospy
from fv_msgs.msg import MapUpdate, PlanMotionAction, PlanMotionGoal, PlannedPath
from geometry_msgs.msg import Pose, Quaternion, TransformStamped, Vector3
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from fv_common.conversions import pose_from_matrix
from fv_figures import sources
from fv_figures.stage import FRAME, PATIENCE_S, Stage
from fv_viz.drawing.robot import RobotShapes

GOAL = "home"  # named pose that the plan ends in


def bring_robot(stage: Stage, robot: str) -> dict[str, float]:
    """Upload the robot, place it in the world and show its start pose; returns its joint positions."""
    positions = sources.start_positions(robot)
    code = stage.run("hubo_description", "upload_robot", "--robot", robot).process.wait()
    if code != 0:
        raise sources.NoData(f"upload_robot ended with code {code}")
    place = TransformStamped(
        header=Header(frame_id="world", stamp=rospy.Time.now()), child_frame_id="base_link"
    )
    place.transform.translation = Vector3(0.0, 0.0, base_height(robot))
    place.transform.rotation = Quaternion(0.0, 0.0, 0.0, 1.0)
    stage.publish("/tf_static", TFMessage([place]))
    stage.run("robot_state_publisher", "robot_state_publisher")
    model = RobotShapes(rospy.get_param("/robot_description"))
    everything = {**dict.fromkeys(model.joint_names, 0.0), **positions}
    stage.joints(everything)
    stage.wait_for_frames()
    return everything


def link_places(robot: str, positions: dict[str, float]) -> dict[str, np.ndarray]:
    """Where the frames of all links are (3,) [m], in the world."""
    poses = RobotShapes(rospy.get_param("/robot_description")).link_poses(positions)
    return {name: T[:3, 3] + np.array([0.0, 0.0, base_height(robot)]) for name, T in poses.items()}


def camera_frame() -> str:
    """Optical frame of the robot's first sensor."""
    return next(iter(rospy.get_param("/sensors").values()))["optical_frame"]


def base_height(robot: str) -> float:
    """Height of the base link over the floor [m]."""
    from hubo_description import load_robot

    return float(getattr(load_robot(robot).config, "base_height_m", 0.0) or 0.0)


def in_world(robot: str, frame: str, positions: dict[str, float], points) -> np.ndarray:
    """Points (N, 3) of one of the robot's frames, in the world."""
    T = RobotShapes(rospy.get_param("/robot_description")).link_poses(positions)[frame]
    return np.asarray(points, dtype=float) @ T[:3, :3].T + T[:3, 3] + np.array([0.0, 0.0, base_height(robot)])


def planned_path(stage: Stage, robot: str, positions: dict[str, float]) -> tuple[PlannedPath, str]:
    """A plan from the start pose to a named one; raises NoData when the planner does not answer with one."""
    stage.run("ompl_planner", "planner_node")
    client = actionlib.SimpleActionClient("/ompl_planner/plan", PlanMotionAction)
    if not client.wait_for_server(rospy.Duration(PATIENCE_S)):
        raise sources.NoData("the planner does not come up")
    goal = PlanMotionGoal(group="right_arm", goal_type=PlanMotionGoal.GOAL_NAMED, goal_name=GOAL, seed=1)
    goal.unknown_space, goal.min_map_sequence = PlanMotionGoal.UNKNOWN_IS_FREE, 1
    goal.start = JointState(name=list(positions), position=list(positions.values()))
    stage.publish("/fv_exploration/map", _empty_map())
    client.send_goal(goal)
    if not client.wait_for_result(rospy.Duration(PATIENCE_S)):
        raise sources.NoData(f"the planner did not answer within {PATIENCE_S:g} s")
    result = client.get_result()
    if result is None or not result.trajectory.points:
        raise sources.NoData(f"no plan: {result.message if result else 'the planner died'}")
    path = PlannedPath(
        header=FRAME, trajectory=result.trajectory, tip_poses=_tips(result.trajectory, positions)
    )
    path.tip_poses = [_lifted(pose, base_height(robot)) for pose in path.tip_poses]
    return path, f"/ompl_planner/plan, robot {robot}, group right_arm, start pose to {GOAL}, seed 1"


def _tips(trajectory, positions: dict[str, float]) -> list[Pose]:
    """The camera's way along a trajectory, in the root link's frame."""
    model = RobotShapes(rospy.get_param("/robot_description"))
    frame, names = camera_frame(), trajectory.joint_names
    states = [{**positions, **dict(zip(names, p.positions, strict=True))} for p in trajectory.points[::5]]
    return [pose_from_matrix(model.link_poses(state)[frame]) for state in states]


def _lifted(pose: Pose, height: float) -> Pose:
    pose.position.z += height
    return pose


def _empty_map() -> MapUpdate:
    """An octree of nothing but free space about the robot, as the map's owner writes it."""
    from fv_exploration import _core
    from fv_exploration.ros import conversions

    grid = _core.OccupancyMap(_core.MapConfig(resolution_m=0.1, bounds_min=[-1, -1, 0], bounds_max=[1, 1, 2]))
    grid.mark_free(np.array([[0.0, 0.0, 1.0]]))
    return conversions.map_update_msg(grid, conversions.octomap_msg(grid, FRAME, True))
