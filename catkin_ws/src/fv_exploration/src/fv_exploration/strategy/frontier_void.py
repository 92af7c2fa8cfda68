"""Candidate views, what each is expected to show, and which of them to ask the planner for."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fv_exploration.explore_config import ViewSettings
from fv_exploration.outcome import Funnel
from fv_exploration.strategy.reachable_views import FREE, DrawnViews, ReachableViews
from fv_exploration.strategy.view_geometry import angles_between, are_alike, spread_out, upright_poses

Array = NDArray[np.float64]

DISAPPOINTING_SHARE = 0.5
"""A view that showed less than this share of what was expected casts doubt on the views beside it."""


@dataclass
class Candidates:
    """Views with what is known of them; row i of every array belongs to view i."""

    poses: Array = field(default_factory=lambda: np.empty((0, 4, 4)))
    utility: Array = field(default_factory=lambda: np.empty(0))
    reachability: Array = field(default_factory=lambda: np.empty(0))
    void_gain: Array = field(default_factory=lambda: np.empty(0))
    unknown_gain: Array = field(default_factory=lambda: np.empty(0))
    frontier_gain: Array = field(default_factory=lambda: np.empty(0))
    gains: Array = field(default_factory=lambda: np.empty(0))
    scores: Array = field(default_factory=lambda: np.empty(0))

    def __len__(self) -> int:
        return len(self.poses)

    def take(self, rows: NDArray) -> Candidates:
        """The candidates of these rows (indices or a mask), in their order."""
        return Candidates(**{name: values[rows] for name, values in vars(self).items()})


@dataclass(frozen=True)
class Doubt:
    """A view that disappointed."""

    pose: Array
    share: float


class Judge(Protocol):
    """Who expects what views show: arrays ``void_volume_m3``, ``unknown_volume_m3`` and ``frontier_area_m2``."""

    def gains(self, T_map_cameras: Array) -> Any:
        """Of (V, 4, 4) camera poses, for all that is known before there is a motion."""

    def gain_at(self, T_map_camera: Array, joints: Mapping[str, float]) -> Any:
        """Of the one view (4, 4) when it is taken at these joints."""


class ViewChooser:
    """Proposes views in the order of their expected gain for their cost.

    Candidates come from two sources: the free voxels of highest utility, looking along the direction accumulated there
    (Algorithm 1), and views drawn from the capability map, so that the exploration does not end only because utility
    gathers where the arm cannot reach. Both are judged alike: by the volume that ray casting expects to see anew.

    :param classify: ``(positions (N, 3)) -> (N,)`` with -1 unknown, 0 free, 1 occupied.
    """

    def __init__(
        self,
        settings: ViewSettings,
        reachable: ReachableViews | DrawnViews,
        judge: Judge,
        classify: Callable[[Array], NDArray[np.int8]],
    ) -> None:
        self._settings = settings
        self._reachable = reachable
        self._judge = judge
        self._classify = classify
        self._pool = Candidates()
        self._rejected: list[Array] = []
        self._doubts: list[Doubt] = []
        self._expected: tuple[Array, float] | None = None

    def prepare(self, seed: int, T_map_sensor: Array, utility: Any) -> Funnel:
        """Make and judge the candidates of one decision; how many were left after each sieve.

        :param T_map_sensor: where the camera is now: nearer views cost less.
        :param utility: arrays ``points`` (U, 3), ``utility`` (U,), ``direction`` (U, 3) of the free voxels.
        """
        positions, directions, values = self._proposals(np.random.default_rng(seed), utility)
        proposed = len(positions)
        keep = self._classify(positions) == FREE
        positions, directions, values = positions[keep], directions[keep], values[keep]
        reachability = self._reachable.reachability(positions, directions)
        keep = reachability >= self._settings.min_reachability
        poses = upright_poses(positions[keep], directions[keep])
        self._pool = self._judged(poses, values[keep], reachability[keep], T_map_sensor)
        worth_it = int((self._pool.gains >= self._settings.min_gain_m3).sum())
        for pose in self._rejected[-200:]:
            self._drop_alike(pose)
        return Funnel(proposed, len(positions), len(poses), worth_it)

    def shortlist(self) -> Candidates:
        """The best candidates that differ from each other, best first; empty when none is worth a motion."""
        worth = self._pool.take(self._pool.gains >= self._settings.min_gain_m3)
        best = spread_out(
            worth.scores,
            worth.poses,
            self._settings.shortlist,
            self._settings.spread_m,
            math.radians(self._settings.spread_deg),
        )
        return worth.take(best)

    def reject(self, candidates: Candidates) -> None:
        """The planner found no motion to any of these: they and their like are not proposed again."""
        for pose in candidates.poses:
            self._rejected.append(pose)
            self._drop_alike(pose)

    def leave_out(self, pose: Array) -> None:
        """The motion to this view was not good enough: it and its like wait for the next decision."""
        self._drop_alike(pose)

    def gain_at(self, pose: Array, joints: Mapping[str, float]) -> float:
        """What the view is worth [m^3] when it is taken at these joints, with the robot in the image."""
        gain = self._worth(self._judge.gain_at(pose, joints)) * self._trust(pose[None])
        return float(gain[0])

    def expect(self, pose: Array, gain_m3: float) -> None:
        """A motion to this view begins; ``learn`` compares what it shows."""
        self._expected = (pose, gain_m3)

    def learn(self, gain_m3: float) -> None:
        """What the scan after ``expect`` has shown anew [m^3]. A disappointing view is remembered."""
        if self._expected is None:
            return
        pose, expected_m3 = self._expected
        self._expected = None
        share = gain_m3 / expected_m3 if expected_m3 > 0 else 1.0
        if share < DISAPPOINTING_SHARE:
            self._doubts.append(Doubt(pose, max(share, 0.0)))
        else:
            self._rejected.clear()  # the map has grown: what was out of reach may be within it now

    def _proposals(self, random: np.random.Generator, utility: Any) -> tuple[Array, Array, Array]:
        by_utility = self._by_utility(utility)
        positions, directions = self._reachable.sample(self._settings.sampled, random)
        return (
            np.concatenate([by_utility[0], positions]),
            np.concatenate([by_utility[1], directions]),
            np.concatenate([by_utility[2], np.zeros(len(positions))]),
        )

    def _by_utility(self, utility: Any) -> tuple[Array, Array, Array]:
        """The free voxels of highest utility within reach, no two nearer than the suppression radius."""
        near = self._reachable.within_reach(utility.points)
        points = np.asarray(utility.points, dtype=float)[near]
        values = np.asarray(utility.utility, dtype=float)[near]
        directions = np.asarray(utility.direction, dtype=float)[near]
        poses = np.tile(np.eye(4), (len(points), 1, 1))
        poses[:, :3, 3] = points
        best = spread_out(
            values, poses, self._settings.utility_voxels, self._settings.suppression_radius_m, math.pi
        )
        return points[best], directions[best], values[best]

    def _judged(self, poses: Array, utility: Array, reachability: Array, T_map_sensor: Array) -> Candidates:
        gain = self._judge.gains(poses)
        gains = self._worth(gain) * self._trust(poses)
        return Candidates(
            poses=poses,
            utility=utility,
            reachability=reachability,
            void_gain=np.asarray(gain.void_volume_m3, dtype=float),
            unknown_gain=np.asarray(gain.unknown_volume_m3, dtype=float),
            frontier_gain=np.asarray(gain.frontier_area_m2, dtype=float),
            gains=gains,
            scores=gains / self._costs(poses, T_map_sensor),
        )

    def _worth(self, gain: Any) -> Array:
        """Volume [m^3] in which a voxel outside the hull counts less than a void."""
        void = np.asarray(gain.void_volume_m3, dtype=float)
        unknown = np.asarray(gain.unknown_volume_m3, dtype=float)
        return void + self._settings.known_weight * (unknown - void)

    def _costs(self, poses: Array, T_map_sensor: Array) -> Array:
        """Seconds that a view costs: the scan, and a motion as long as the distance suggests."""
        distance = np.linalg.norm(poses[:, :3, 3] - T_map_sensor[:3, 3], axis=1)
        angle = angles_between(poses[:, :3, 2], T_map_sensor[:3, 2])
        motion = np.maximum(
            distance / self._settings.linear_m_s, angle / math.radians(self._settings.angular_deg_s)
        )
        return self._settings.scan_s + motion

    def _trust(self, poses: Array) -> Array:
        """Share of the expected gain to believe in, from what similar views have shown."""
        trust = np.ones(len(poses))
        spread_rad = math.radians(self._settings.doubt_deg)
        for doubt in self._doubts:
            alike = are_alike(poses, doubt.pose, self._settings.doubt_m, spread_rad)
            trust[alike] = np.minimum(trust[alike], doubt.share)
        return trust

    def _drop_alike(self, pose: Array) -> None:
        spread_rad = math.radians(self._settings.spread_deg)
        self._pool = self._pool.take(~are_alike(self._pool.poses, pose, self._settings.spread_m, spread_rad))
