"""One question about the true voxels of a world, and its answer: the same for the command line and the service."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hubo_sim.errors import SimError
from hubo_sim.ground_truth.observable import ObservableRequest, observable_set
from hubo_sim.ground_truth.true_world import TrueWorld
from hubo_sim.robot_spec import RobotSpec
from hubo_sim.worlds import World

KINDS = ("surface", "solid", "occupied", "observable")
_MAX_VOXELS = 50_000_000  # of the bounds: more would not fit into memory beside everything else


@dataclass(frozen=True)
class TruthRequest:
    """Which voxels (see KINDS) of a world, and for `observable` of which robot's camera."""

    world: World
    robot: RobotSpec
    what: str
    resolution_m: float
    seed: int = 0

    def check(self) -> None:
        """Raise SimError when there is no answer to it."""
        if self.what not in KINDS:
            raise SimError(f"unknown kind of truth {self.what!r}; valid: {', '.join(KINDS)}")
        if not self.resolution_m > 0.0 or not np.isfinite(self.resolution_m):
            raise SimError(f"resolution must be a number above 0, got {self.resolution_m}")
        size = np.diff(self.world.bounds.corners, axis=0) / self.resolution_m
        if np.prod(size) > _MAX_VOXELS:
            raise SimError(
                f"resolution {self.resolution_m:g} m makes {np.prod(size):.3g} voxels, more than {_MAX_VOXELS}"
            )


@dataclass(frozen=True)
class TruthVoxels:
    """Voxel centres (V, 3) [m]; for `observable` how many views it took, and whether that was enough."""

    centres: np.ndarray
    samples: int = 0
    tried: int = 0
    settled: bool = True


def true_voxels(request: TruthRequest, progress: Callable[[int, int], None] | None = None) -> TruthVoxels:
    """The answer; progress(samples, voxels) is called now and then by `observable`. Raises SimError."""
    request.check()
    if request.what == "observable":
        found = observable_set(
            ObservableRequest(request.world, request.robot, request.resolution_m, seed=request.seed), progress
        )
        return TruthVoxels(found.centres(), found.samples, found.tried, found.settled)
    truth, parts = TrueWorld(request.world), []
    if request.what in ("surface", "occupied"):
        parts.append(truth.surface_voxels(request.resolution_m))
    if request.what in ("solid", "occupied"):
        parts.append(truth.solid_voxels(request.resolution_m))
    return TruthVoxels(_distinct(np.concatenate(parts), request.resolution_m))


def _distinct(centres: np.ndarray, resolution_m: float) -> np.ndarray:
    keys = np.unique(np.floor(centres / resolution_m + 1e-6).astype(np.int64), axis=0)
    return (keys + 0.5) * resolution_m
