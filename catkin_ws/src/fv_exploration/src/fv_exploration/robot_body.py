"""The robot in its own map: points on its links, the space it occupies, and space the operator vouches for."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fv_robot_model import (
    LinkFilterConfig,
    RobotModel,
    SelfFilter,
    SelfFilterConfig,
    Shape,
    body_voxels,
    package_file,
    sphere_cover,
)

Array = NDArray[np.float64]
Clearance = Mapping[str, Sequence[Mapping[str, Any]]]
"""``clearance`` of robot.yaml: lists ``boxes`` and ``spheres``, each entry with its frame, centre and size."""
PoseOf = Callable[[str], Array]
"""(4, 4) pose of a frame in the map frame."""
SCENE = 0
"""Labels of ``SelfFilter.classify``: a point of the scene ..."""
NO_RETURN = 3
"""... and a row of NaN."""
FAR_M = 1000.0
"""Longer than any ray of a camera."""
HOUSING_M = 0.01
"""A link so near to a camera's optical centre is the camera's own housing, which does not hide its view."""
MAX_CLEARANCE_VOXELS = 2e7
"""In one vouched box or sphere: what is vouched for is modest, and the memory is finite."""
TURN_RAD = 2.0 * math.pi
"""An unlimited joint is drawn within one turn to either side."""


@dataclass(frozen=True)
class HeldObject:
    """Something that a link holds: it moves with the robot and is no part of the scene."""

    name: str
    link: str
    touch_links: tuple[str, ...]
    shape: Shape  # in the link's frame


class RobotBody:
    """Kinematics and shapes of the robot, as far as the exploration needs them.

    :param T_map_root: (4, 4) pose of the robot's root link in the map frame; the base does not move.
    :param padding_m: of the self-filter.
    """

    def __init__(self, urdf_xml: str, srdf_xml: str, T_map_root: Array, padding_m: float) -> None:
        self.model = RobotModel.from_xml(urdf_xml, srdf_xml, package_file)
        self._T_map_root = T_map_root
        self._filter_config = SelfFilterConfig(padding_m=padding_m)
        self.hold([])

    def hold(self, objects: Sequence[HeldObject]) -> None:
        """From now on the robot holds just these objects.

        :raises ValueError: a link that the robot does not have, or a name that is taken.
        """
        laden = self.model
        for item in objects:
            laden = laden.with_attached(
                item.name, item.link, [item.shape], touch_links=list(item.touch_links)
            )
        self._laden, self._filter = laden, SelfFilter(laden, self._filter_config)
        self._occluders: dict[str, SelfFilter] = {}

    def joint_vector(self, positions: Mapping[str, float]) -> Array:
        """(J,) values of all joints [rad or m]; a joint that is not named stands at 0."""
        return np.array([positions.get(name, 0.0) for name in self.model.joint_names], dtype=float)

    def is_robot(
        self, points: Array, T_map_sensor: Array, positions: Mapping[str, float]
    ) -> NDArray[np.bool_]:
        """(N,) which points (N, 3), sensor frame, are the robot's own or in the shadow of its edges."""
        T_root_sensor = np.linalg.inv(self._T_map_root) @ T_map_sensor
        labels = self._filter.classify(points, T_root_sensor, self.joint_vector(positions))
        return (labels != SCENE) & (labels != NO_RETURN)

    def camera_pose(self, group: str, positions: Mapping[str, float]) -> Array:
        """(4, 4) pose of the group's tip, its camera's optical frame, in the map frame."""
        poses = self.model.forward(self.joint_vector(positions))
        return self._T_map_root @ poses[self._tip(group)]

    def hides(self, group: str, rays_m: Array, positions: Mapping[str, float]) -> NDArray[np.bool_]:
        """(R,) which rays of the group's camera end on the robot.

        :param rays_m: (R, 3) the rays' ends [m], optical frame: what lies farther hides nothing.
        """
        q = self.joint_vector(positions)
        T_root_camera = self.model.forward(q)[self._tip(group)]
        return self._occluder(group).classify(rays_m, T_root_camera, q) != SCENE

    def tip_balls(self, group: str, max_radius_m: float) -> Array:
        """(S, 4) balls, centre and radius [m] in the frame of the group's tip, that cover the links moving with it."""
        tip = self._tip(group)
        low, high = (self.model.forward(np.full(len(self.model.joint_names), q)) for q in (0.0, 0.3))
        found = [np.empty((0, 4))]
        for index, link in enumerate(self.model.link_names):
            T_tip_link = np.linalg.inv(low[tip]) @ low[index]
            if np.allclose(T_tip_link, np.linalg.inv(high[tip]) @ high[index], atol=1e-9):
                balls = np.asarray(sphere_cover(self.model, link, max_radius_m)).reshape(-1, 4)
                centres = balls[:, :3] @ T_tip_link[:3, :3].T + T_tip_link[:3, 3]
                found.append(np.concatenate([centres, balls[:, 3:]], axis=1))
        return np.concatenate(found)

    def _occluder(self, group: str) -> SelfFilter:
        """A filter whose shadows reach from the far end of a ray to the camera; all of the robot but the housing."""
        if group not in self._occluders:
            config = SelfFilterConfig(padding_m=0.0, shadow_m=FAR_M, links=self._housing(group))
            self._occluders[group] = SelfFilter(self._laden, config)
        return self._occluders[group]

    def _housing(self, group: str) -> dict[str, LinkFilterConfig]:
        """The links about the optical centre, to be ignored; they do not move against it."""
        q = self.joint_vector({})
        centre = self.model.forward(q)[self._tip(group)][None, :3, 3]
        ignored = LinkFilterConfig(ignore=True)
        housing = {}
        for link in self.model.link_names:
            others = {name: ignored for name in self.model.link_names if name != link}
            if SelfFilter(self.model, SelfFilterConfig(padding_m=HOUSING_M, links=others)).is_robot(
                centre, q
            )[0]:
                housing[link] = ignored
        return housing

    def _tip(self, group: str) -> int:
        return self.model.link_names.index(self.model.group(group).tip_link)

    def voxels(self, positions: Mapping[str, float], resolution_m: float, padding_m: float) -> Array:
        """(N, 3) centres [m], map frame, of the voxels that the padded robot meets."""
        q = self.joint_vector(positions)
        return body_voxels(self._laden, q, resolution_m, padding_m, T_map_root=self._T_map_root)

    def moved_balls(
        self, group: str, positions: Mapping[str, float], max_radius_m: float
    ) -> dict[str, Array]:
        """By link, (S, 4) balls, centre and radius [m] in the map frame, that cover what the group moves."""
        poses = self.model.forward(self.joint_vector(positions))
        found = {}
        for index in self.model.group(group).moved_links:
            T, link = self._T_map_root @ poses[index], self.model.link_names[index]
            balls = np.asarray(sphere_cover(self.model, link, max_radius_m)).reshape(-1, 4)
            if len(balls):
                found[link] = np.column_stack([balls[:, :3] @ T[:3, :3].T + T[:3, 3], balls[:, 3]])
        return found

    def random_views(self, group: str, count: int, random: np.random.Generator) -> Array:
        """(count, 4, 4) poses of the group's tip, map frame, at joint values drawn evenly within their limits."""
        joints = self.model.group(group)
        q = np.zeros((count, len(self.model.joint_names)))
        for name in joints.joint_names:
            index = self.model.joint_names.index(name)
            limits = self.model.limits[index]
            q[:, index] = random.uniform(max(limits.lower, -TURN_RAD), min(limits.upper, TURN_RAD), count)
        return self._T_map_root @ self.model.forward(q)[:, self._tip(group)]

    def base_poses(self, group: str, capability_group: str, step_rad: float) -> Array:
        """Poses that a capability map's base can take by the joints of the group that come before it.

        :return: (K, 4, 4), map frame, over a grid of at most ``step_rad`` within the limits; K = 1 when the base
            does not move.
        """
        arm = self.model.group(capability_group)
        before = [name for name in self.model.group(group).joint_names if name not in arm.joint_names]
        grids = [self._grid(name, step_rad) for name in before]
        base = self.model.link_names.index(arm.base_link)
        poses = [
            self.model.forward(self.joint_vector(dict(zip(before, values, strict=True))))[base]
            for values in itertools.product(*grids)
        ]
        return self._T_map_root @ np.array(poses)

    def _grid(self, joint: str, step: float) -> Array:
        limits = self.model.limits[self.model.joint_names.index(joint)]
        count = max(2, math.ceil((limits.upper - limits.lower) / step) + 1)
        return np.linspace(limits.lower, limits.upper, count)


@dataclass(frozen=True)
class CarriedCamera:
    """The camera at the tip of one of the robot's groups: what ``gain_judge.CameraCarrier`` asks for."""

    body: RobotBody
    group: str

    def camera_pose(self, joints: Mapping[str, float]) -> Array:
        """See ``RobotBody.camera_pose``."""
        return self.body.camera_pose(self.group, joints)

    def hides(self, rays_m: Array, joints: Mapping[str, float]) -> NDArray[np.bool_]:
        """See ``RobotBody.hides``."""
        return self.body.hides(self.group, rays_m, joints)


def clearance_boxes(clearance: Clearance, pose_of: PoseOf) -> list[tuple[Array, Array]]:
    """Boxes (min, max) of the map frame that enclose what robot.yaml vouches for.

    For drawing: of a box whose frame is turned this is the hull. What becomes free is ``clearance_voxels``.

    :param pose_of: ``(frame) -> (4, 4)`` pose in the map frame.
    """
    boxes = []
    for box in clearance.get("boxes", []):
        T = pose_of(box["frame"])
        half = np.abs(T[:3, :3]) @ (np.asarray(box["size_m"], dtype=float) / 2)
        centre = T[:3, :3] @ np.asarray(box["center_m"], dtype=float) + T[:3, 3]
        boxes.append((centre - half, centre + half))
    return boxes


def clearance_spheres(clearance: Clearance, pose_of: PoseOf) -> list[tuple[Array, float]]:
    """Centre (3,) and radius [m], map frame, of the spheres that robot.yaml vouches for."""
    return [
        ((pose_of(ball["frame"]) @ _translation(ball["center_m"]))[:3, 3], float(ball["radius_m"]))
        for ball in clearance.get("spheres", [])
    ]


def clearance_voxels(clearance: Clearance, pose_of: PoseOf, resolution_m: float) -> Array:
    """(N, 3) centres [m], map frame, of the voxels that lie wholly within vouched boxes and spheres.

    :raises ValueError: where they hold more than ``MAX_CLEARANCE_VOXELS``.
    """
    found = [np.empty((0, 3))]
    corner = resolution_m / 2 * np.array(list(itertools.product((-1, 1), repeat=3)))
    for box in clearance.get("boxes", []):
        T, half = pose_of(box["frame"]), np.asarray(box["size_m"], dtype=float) / 2
        T_box = T @ _translation(box["center_m"])
        centres = _grid_around(T_box[:3, 3], np.abs(T_box[:3, :3]) @ half, resolution_m)
        local = np.abs((centres - T_box[:3, 3]) @ T_box[:3, :3])
        local += resolution_m / 2 * np.abs(T_box[:3, :3]).sum(axis=0)  # the corner that lies farthest out
        found.append(centres[(local <= half + 1e-9).all(axis=1)])
    for centre, radius_m in clearance_spheres(clearance, pose_of):
        centres = _grid_around(centre, np.full(3, radius_m), resolution_m)
        far = np.linalg.norm(centres[:, None] + corner - centre, axis=2).max(axis=1)
        found.append(centres[far <= radius_m])
    return np.concatenate(found)


def _grid_around(centre: Array, reach: Array, resolution_m: float) -> Array:
    """Centres of all voxels that a box along the map's axes meets.

    :param reach: (3,) half its edges [m].
    """
    with np.errstate(over="ignore"):
        voxels = np.prod(2 * reach / resolution_m)
    if not voxels <= MAX_CLEARANCE_VOXELS:
        size = " x ".join(f"{edge:g}" for edge in 2 * reach)
        raise ValueError(
            f"the clearance of robot.yaml: {size} m hold {voxels:.2g} voxels of {resolution_m:g} m; valid: up "
            f"to {MAX_CLEARANCE_VOXELS:.0e}. Is it in metres?"
        )
    low = np.floor((centre - reach) / resolution_m).astype(int)
    high = np.floor((centre + reach) / resolution_m).astype(int) + 1
    axes = [np.arange(a, b) for a, b in zip(low, high, strict=True)]
    return (np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3) + 0.5) * resolution_m


def _translation(offset: Sequence[float]) -> Array:
    T = np.eye(4)
    T[:3, 3] = offset
    return T
