"""The explore action: one goal, one exploration."""

from __future__ import annotations

import functools
import math
from pathlib import Path
from typing import Any

import actionlib
import numpy as np
import rospy
from fv_msgs.msg import AttachedObjects, ExploreAction, ExploreFeedback, ExploreGoal, ExploreResult
from numpy.typing import NDArray

from capability_map import CapabilityMap, default_map_path
from fv_exploration import (
    EvaluationConfig,
    Evaluator,
    MapConfig,
    OccupancyMap,
    PinholeCamera,
    ScanConfig,
)
from fv_exploration.conversions import held_objects
from fv_exploration.exploration import Exploration, ExplorationError, Outcome, Reason
from fv_exploration.explore_config import ExploreConfig
from fv_exploration.gain_judge import GainJudge
from fv_exploration.reachable_views import CameraFit, DrawnViews, ReachableViews
from fv_exploration.robot_body import (
    CarriedCamera,
    HeldObject,
    RobotBody,
    clearance_boxes,
    clearance_voxels,
)
from fv_exploration.ros_audience import MapPublisher, RosAudience
from fv_exploration.ros_robot import RosRobot
from fv_exploration.run_folder import RunFolder
from fv_exploration.view_choice import ViewChooser
from hubo_description.schema import from_mapping

Array = NDArray[np.float64]

STATUS = {
    Reason.COMPLETE: ExploreResult.COMPLETE,
    Reason.VIEW_BUDGET: ExploreResult.VIEW_BUDGET,
    Reason.TIME_BUDGET: ExploreResult.TIME_BUDGET,
    Reason.CANCELLED: ExploreResult.CANCELLED,
    Reason.FAILED: ExploreResult.FAILED,
}


def bounds_from_goal(goal: ExploreGoal) -> tuple[Array, Array]:
    """The exploration volume's corners (3,) [m]; ValueError when it is inside out or not finite."""
    minimum = np.array([goal.bounds.min.x, goal.bounds.min.y, goal.bounds.min.z])
    maximum = np.array([goal.bounds.max.x, goal.bounds.max.y, goal.bounds.max.z])
    if not (np.isfinite([minimum, maximum]).all() and (minimum < maximum).all()):
        raise ValueError(f"bounds are {minimum} to {maximum}; valid: finite, each minimum below its maximum")
    return minimum, maximum


class ExploreServer:
    """Assembles an exploration for each goal and runs it.

    Reads the robot from the parameter server (see ``hubo_description``) and its own parameters below ``~``.
    """

    def __init__(self) -> None:
        self._config = from_mapping(ExploreConfig, rospy.get_param("~config", {}), "config")
        self._map_frame: str = rospy.get_param("~map_frame", "world")
        self._out_dir: str = rospy.get_param("~out_dir", "")
        self._robot_config: dict[str, Any] = rospy.get_param("/robot")
        self._exploring: dict[str, Any] = self._robot_config["exploration"]
        self._camera_config: dict[str, Any] = rospy.get_param("/sensors")[self._exploring["camera"]]
        self._group: str = self._config.motion.group or self._exploring["group"]
        self._capability = self._load_capability()  # None: the group has no map and needs none
        self._map_publisher = MapPublisher(self._map_frame)
        self._body: RobotBody | None = None
        self._robot = RosRobot(
            self._config, self._map_frame, self._group, lambda *scan: self._body.is_robot(*scan), self._stop
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
        return CapabilityMap.load(path, urdf_xml=rospy.get_param("/robot_description"))

    def _stop(self) -> bool:
        return rospy.is_shutdown() or (self._server.is_active() and self._server.is_preempt_requested())

    def _on_goal(self, goal: ExploreGoal) -> None:
        try:
            outcome = self._explore(goal)
        except (ValueError, ExplorationError, OSError) as error:
            outcome = Outcome(Reason.FAILED, str(error), 0, 0.0)
        result = ExploreResult(
            status=STATUS[outcome.reason],
            message=outcome.message,
            views=outcome.views,
            known_share=outcome.known_share,
            map_path=str(RunFolder(Path(self._out_dir)).map_path) if self._out_dir else "",
            metrics_path=str(RunFolder(Path(self._out_dir)).metrics_path) if self._out_dir else "",
        )
        if outcome.reason is Reason.FAILED:
            rospy.logerr("exploration failed: %s", outcome.message)
            self._server.set_aborted(result, outcome.message)
        elif outcome.reason is Reason.CANCELLED:
            self._server.set_preempted(result, outcome.message)
        else:
            self._server.set_succeeded(result, outcome.message)

    def _explore(self, goal: ExploreGoal) -> Outcome:
        if goal.header.frame_id not in ("", self._map_frame):
            raise ValueError(f"bounds are in frame {goal.header.frame_id!r}; valid: {self._map_frame!r}")
        bounds = bounds_from_goal(goal)
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
            self._with_budgets(goal),
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
            rospy.get_param("/robot_description"),
            rospy.get_param("/robot_description_semantic"),
            T_map_root,
            self._config.scan.self_filter_padding_m,
        )
        self._body.hold(self._held)
        occupancy_map = OccupancyMap(
            MapConfig(**vars(settings), bounds_min=tuple(bounds[0]), bounds_max=tuple(bounds[1]))
        )
        joints = self._robot.joint_positions()
        body = self._body.voxels(joints, settings.resolution_m, self._config.start.body_padding_m)
        vouched = clearance_voxels(self._clearance(), self._robot.pose_of, settings.resolution_m)
        occupancy_map.mark_free(np.concatenate([body, vouched]))
        return occupancy_map

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
            RunFolder(Path(self._out_dir)) if self._out_dir else None,
            self._config.snapshot_service,
        )
        audience.volume(bounds, clearance_boxes(self._clearance(), self._robot.pose_of))
        return audience

    def _with_budgets(self, goal: ExploreGoal) -> ExploreConfig:
        """The configuration with the goal's budgets, where it has some."""
        stop = dict(vars(self._config.stop))
        if goal.max_views:
            stop["max_views"] = goal.max_views
        if goal.max_seconds:
            stop["max_seconds"] = goal.max_seconds
        sections = {name: value for name, value in vars(self._config).items() if name != "stop"}
        return ExploreConfig(**sections, stop=type(self._config.stop)(**stop))
