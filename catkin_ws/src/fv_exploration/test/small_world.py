"""A world in which only views towards +x show something, and an arm in it: situations for strategies, without a map."""

import numpy as np

from fv_exploration.explore_config import ViewSettings
from fv_exploration.strategy import Situation
from fv_exploration.strategy.reachable_views import ReachableViews
from fv_exploration.view_worth import ViewWorth


class BallArm:
    """An arm that reaches every pose within a ball about its base, looking away from the base only."""

    def __init__(self, reach_m: float = 0.5) -> None:
        self.radius = 0.05
        grid = np.arange(-reach_m, reach_m + 1e-9, 0.1)
        self.centres = np.stack(np.meshgrid(grid, grid, grid, indexing="ij"), -1).reshape(-1, 3)
        self.directions = np.array(
            [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float
        )
        self.reach_m = reach_m
        looking = -self.directions
        positions = self.centres[:, None] - self.radius * looking[None]
        flat = positions.reshape(-1, 3)
        answers = self.query(flat, np.tile(looking, (len(self.centres), 1)))
        self.valid = answers.reshape(len(self.centres), 6) > 0.5

    def query(self, positions, directions, interpolate=True):
        inside = np.linalg.norm(positions, axis=1) <= self.reach_m
        return (inside & (np.einsum("ij,ij->i", positions, directions) >= 0)).astype(np.float32)


class Utility:
    """Utility of a few voxels."""

    def __init__(self, points=(), values=(), directions=()):
        self.points = np.array(points, dtype=np.float32).reshape(-1, 3)
        self.utility = np.array(values, dtype=np.float32)
        self.direction = np.array(directions, dtype=np.float32).reshape(-1, 3)


class Gain:
    """What views show in that world."""

    def __init__(self, poses):
        self.void_volume_m3 = np.maximum(0, poses[:, 0, 2]) * 0.5
        self.unknown_volume_m3 = self.void_volume_m3 * 2
        self.frontier_area_m2 = np.zeros(len(poses))


class Source:
    """Sees the same with the robot in the image, but for what the joint ``elbow`` covers of it (0..1)."""

    def gains(self, poses):
        return Gain(poses)

    def gain_at(self, pose, joints):
        gain = Gain(pose[None])
        gain.void_volume_m3 *= 1 - joints.get("elbow", 0.0)
        gain.unknown_volume_m3 *= 1 - joints.get("elbow", 0.0)
        return gain


class Everywhere:
    """A map of one class alone."""

    def __init__(self, kind=0):
        self.kind = kind

    def classify(self, positions):
        return np.full(len(positions), self.kind, dtype=np.int8)


def situation(utility=None, seed=0, kind=0, judge=None, evaluation=None, **changes) -> Situation:
    """For BallArm about the origin, the camera there; ``changes`` of ``ViewSettings``."""
    views = ViewSettings(**{"utility_voxels": 20, "sampled": 400, "shortlist": 8, **changes})
    return Situation(
        map=Everywhere(kind),
        evaluation=evaluation,
        utility=utility or Utility(),
        reach=ReachableViews(BallArm(), np.array([np.eye(4)])),
        judge=judge or ViewWorth(Source(), views),
        T_map_sensor=np.eye(4),
        joints={},
        settings=views,
        random=np.random.default_rng(seed),
    )
