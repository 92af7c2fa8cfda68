"""The explore action: one goal, one exploration."""

from __future__ import annotations

import functools
import logging
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import actionlib
import numpy as np
import rospy
from fv_msgs.msg import AttachedObjects, ExploreAction, ExploreFeedback, ExploreGoal, ExploreResult
from numpy.typing import NDArray

from capability_map import CapabilityMap, default_map_path
from fv_common.ros_master import wait_for_master
from fv_exploration import (
    EvaluationConfig,
    Evaluator,
    MapConfig,
    OccupancyMap,
    PinholeCamera,
    ScanConfig,
    start_checks,
)
from fv_exploration.exploration import Exploration, ExplorationError
from fv_exploration.explore_config import ExploreConfig
from fv_exploration.gain_judge import GainJudge
from fv_exploration.outcome import Outcome, Reason
from fv_exploration.robot_body import (
    CarriedCamera,
    HeldObject,
    RobotBody,
    clearance_boxes,
    clearance_voxels,
)
from fv_exploration.ros import explore_goal
from fv_exploration.ros.audience import MapPublisher, RosAudience
from fv_exploration.ros.conversions import held_objects
from fv_exploration.ros.robot import RosRobot
from fv_exploration.run_folder import RunFolder
from fv_exploration.strategy.frontier_void import ViewChooser
from fv_exploration.strategy.reachable_views import CameraFit, DrawnViews, ReachableViews
from fv_exploration.warning_list import WarningList
from hubo_description.check import require_shapes
from hubo_description.schema import from_mapping

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


def parameter(name: str) -> Any:
    """A parameter of the robot; ValueError that says how it gets there when it is not set."""
    if not rospy.has_param(name):
        raise ValueError(
            f"parameter {name} is not set; 'rosrun hubo_description upload_robot --robot ROBOT' sets it"
        )
    return rospy.get_param(name)


class ExploreServer:
    """Assembles an exploration for each goal and runs it.

    Reads the robot from the parameter server (see ``hubo_description``) and its own parameters below ``~``.
    """

    def __init__(self) -> None:
        self._config = from_mapping(ExploreConfig, rospy.get_param("~config", {}), "config")
        self._map_frame: str = rospy.get_param("~map_frame", "world").lstrip("/")
        self._out_dir: str = rospy.get_param("~out_dir", "")
        self._robot_config: dict[str, Any] = parameter("/robot")
        self._exploring: dict[str, Any] = self._robot_config["exploration"]
        self._camera_config: dict[str, Any] = parameter("/sensors")[self._exploring["camera"]]
        self._group: str = self._config.motion.group or self._exploring["group"]
        self._capability = self._load_capability()  # None: the group has no map and needs none
        self._warnings = WarningList(lambda text: rospy.logwarn("%s", text))
        self._suspicions: list[str] = []  # of the start: told with a failure
        self._map_publisher = MapPublisher(self._map_frame)
        self._body: RobotBody | None = None
        self._robot = RosRobot(
            self._config,
            self._map_frame,
            self._group,
            lambda *scan: self._body.is_robot(*scan),
            self._stop,
            self._warnings.add,
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

    def _load_capability(self) -> CapabilityMap | None:
        if not self._exploring["capability_group"]:
            return None
        path = rospy.get_param("~capability_map", "") or default_map_path(
            self._robot_config["name"], self._exploring["capability_group"]
        )
        return CapabilityMap.load(path, urdf_xml=parameter("/robot_description"))

    def _stop(self) -> bool:
        return rospy.is_shutdown() or (self._server.is_active() and self._server.is_preempt_requested())

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
        pose_of = functools.partial(self._robot.pose_of, stamp=goal.header.stamp)
        volume = explore_goal.volume(goal, self._map_frame, config, pose_of)
        for text in volume.warnings:
            self._warnings.add(text)
        bounds = volume.bounds
        self._robot.wait_until_ready()
        occupancy_map = self._new_map(bounds)
        evaluator = Evaluator(occupancy_map, EvaluationConfig(min_fit=self._config.evaluation.min_fit))
        judge = self._judge(occupancy_map, evaluator)
        audience = self._audience(bounds)
        exploration = Exploration(
            occupancy_map,
            evaluator,
            judge,
            self._chooser(occupancy_map, judge),
            self._scan_config(),
            self._robot,
            audience,
            config,
            goal.seed,
        )
        outcome = exploration.run(self._stop)
        audience.finish()
        return outcome

    def _new_map(self, bounds: tuple[Array, Array]) -> OccupancyMap:
        """A map in which only the robot's own space and what the operator vouches for is known."""
        settings = self._config.map
        T_map_root = self._robot.pose_of(self._robot_config["base_link"])
        self._body = RobotBody(
            parameter("/robot_description"),
            parameter("/robot_description_semantic"),
            T_map_root,
            self._config.scan.self_filter_padding_m,
        )
        if self._body.model.bare_links:
            rospy.logwarn("links without <collision>: %s", ", ".join(self._body.model.bare_links))
        require_shapes(
            self._body.model,
            self._group,
            self._exploring.get("links_without_shape", []),
            "/robot_description",
        )
        self._body.hold(self._held)
        occupancy_map = OccupancyMap(
            MapConfig(**vars(settings), bounds_min=tuple(bounds[0]), bounds_max=tuple(bounds[1]))
        )
        passive = self._body.model.passive_joints
        self._robot.require_joints([name for name in self._body.model.joint_names if name not in passive])
        joints = self._robot.joint_positions()
        body = self._body.voxels(joints, settings.resolution_m, self._config.start.body_padding_m)
        vouched = clearance_voxels(self._clearance(), self._robot.pose_of, settings.resolution_m)
        self._check_start(joints, vouched, bounds)
        occupancy_map.mark_free(np.concatenate([body, vouched]))
        return occupancy_map

    def _check_start(self, joints: dict[str, float], vouched: Array, bounds: tuple[Array, Array]) -> None:
        """Warn of what is likely to keep the arm from moving; a failure without a view is told with it."""
        balls = self._body.moved_balls(self._group, joints, MAX_BALL_M)
        camera = self._body.camera_pose(self._group, joints)[:3, 3]
        texts = (
            start_checks.body_outside(balls, bounds) or start_checks.camera_outside(camera, bounds),
            start_checks.clearance_outside(vouched, bounds),
        )
        self._suspicions = [text for text in texts if text]
        for text in self._suspicions:
            self._warnings.add(text)

    def _clearance(self) -> dict[str, Any]:
        return self._exploring.get("clearance", {})

    def _judge(self, occupancy_map: OccupancyMap, evaluator: Evaluator) -> GainJudge:
        camera = CarriedCamera(self._body, self._group)
        cell_m = max(self._config.views.return_cell_m, occupancy_map.resolution_m)
        return GainJudge(occupancy_map, evaluator, self._ray_camera(), cell_m, camera)

    def _chooser(self, occupancy_map: OccupancyMap, judge: GainJudge) -> ViewChooser:
        return ViewChooser(
            self._config.views, self._reachable_views(occupancy_map), judge, occupancy_map.classify
        )

    def _reachable_views(self, occupancy_map: OccupancyMap) -> ReachableViews | DrawnViews:
        if self._capability is None:
            balls = self._body.tip_balls(self._group, occupancy_map.resolution_m)
            return DrawnViews(
                functools.partial(self._body.random_views, self._group),
                functools.partial(occupancy_map.voxels, "free"),
                CameraFit(balls, occupancy_map.classify),
            )
        step_rad = math.radians(self._config.views.waist_step_deg)
        base_poses = self._body.base_poses(self._group, self._exploring["capability_group"], step_rad)
        return ReachableViews(self._capability, base_poses)

    def _ray_camera(self) -> PinholeCamera:
        """The robot's camera, with as many rays as the expected gain is to be cast with."""
        sensor = self._camera_config
        return PinholeCamera(
            width=self._config.views.ray_columns,
            height=self._config.views.ray_rows,
            horizontal_fov_rad=math.radians(sensor["horizontal_fov_deg"]),
            vertical_fov_rad=math.radians(sensor["vertical_fov_deg"]),
            min_range_m=sensor["min_range_m"],
            max_range_m=sensor["max_range_m"],
        )

    def _scan_config(self) -> ScanConfig:
        return ScanConfig(
            min_range_m=self._camera_config["min_range_m"],
            max_range_m=self._camera_config["max_range_m"],
            no_return_clear_m=self._config.scan.no_return_clear_m,
        )

    def _audience(self, bounds: tuple[Array, Array]) -> RosAudience:
        audience = RosAudience(
            self._map_frame,
            self._ray_camera(),
            self._map_publisher,
            lambda *figures: self._server.publish_feedback(ExploreFeedback(*figures)),
            self._warnings.add,
            RunFolder(Path(self._out_dir)) if self._out_dir else None,
            self._config.snapshot_service,
        )
        audience.volume(bounds, clearance_boxes(self._clearance(), self._robot.pose_of))
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
