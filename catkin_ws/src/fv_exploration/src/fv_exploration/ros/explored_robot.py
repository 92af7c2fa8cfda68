"""The robot on the parameter server, and the parts of an exploration that are made of it."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import rospy
from numpy.typing import NDArray

from capability_map import CapabilityMap, default_map_path
from fv_exploration import Evaluator, OccupancyMap, PinholeCamera, ScanConfig
from fv_exploration.explore_config import ExploreConfig, ViewSettings
from fv_exploration.gain_judge import GainJudge
from fv_exploration.robot_body import CarriedCamera, Clearance, RobotBody
from fv_exploration.strategy import Reach
from fv_exploration.strategy.reachable_views import CameraFit, DrawnViews, ReachableViews
from hubo_description.check import require_shapes

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ExploredRobot:
    """What the explorer reads of the robot; ``hubo_description`` writes it.

    :param group: SRDF group that explores.
    :param capability_group: whose capability map says what it can hold; empty: views are drawn.
    :param camera: the sensor's entry of sensors.yaml.
    """

    name: str
    base_link: str
    group: str
    capability_group: str
    camera: Mapping[str, Any]
    clearance: Clearance
    links_without_shape: Sequence[str]
    urdf_xml: str
    srdf_xml: str

    @staticmethod
    def from_parameters(group: str) -> ExploredRobot:
        """:param group: empty: the robot's exploring group. :raises ValueError, KeyError: what is not set."""
        robot = parameter("/robot")
        exploring = robot["exploration"]
        return ExploredRobot(
            name=robot["name"],
            base_link=robot["base_link"],
            group=group or exploring["group"],
            capability_group=exploring["capability_group"],
            camera=parameter("/sensors")[exploring["camera"]],
            clearance=exploring.get("clearance", {}),
            links_without_shape=exploring.get("links_without_shape", []),
            urdf_xml=parameter("/robot_description"),
            srdf_xml=parameter("/robot_description_semantic"),
        )

    def capability(self, path: str) -> CapabilityMap | None:
        """None: the group has no map and needs none. :param path: empty: where it lies by its names."""
        if not self.capability_group:
            return None
        path = path or str(default_map_path(self.name, self.capability_group))
        return CapabilityMap.load(path, urdf_xml=self.urdf_xml)

    def body(self, T_map_root: Array, padding_m: float) -> RobotBody:
        """:raises ValueError: a link is drawn but has no shape, and nobody has said that this is right."""
        body = RobotBody(self.urdf_xml, self.srdf_xml, T_map_root, padding_m)
        if body.model.bare_links:
            rospy.logwarn("links without <collision>: %s", ", ".join(body.model.bare_links))
        require_shapes(body.model, self.group, self.links_without_shape, "/robot_description")
        return body

    def reach(
        self, body: RobotBody, occupancy_map: OccupancyMap, capability: CapabilityMap | None, step_deg: float
    ) -> Reach:
        """Which views the group can hold. :param step_deg: grid of the joints before the capability map's base."""
        if capability is None:
            return DrawnViews(
                functools.partial(body.random_views, self.group),
                functools.partial(occupancy_map.voxels, "free"),
                CameraFit(body.tip_balls(self.group, occupancy_map.resolution_m), occupancy_map.classify),
            )
        bases = body.base_poses(self.group, self.capability_group, math.radians(step_deg))
        return ReachableViews(capability, bases)

    def gain_judge(
        self, body: RobotBody, occupancy_map: OccupancyMap, evaluator: Evaluator, views: ViewSettings
    ) -> GainJudge:
        """Who expects what the camera will show."""
        cell_m = max(views.return_cell_m, occupancy_map.resolution_m)
        camera = CarriedCamera(body, self.group)
        return GainJudge(occupancy_map, evaluator, self.ray_camera(views), cell_m, camera)

    def ray_camera(self, views: ViewSettings) -> PinholeCamera:
        """The robot's camera, with as many rays as the expected gain is to be cast with."""
        return PinholeCamera(
            width=views.ray_columns,
            height=views.ray_rows,
            horizontal_fov_rad=math.radians(self.camera["horizontal_fov_deg"]),
            vertical_fov_rad=math.radians(self.camera["vertical_fov_deg"]),
            min_range_m=self.camera["min_range_m"],
            max_range_m=self.camera["max_range_m"],
        )

    def scan_config(self, config: ExploreConfig) -> ScanConfig:
        """Range limits of the camera, and what a ray without return proves."""
        return ScanConfig(
            min_range_m=self.camera["min_range_m"],
            max_range_m=self.camera["max_range_m"],
            no_return_clear_m=config.scan.no_return_clear_m,
        )


def parameter(name: str) -> Any:
    """A parameter of the robot; ValueError that says how it gets there when it is not set."""
    if not rospy.has_param(name):
        raise ValueError(
            f"parameter {name} is not set; 'rosrun hubo_description upload_robot --robot ROBOT' sets it"
        )
    return rospy.get_param(name)
