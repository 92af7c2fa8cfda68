"""Command line of the planner: plan a motion to a named pose, joint values or a pose, then execute it."""

from __future__ import annotations

import argparse
import sys
import time

import actionlib
import rospy
from actionlib import CommState
from fv_msgs.msg import (
    PlanAndExecuteAction,
    PlanAndExecuteGoal,
    PlanAndExecuteResult,
    PlanMotionAction,
    PlanMotionGoal,
    PlanMotionResult,
)
from geometry_msgs.msg import Pose

from fv_common.command import Parser
from fv_common.ros_master import require_master

CONNECT_S = 5.0
POLL_S = 0.02

UNKNOWN_SPACE = {
    "obstacle": PlanMotionGoal.UNKNOWN_IS_OBSTACLE,
    "free": PlanMotionGoal.UNKNOWN_IS_FREE,
}


def parse_joint(text: str) -> tuple[str, float]:
    """Split ``JOINT=RADIANS``."""
    name, separator, value = text.partition("=")
    if not separator or not name:
        raise argparse.ArgumentTypeError(f"'{text}' is not JOINT=RADIANS")
    try:
        return name, float(value)
    except ValueError as err:
        raise argparse.ArgumentTypeError(f"'{value}' is not a number of radians") from err


def parser() -> Parser:
    """The options, with their units."""
    result = Parser(prog="move", description=__doc__)
    goal = result.add_mutually_exclusive_group(required=True)
    goal.add_argument("--named", metavar="NAME", help="named pose of the group (SRDF group_state)")
    goal.add_argument("--joints", nargs="+", type=parse_joint, metavar="JOINT=RAD", help="joint values [rad]")
    numbers = {"nargs": 7, "type": float, "metavar": ("X", "Y", "Z", "QX", "QY", "QZ", "QW")}
    goal.add_argument("--pose", **numbers, help="pose of the tip [m]")
    goal.add_argument(
        "--camera", **numbers, help="pose of the camera's optical frame, z forward [m]; any roll will do"
    )
    result.add_argument("--group", default="", help="SRDF group; default: the robot's exploring group")
    result.add_argument("--frame", default="", help="frame of the pose; default: the map frame")
    result.add_argument("--tip", default="", help="link that --pose speaks of; default: the group's tip")
    result.add_argument(
        "--free-roll", action="store_true", help="any rotation about the tip's z axis will do"
    )
    result.add_argument("--planner", default="", help="planner; default: the configured one")
    result.add_argument(
        "--budget", type=float, default=0.0, help="computing time [s]; default: the configured one"
    )
    result.add_argument("--seed", type=int, default=1, help="seed of the search (default: %(default)s)")
    result.add_argument(
        "--unknown", choices=sorted(UNKNOWN_SPACE), default="obstacle", help="how unknown space counts"
    )
    result.add_argument(
        "--exact-turns",
        action="store_true",
        help="continuous joints go to the very value, by whole turns if need be, not to the nearest equal angle",
    )
    result.add_argument("--plan-only", action="store_true", help="do not execute")
    return result


def pose_from_numbers(numbers: list[float]) -> Pose:
    """Position x y z [m], then quaternion x y z w."""
    pose = Pose()
    pose.position.x, pose.position.y, pose.position.z = numbers[:3]
    orientation = pose.orientation
    orientation.x, orientation.y, orientation.z, orientation.w = numbers[3:]
    return pose


def goal_from_args(args: argparse.Namespace, group: str, camera_frame: str = "") -> PlanMotionGoal:
    """The planning request that the options ask for; ``camera_frame`` is what --camera speaks of."""
    goal = PlanMotionGoal(group=group, planner=args.planner, time_budget=args.budget, seed=args.seed)
    goal.unknown_space = UNKNOWN_SPACE[args.unknown]
    goal.exact_turns = args.exact_turns
    if args.named:
        goal.goal_type = PlanMotionGoal.GOAL_NAMED
        goal.goal_name = args.named
    elif args.joints:
        goal.goal_type = PlanMotionGoal.GOAL_JOINTS
        goal.goal_joints.name = [name for name, _ in args.joints]
        goal.goal_joints.position = [value for _, value in args.joints]
    else:
        goal.goal_type = PlanMotionGoal.GOAL_POSES
        goal.goal_poses.header.frame_id = args.frame
        goal.goal_poses.poses = [pose_from_numbers(args.camera or args.pose)]
        goal.tip_link = camera_frame if args.camera else args.tip
        goal.free_roll = args.free_roll or bool(args.camera)
    return goal


def call(name: str, action: type, goal: object) -> object:
    """Send a goal and wait for its result; Ctrl-C cancels it.

    The planner must answer within 5 s of wall time: a simulated clock that stands still must not keep a user waiting.

    :raises ConnectionError: the planner does not answer, or went away.
    """
    client = actionlib.ActionClient(name, action)
    deadline_s = time.monotonic() + CONNECT_S
    ends = (client.pub_goal, client.pub_cancel, client.feedback_sub, client.result_sub)
    while not all(end.get_num_connections() > 0 for end in ends):
        if rospy.is_shutdown() or time.monotonic() > deadline_s:
            raise ConnectionError(f"{name} does not answer: is planner_node running?")
        time.sleep(POLL_S)
    handle = client.send_goal(goal)
    try:
        while handle.get_comm_state() not in (CommState.DONE, CommState.LOST):
            if rospy.is_shutdown() or client.pub_goal.get_num_connections() == 0:
                raise ConnectionError(f"{name} went away")
            time.sleep(POLL_S)
    except KeyboardInterrupt:
        handle.cancel()
        raise
    result = handle.get_result()
    if result is None or result.status == result.NO_RESULT:
        raise ConnectionError(f"{name} gave no result: {handle.get_goal_status_text()}")
    return result


def describe(plan: PlanMotionResult) -> str:
    """One line about a plan."""
    return (
        f"plan: {len(plan.trajectory.points)} points, {plan.duration:.2f} s, {plan.path_length:.2f} rad, "
        f"clearance {plan.clearance:.3f} m, map {plan.map_sequence}, "
        f"computed in {1e3 * sum(plan.stage_seconds):.0f} ms"
    )


def exploring(key: str) -> str:
    """An entry of the robot's exploration: its group or its camera; empty when there is none."""
    return rospy.get_param("/robot", {}).get("exploration", {}).get(key, "")


def camera_frame() -> str:
    """Optical frame of the exploring camera; empty when there is none."""
    return rospy.get_param("/sensors", {}).get(exploring("camera"), {}).get("optical_frame", "")


def move(args: argparse.Namespace) -> int:
    """Plan, and execute unless told otherwise; 0 on success, 1 with one line on stderr."""
    goal = goal_from_args(args, args.group or exploring("group"), camera_frame())
    if args.plan_only:
        plan = call("/ompl_planner/plan", PlanMotionAction, goal)
        done = None
    else:
        done = call("/ompl_planner/plan_and_execute", PlanAndExecuteAction, PlanAndExecuteGoal(plan=goal))
        plan = done.plan
    if plan.status != PlanMotionResult.SUCCESS:
        print(f"move: no plan: {plan.message}", file=sys.stderr)
        return 1
    print(describe(plan))
    if done is None:
        return 0
    if done.status != PlanAndExecuteResult.SUCCESS:
        print(f"move: not executed: {done.message}", file=sys.stderr)
        return 1
    print(f"executed, largest tracking error {done.execution.max_tracking_error:.4f} rad")
    return 0


def main(argv: list[str] | None = None) -> int:
    """Entry point of ``rosrun ompl_planner move``."""
    args = parser().parse_args(rospy.myargv(argv)[1:] if argv is None else argv)
    require_master()
    try:
        rospy.init_node("move", anonymous=True, disable_signals=True)
        return move(args)
    except ConnectionError as err:
        print(f"move: {err}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("move: cancelled", file=sys.stderr)
        return 130
