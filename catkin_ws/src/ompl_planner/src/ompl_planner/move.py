"""Command line of the planner: plan a motion to a named pose, joint values or a tip pose, then execute it."""

from __future__ import annotations

import argparse
import sys

import actionlib
import rospy
from fv_msgs.msg import (
    ExecuteMotionAction,
    ExecuteMotionGoal,
    ExecuteMotionResult,
    PlanMotionAction,
    PlanMotionGoal,
    PlanMotionResult,
)
from geometry_msgs.msg import Pose

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


def parser() -> argparse.ArgumentParser:
    """The options, with their units."""
    result = argparse.ArgumentParser(prog="move", description=__doc__)
    goal = result.add_mutually_exclusive_group(required=True)
    goal.add_argument("--named", metavar="NAME", help="named pose of the group (SRDF group_state)")
    goal.add_argument("--joints", nargs="+", type=parse_joint, metavar="JOINT=RAD", help="joint values [rad]")
    goal.add_argument(
        "--pose",
        nargs=7,
        type=float,
        metavar=("X", "Y", "Z", "QX", "QY", "QZ", "QW"),
        help="pose of the tip [m]",
    )
    result.add_argument("--group", default="", help="SRDF group; default: the robot's exploring group")
    result.add_argument("--frame", default="", help="frame of --pose; default: the map frame")
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
    result.add_argument("--plan-only", action="store_true", help="do not execute")
    return result


def goal_from_args(args: argparse.Namespace, group: str) -> PlanMotionGoal:
    """The planning request that the options ask for."""
    goal = PlanMotionGoal(group=group, planner=args.planner, time_budget=args.budget, seed=args.seed)
    goal.unknown_space = UNKNOWN_SPACE[args.unknown]
    if args.named:
        goal.goal_type = PlanMotionGoal.GOAL_NAMED
        goal.goal_name = args.named
    elif args.joints:
        goal.goal_type = PlanMotionGoal.GOAL_JOINTS
        goal.goal_joints.name = [name for name, _ in args.joints]
        goal.goal_joints.position = [value for _, value in args.joints]
    else:
        goal.goal_type = PlanMotionGoal.GOAL_POSES
        pose = Pose()
        pose.position.x, pose.position.y, pose.position.z = args.pose[:3]
        orientation = pose.orientation
        orientation.x, orientation.y, orientation.z, orientation.w = args.pose[3:]
        goal.goal_poses.header.frame_id = args.frame
        goal.goal_poses.poses = [pose]
        goal.free_roll = args.free_roll
    return goal


def call(name: str, action: type, goal: object) -> object:
    """Send a goal and wait for its result; Ctrl-C cancels it.

    :raises ConnectionError: the planner does not answer within 5 s.
    """
    client = actionlib.SimpleActionClient(name, action)
    if not client.wait_for_server(rospy.Duration(5.0)):
        raise ConnectionError(f"{name} does not answer: is planner_node running?")
    rospy.on_shutdown(client.cancel_goal)
    client.send_goal(goal)
    client.wait_for_result()
    result = client.get_result()
    if result is None:
        raise ConnectionError(f"{name} gave no result")
    return result


def move(args: argparse.Namespace) -> int:
    """Plan, then execute unless told otherwise; 0 on success, 1 with one line on stderr."""
    group = args.group or rospy.get_param("/robot", {}).get("exploration", {}).get("group", "")
    plan = call("/ompl_planner/plan", PlanMotionAction, goal_from_args(args, group))
    if plan.status != PlanMotionResult.SUCCESS:
        print(f"move: no plan: {plan.message}", file=sys.stderr)
        return 1
    print(
        f"plan: {len(plan.trajectory.points)} points, {plan.duration:.2f} s, {plan.path_length:.2f} rad, "
        f"clearance {plan.clearance:.3f} m, map {plan.map_sequence}"
    )
    if args.plan_only:
        return 0
    goal = ExecuteMotionGoal(trajectory=plan.trajectory, map_sequence=plan.map_sequence)
    done = call("/ompl_planner/execute", ExecuteMotionAction, goal)
    if done.status != ExecuteMotionResult.SUCCESS:
        print(f"move: not executed: {done.message}", file=sys.stderr)
        return 1
    print(f"executed, largest tracking error {done.max_tracking_error:.4f} rad")
    return 0


def main(argv: list[str] | None = None) -> int:
    """Entry point of ``rosrun ompl_planner move``."""
    args = parser().parse_args(rospy.myargv(argv)[1:] if argv is None else argv)
    rospy.init_node("move", anonymous=True)
    try:
        return move(args)
    except ConnectionError as err:
        print(f"move: {err}", file=sys.stderr)
        return 1
