"""What a view is expected to show, from where it looks, what comes back to the sensor, and what the robot hides."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fv_exploration import Evaluator, OccupancyMap, PinholeCamera, ReturnChance, ViewGains, view_gain

Array = NDArray[np.float64]
Joints = Mapping[str, float]

MANY_STRIDE = 2
"""Of many views it is asked for every second ray of every second row only whether it comes back: four times faster."""


class CameraCarrier(Protocol):
    """The robot as far as it decides where its camera is and what of the image shows the robot itself."""

    def camera_pose(self, joints: Joints) -> Array:
        """(4, 4) pose of the camera in the map frame."""

    def hides(self, rays_m: Array, joints: Joints) -> NDArray[np.bool_]:
        """(R,) which rays, given by their ends (R, 3) [m] in the optical frame, end on the robot."""


class GainJudge:
    """Expected gains of views by ray casting on the evaluated map.

    Rays see through unknown space, and each counts with the chance that it comes back (``ReturnChance``): no return is
    no proof of free space, so a look into the open shows nothing. Where the robot itself would be in the image is known
    only when its joints are: ``gains`` judges without, ``gain_at`` with it.

    :param evaluator: of the map; its last update is judged.
    :param camera: with as many rays as the gain is to be cast with.
    :param carrier: None: nothing of the robot is ever in view.
    :param cell_m: edge of the cells in which it is remembered what came back.
    """

    def __init__(
        self,
        occupancy_map: OccupancyMap,
        evaluator: Evaluator,
        camera: PinholeCamera,
        cell_m: float,
        carrier: CameraCarrier | None = None,
    ) -> None:
        self._map = occupancy_map
        self._evaluator = evaluator
        self._camera = camera
        self._carrier = carrier
        self._ray_ends_m = camera.rays() * camera.max_range_m
        self._returns = ReturnChance(occupancy_map.bounds_min, occupancy_map.bounds_max, cell_m, camera)

    def note(self, points: Array, T_map_sensor: Array, joints: Joints) -> None:
        """Learn from a scan: (N, 3) points [m] of the optical frame without the robot's own, taken at these joints."""
        hidden = self._carrier.hides(self._ray_ends_m, joints) if self._carrier else None
        self._returns.note(T_map_sensor, points, hidden)

    def gains(self, T_map_cameras: Array) -> ViewGains:
        """Expected gains of (V, 4, 4) camera poses, if the robot is in no image."""
        return self._gains(T_map_cameras, True, MANY_STRIDE)

    def gain_at(self, T_map_camera: Array, joints: Joints) -> ViewGains:
        """Expected gains (1,) of the view that the robot has at these joints.

        :param T_map_camera: (4, 4) what the view is taken for where nothing carries the camera.
        """
        if self._carrier is None:
            return self.gains(T_map_camera[None])
        pose = self._carrier.camera_pose(joints)[None]
        seen = ~self._carrier.hides(self._ray_ends_m, joints)
        return self._gains(pose, seen, 1)

    def _gains(self, T_map_cameras: Array, seen: NDArray[np.bool_] | bool, stride: int) -> ViewGains:
        if len(T_map_cameras) == 0:
            return view_gain(self._map, self._evaluator, T_map_cameras, self._camera)
        chances, reaches_m = self._returns.outlook(T_map_cameras, stride)
        return view_gain(
            self._map,
            self._evaluator,
            T_map_cameras,
            self._camera,
            ray_chances=chances * seen,
            ray_reaches_m=reaches_m,
        )
