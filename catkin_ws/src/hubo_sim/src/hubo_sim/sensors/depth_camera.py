"""A depth camera on a link of the robot: what it would measure now."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import hubo_description.sensors as description
from fv_common.transforms import apply
from hubo_sim.sensors.noise import DepthNoise
from hubo_sim.sensors.render import Pinhole, take_picture
from hubo_sim.sim_robot import SimRobot
from hubo_sim.worlds.scene import Scene

# The EGL plugin's depth buffer has 16 bits: its error is z^2 / near * 2^-17, with this 0.7 mm at 3 m. What is
# nearer is drawn in a second picture, from _CLOSE_M on: it hides what is behind it, and returns nothing itself.
_NEAR_M = 0.1
_CLOSE_M = 0.005
_FAR_MARGIN_M = 0.5


@dataclass(frozen=True)
class DepthScan:
    """One measurement: depth (H, W) float32 [m], NaN = no return; rgba (H, W, 4) uint8, contiguous."""

    depth: np.ndarray
    rgba: np.ndarray


class DepthCamera:
    """Measures the scene from the optical frame's true pose; the robot itself is seen too."""

    def __init__(
        self, config: description.DepthCamera, robot: SimRobot, noise: bool = True, seed: int = 0
    ) -> None:
        self.config = config
        self.pinhole = Pinhole(
            config.width,
            config.height,
            np.radians(config.horizontal_fov_deg),
            np.radians(config.vertical_fov_deg),
        )
        self._robot = robot
        self._rays = self.pinhole.rays().astype(np.float32)
        self._noise = DepthNoise(config.noise, self.pinhole, seed) if noise else None
        for link in config.links:
            robot.link_pose(link)  # fail at start when it does not exist
        self._own = {(robot.body, robot.link_index[name]) for name in robot.rigid_with(self.config.link)}
        self._sees_own: bool | None = None  # whether a link that moves with the camera is close in view

    def pose(self) -> np.ndarray:
        """T_world_optical (4, 4), true."""
        return self._robot.link_pose(self.config.optical_frame)

    def scan(self, scene: Scene, number: int) -> DepthScan:
        """Measure now. The noise depends on the seed and on `number` only."""
        limits = self.config
        pose = self.pose()
        picture = take_picture(scene, self.pinhole, pose, _NEAR_M, limits.max_range_m + _FAR_MARGIN_M)
        depth = picture.depth if self._noise is None else self._noise.apply(picture.depth, number)
        if self._something_close(scene, pose):
            close = take_picture(scene, self.pinhole, pose, _CLOSE_M, _NEAR_M).depth
            np.copyto(depth, close, where=np.isfinite(close))
        np.copyto(depth, np.nan, where=depth < limits.min_range_m)
        np.copyto(depth, np.nan, where=depth > limits.max_range_m)
        return DepthScan(depth, picture.rgba)

    def _something_close(self, scene: Scene, T_world_optical: np.ndarray) -> bool:
        """Whether anything may be in view nearer than _NEAR_M, by bounding boxes.

        What is rigidly tied to the camera always looks the same: whether it is in view is found out once.
        """
        if self._sees_own is None:
            close = take_picture(scene, self.pinhole, T_world_optical, _CLOSE_M, _NEAR_M, with_bodies=True)
            self._sees_own = bool((close.body == self._robot.body).any())
        corners = self._rays[[0, 0, -1, -1], [0, -1, 0, -1]] * _NEAR_M
        view = apply(T_world_optical, np.vstack([np.zeros(3), corners]))
        boxes = scene.client.getOverlappingObjects(view.min(axis=0), view.max(axis=0)) or ()
        return self._sees_own or not self._own.issuperset(boxes)

    def points(self, depth: np.ndarray) -> np.ndarray:
        """(H, W, 3) float32 points in the optical frame of a depth image, NaN where it is NaN."""
        return self._rays * depth[..., None]
