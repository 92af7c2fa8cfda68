"""How good a map is, against the truth."""

from __future__ import annotations

import numpy as np

from hubo_sim.errors import SimError
from hubo_sim.ground_truth.observable import ObservableSet
from hubo_sim.ground_truth.true_world import TrueWorld


def score_map(
    true_world: TrueWorld,
    points_free: np.ndarray,
    points_occupied: np.ndarray,
    resolution_m: float,
    observable: ObservableSet | None = None,
    sigma_m: float = 0.0,
) -> dict[str, float]:
    """Shares that say how complete and how true a map is.

    points_free (N, 3), points_occupied (M, 3): voxel centres at resolution_m, world frame. sigma_m: the sensor's
    noise at the far end of its range. Without voxels of a kind its share is 0. Returns

    - explored_share: of the observable voxels, those that the map knows (absent without `observable`);
    - free_in_solid_share: of the free voxels, those with a centre more than one voxel deep inside a solid;
    - occupied_far_share: of the occupied ones, those further than one voxel + 2 sigma from any surface;
    - free, occupied: how many voxels there are.
    """
    free = np.asarray(points_free, float).reshape(-1, 3)
    occupied = np.asarray(points_occupied, float).reshape(-1, 3)
    for name, points in (("points_free", free), ("points_occupied", occupied)):
        if not np.isfinite(points).all():
            raise SimError(f"{name} has values that are not finite")
    far_m = resolution_m + 2.0 * sigma_m
    out = {
        "free": len(free),
        "occupied": len(occupied),
        "free_in_solid_share": _share(true_world.depth_inside_solid(free) > resolution_m),
        "occupied_far_share": _share(true_world.distance_to_surface(occupied, 2.0 * far_m) > far_m),
    }
    if observable is not None:
        out["explored_share"] = observable.known_share(np.concatenate([free, occupied]), resolution_m)
    return out


def _share(flags: np.ndarray) -> float:
    return float(flags.mean()) if flags.size else 0.0
