"""What a view is expected to show, with a memory for space that was looked at in vain.

Ray casting takes every unknown voxel in sight for one that will be seen. It is not when the ray ends nowhere (open
space beyond the sensor's range) or on the robot itself: no return is no proof of free space. Such a voxel would lure
the camera again and again. One that stayed unknown although three scans looked straight at it no longer counts.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fv_exploration import EvaluationConfig, Evaluator, OccupancyMap, PinholeCamera, ViewGains, view_gain

Array = NDArray[np.float64]

ENOUGH_LOOKS = 3
UNKNOWN, OCCUPIED = -1, 1


class VainLooks:
    """Counts, for each voxel of a bounded map, the scans that looked at it and left it unknown.

    :param rays: (R, 3) unit directions of the sensor, optical frame.
    :param min_range_m, max_range_m: along the rays.
    """

    def __init__(
        self, occupancy_map: OccupancyMap, rays: Array, min_range_m: float, max_range_m: float
    ) -> None:
        self._map = occupancy_map
        self._resolution_m = occupancy_map.resolution_m
        self._first = np.floor(np.asarray(occupancy_map.bounds_min) / self._resolution_m + 1e-6).astype(int)
        last = np.ceil(np.asarray(occupancy_map.bounds_max) / self._resolution_m - 1e-6).astype(int)
        self._looks = np.zeros(tuple(last - self._first), dtype=np.uint8)
        self._rays = rays
        self._ranges_m = np.arange(min_range_m, max_range_m, self._resolution_m / 2)

    def note(self, T_map_sensor: Array) -> None:
        """Count what is in sight of (4, 4) and still unknown; call it when the scan is in the map."""
        rays = self._rays @ T_map_sensor[:3, :3].T
        points = T_map_sensor[:3, 3] + rays[:, None] * self._ranges_m[None, :, None]
        classes = self._map.classify(points.reshape(-1, 3)).reshape(len(rays), -1)
        in_sight = np.cumsum(classes == OCCUPIED, axis=1) == 0
        keys = (
            np.floor(points[in_sight & (classes == UNKNOWN)] / self._resolution_m).astype(int) - self._first
        )
        keys = np.unique(keys[((keys >= 0) & (keys < self._looks.shape)).all(axis=1)], axis=0)
        self._looks[tuple(keys.T)] = np.minimum(self._looks[tuple(keys.T)], 254) + 1

    def voxels(self) -> Array:
        """(N, 3) centres [m] of the voxels that were looked at often enough and are unknown."""
        centres = (np.argwhere(self._looks >= ENOUGH_LOOKS) + self._first + 0.5) * self._resolution_m
        return centres[self._map.classify(centres) == UNKNOWN] if len(centres) else centres


class GainJudge:
    """Expected gains on a copy of the map in which what was looked at in vain counts as free.

    :param camera: with as many rays as the gain is to be cast with.
    """

    def __init__(self, occupancy_map: OccupancyMap, config: EvaluationConfig, camera: PinholeCamera) -> None:
        self._map = occupancy_map
        self._config = config
        self._camera = camera
        self._vain = VainLooks(occupancy_map, camera.rays(), camera.min_range_m, camera.max_range_m)
        self._judged: tuple[int, Any, Any] | None = None  # sequence of the map, copy, its evaluator

    def note(self, T_map_sensor: Array) -> None:
        """A scan from this pose (4, 4) is in the map."""
        self._vain.note(T_map_sensor)

    def gains(self, T_map_cameras: Array) -> ViewGains:
        """Expected gains of (V, 4, 4) camera poses."""
        if self._judged is None or self._judged[0] != self._map.sequence:
            copy = self._map.snapshot()
            vain = self._vain.voxels()
            if len(vain):
                copy.mark_free(vain)
            evaluator = Evaluator(copy, self._config)
            evaluator.update()
            self._judged = (self._map.sequence, copy, evaluator)
        _, copy, evaluator = self._judged
        return view_gain(copy, evaluator, T_map_cameras, self._camera)
