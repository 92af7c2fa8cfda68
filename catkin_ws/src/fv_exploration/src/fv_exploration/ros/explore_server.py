"""The explore action: one goal, one exploration."""

from __future__ import annotations

import functools
import logging
from dataclasses import replace
from pathlib import Path

import actionlib
import numpy as np
import rospy
from fv_msgs.msg import AttachedObjects, ExploreAction, ExploreFeedback, ExploreGoal, ExploreResult
from numpy.typing import NDArray

from fv_common.ros_master import wait_for_master
from fv_common.schema import from_mapping
from fv_exploration import (
    EvaluationConfig,
    Evaluator,
    MapConfig,
    OccupancyMap,
    start_checks,
)
from fv_exploration.bounds import Bounds
from fv_exploration.exploration import Exploration
from fv_exploration.explore_config import ExploreConfig
from fv_exploration.outcome import Outcome, Reason
from fv_exploration.robot import ExplorationError, StrategyError
from fv_exploration.robot_body import (
    HeldObject,
    RobotBody,
    clearance_boxes,
    clearance_spheres,
    clearance_voxels,
)
from fv_exploration.ros import explore_goal
from fv_exploration.ros.audience import MapPublisher, RosAudience
from fv_exploration.ros.conversions import held_objects
from fv_exploration.ros.explored_robot import ExploredRobot
from fv_exploration.ros.robot import RosRobot
from fv_exploration.run_folder import RunFolder
from fv_exploration.strategy import load_strategy
from fv_exploration.view_worth import ViewWorth
from fv_exploration.warning_list import WarningList

Array = NDArray[np.float64]

MAX_BALL_M = 0.02
"""Of the balls that stand for the arm when the bounds are checked."""
STATUS = {
    Reason.COMPLETE: ExploreResult.COMPLETE,
    Reason.VIEW_BUDGET: ExploreResult.VIEW_BUDGET,
    Reason.TIME_BUDGET: ExploreResult.TIME_BUDGET,
    Reason.CANCELLED: ExploreResult.CANCELLED,
    Reason.FAILED: ExploreResult.FAILED,
}


class ExploreServer:
    """Assembles an exploration for each goal and runs it.

    Reads the robot from the parameter server (see ``hubo_description``) and its own parameters below ``~``.
    """

    def __init__(self) -> None:
        self._config = from_mapping(ExploreConfig, rospy.get_param("~config", {}), "config")
        load_strategy(self._config.policy, self._config.policy_parameters)  # said now if there is none
        self._map_frame: str = rospy.get_param("~map_frame", "world").lstrip("/")
        self._out_dir: str = rospy.get_param("~out_dir", "")
        self._explored = ExploredRobot.from_parameters(self._config.motion.group)
        self._capability = self._explored.capability(rospy.get_param("~capability_map", ""))
        self._warnings = WarningList(lambda text: rospy.logwarn("%s", text))
        self._suspicions: list[str] = []  # of the start: told with a failure
        self._map_publisher = MapPublisher(self._map_frame)
        self._body: RobotBody | None = None  # of the goal that is or was worked on
        self._robot = RosRobot(
            self._config, self._map_frame, self._explored.group, self._stop, self._warnings.add
        )
        self._server = actionlib.SimpleActionServer(
            "/explore", ExploreAction, self._on_goal, auto_start=False
        )
        self._held: list[HeldObject] = []
        self._held_sub = rospy.Subscriber(
            "/ompl_planner/attached_objects", AttachedObjects, self._on_attached, queue_size=1
        )
        self._server.start()

    def _on_attached(self, msg: AttachedObjects) -> None:
        self._held = held_objects(msg)
        if self._body is not None:
            self._body.hold(self._held)

    def _stop(self) -> bool:
        return bool(rospy.is_shutdown()) or (self._server.is_active() and self._server.is_preempt_requested())

    def _on_goal(self, goal: ExploreGoal) -> None:
        self._warnings.clear()
        self._suspicions = []
        outcome = self._outcome(goal)
        result = ExploreResult(
            status=STATUS[outcome.reason],
            message=outcome.message,
            views=outcome.views,
            known_share=outcome.known_share,
            map_path=str(RunFolder(Path(self._out_dir)).map_path) if self._out_dir else "",
            metrics_path=str(RunFolder(Path(self._out_dir)).metrics_path) if self._out_dir else "",
            warnings=self._warnings.lines(),
        )
        if outcome.reason is Reason.FAILED:
            rospy.logerr("exploration failed: %s", outcome.message)
            self._server.set_aborted(result, outcome.message)
        elif outcome.reason is Reason.CANCELLED:
            self._server.set_preempted(result, outcome.message)
        else:
            self._server.set_succeeded(result, outcome.message)

    def _outcome(self, goal: ExploreGoal) -> Outcome:
        """How the exploration ended; whatever goes wrong is an outcome, too."""
        try:
            outcome = self._explore(goal)
        except (ValueError, ExplorationError, OSError) as error:
            outcome = Outcome(Reason.FAILED, str(error), 0, 0.0)
        except Exception as error:  # the last resort: the goal gets an answer, the log the traceback
            logging.getLogger("rospy").exception("the exploration broke")
            outcome = Outcome(Reason.FAILED, f"internal error: {type(error).__name__}: {error}", 0, 0.0)
        if isinstance(outcome.error, StrategyError):  # whoever writes strategies wants to know where
            logging.getLogger("rospy").error("%s", outcome.message, exc_info=outcome.error.__cause__)
        if outcome.reason is Reason.FAILED and self._stop():
            return replace(outcome, reason=Reason.CANCELLED)
        if outcome.reason is Reason.CANCELLED and self._server.is_new_goal_available():
            return replace(outcome, message="another goal took its place")
        if outcome.reason is Reason.FAILED and outcome.views == 0 and self._suspicions:
            return replace(outcome, message="; ".join([outcome.message, *self._suspicions]))
        return outcome

    def _explore(self, goal: ExploreGoal) -> Outcome:
        if self._stop():
            raise ExplorationError("it was cancelled before it began")
        config = explore_goal.configured(goal, self._config)
        strategy = load_strategy(config.policy, config.policy_parameters)
        pose_of = functools.partial(self._robot.pose_of, stamp=goal.header.stamp)
        volume = explore_goal.volume(goal, self._map_frame, config, pose_of)
        for text in volume.warnings:
            self._warnings.add(text)
        bounds = volume.bounds
        self._robot.wait_until_ready()
        body = self._new_body()
        occupancy_map = self._new_map(body, bounds)
        evaluator = Evaluator(occupancy_map, EvaluationConfig(min_fit=self._config.evaluation.min_fit))
        audience = self._audience(bounds)
        exploration = Exploration(
            occupancy_map,
            evaluator,
            self._explored.scan_config(config),
            strategy,
            self._explored.reach(body, occupancy_map, self._capability, config.views.waist_step_deg),
            ViewWorth(self._explored.gain_judge(body, occupancy_map, evaluator, config.views), config.views),
            self._robot,
            audience,
            config,
            goal.seed,
        )
        outcome = exploration.run(self._stop)
        audience.finish()
        return outcome

    def _new_body(self) -> RobotBody:
        """The robot where it stands, with what it holds; from now on its points are left out of scans."""
        T_map_root = self._robot.pose_of(self._explored.base_link)
        body = self._explored.body(T_map_root, self._config.scan.self_filter_padding_m)
        body.hold(self._held)
        self._body = self._robot.body = body
        return body

    def _new_map(self, body: RobotBody, bounds: Bounds) -> OccupancyMap:
        """A map in which only the robot's own space and what the operator vouches for is known."""
        settings = self._config.map
        occupancy_map = OccupancyMap(
            MapConfig(**vars(settings), bounds_min=tuple(bounds[0]), bounds_max=tuple(bounds[1]))
        )
        passive = body.model.passive_joints
        self._robot.require_joints([name for name in body.model.joint_names if name not in passive])
        joints = self._robot.joint_positions()
        own = body.voxels(joints, settings.resolution_m, self._config.start.body_padding_m)
        vouched = clearance_voxels(self._explored.clearance, self._robot.pose_of, settings.resolution_m)
        self._check_start(body, joints, vouched, bounds)
        occupancy_map.mark_free(np.concatenate([own, vouched]))
        return occupancy_map

    def _check_start(self, body: RobotBody, joints: dict[str, float], vouched: Array, bounds: Bounds) -> None:
        """Warn of what is likely to keep the arm from moving; a failure without a view is told with it."""
        balls = body.moved_balls(self._explored.group, joints, MAX_BALL_M)
        camera = body.camera_pose(self._explored.group, joints)[:3, 3]
        texts = (
            start_checks.body_outside(balls, bounds) or start_checks.camera_outside(camera, bounds),
            start_checks.clearance_outside(vouched, bounds),
        )
        self._suspicions = [text for text in texts if text]
        for text in self._suspicions:
            self._warnings.add(text)

    def _audience(self, bounds: Bounds) -> RosAudience:
        audience = RosAudience(
            self._map_frame,
            self._explored.ray_camera(self._config.views),
            self._map_publisher,
            lambda *figures: self._server.publish_feedback(ExploreFeedback(*figures)),
            self._warnings.add,
            RunFolder(Path(self._out_dir)) if self._out_dir else None,
            self._config.snapshot_service,
        )
        clearance, pose_of = self._explored.clearance, self._robot.pose_of
        audience.volume(bounds, clearance_boxes(clearance, pose_of), clearance_spheres(clearance, pose_of))
        return audience


def main() -> int:
    """Run the node until it is shut down; the exit code."""
    wait_for_master("explore_node")
    rospy.init_node("fv_exploration")
    try:
        _server = ExploreServer()
    except (KeyError, OSError, ValueError) as error:
        rospy.logfatal("explore_node cannot start: %s", error)
        return 1
    rospy.spin()
    return 0
