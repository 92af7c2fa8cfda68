"""The truth about a world, to measure maps against: distances, occupied voxels, what a camera can observe at all."""

from hubo_sim.ground_truth.observable import (
    ObservableRequest,
    ObservableSet,
    compute_observable,
    observable_set,
)
from hubo_sim.ground_truth.octree import octree_bytes, octree_data
from hubo_sim.ground_truth.score import score_map
from hubo_sim.ground_truth.true_world import TrueWorld, grid_centres
from hubo_sim.ground_truth.voxels import TruthRequest, TruthVoxels, true_voxels

__all__ = [
    "ObservableRequest",
    "ObservableSet",
    "TrueWorld",
    "TruthRequest",
    "TruthVoxels",
    "compute_observable",
    "grid_centres",
    "observable_set",
    "octree_bytes",
    "octree_data",
    "score_map",
    "true_voxels",
]
