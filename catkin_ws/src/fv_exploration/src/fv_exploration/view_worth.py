"""What views are worth [m^3]: what they are expected to show, believed as far as views like them have kept it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fv_exploration import ViewGains
from fv_exploration.explore_config import ViewSettings
from fv_exploration.view_geometry import are_alike

Array = NDArray[np.float64]
Joints = Mapping[str, float]

DISAPPOINTING_SHARE = 0.5
"""A view that showed less than this share of what was expected casts doubt on the views beside it."""


class GainSource(Protocol):
    """Who expects what views show, as ``GainJudge`` does."""

    def note(self, points: Array, T_map_sensor: Array, joints: Joints) -> None:
        """Learn from a scan: (N, 3) points [m] of the optical frame, taken at these joints."""

    def gains(self, T_map_cameras: Array) -> ViewGains:
        """Of (V, 4, 4) camera poses, for all that is known before there is a motion."""

    def gain_at(self, T_map_camera: Array, joints: Joints) -> ViewGains:
        """Of the one view (4, 4) when it is taken at these joints."""


@dataclass(frozen=True)
class Doubt:
    """A view that disappointed, and the share of the expected that it has shown."""

    pose: Array
    share: float


@dataclass(frozen=True)
class Expectation:
    """What views are expected to show; row i belongs to view i.

    :param gain_m3: volume in which a voxel outside the hull counts less than a void, where doubted less.
    :param void_m3: of voids, :param unknown_m3: of all unknown space, :param frontier_m2: of frontier, in full.
    """

    gain_m3: Array
    void_m3: Array
    unknown_m3: Array
    frontier_m2: Array


class ViewWorth:
    """The judge of views that strategies and the loop ask; remembers what scans have failed to show."""

    def __init__(self, source: GainSource, settings: ViewSettings) -> None:
        self._source = source
        self._settings = settings
        self._doubts: list[Doubt] = []

    def expect(self, poses: Array) -> Expectation:
        """Of (N, 4, 4) camera poses, as if the robot were in no image."""
        gains = self._source.gains(poses)
        return Expectation(
            gain_m3=self._weighed(gains) * self._trust(poses),
            void_m3=np.asarray(gains.void_volume_m3, dtype=float),
            unknown_m3=np.asarray(gains.unknown_volume_m3, dtype=float),
            frontier_m2=np.asarray(gains.frontier_area_m2, dtype=float),
        )

    def gain_at(self, pose: Array, joints: Joints) -> float:
        """What the view (4, 4) is worth [m^3] when it is taken at these joints, with the robot in the image."""
        gain = self._weighed(self._source.gain_at(pose, joints)) * self._trust(pose[None])
        return float(gain[0])

    def note_scan(self, points: Array, T_map_sensor: Array, joints: Joints) -> None:
        """Learn from a scan which rays come back: (N, 3) points [m] of the optical frame, taken at these joints."""
        self._source.note(points, T_map_sensor, joints)

    def note_gain(self, pose: Array, expected_m3: float, real_m3: float) -> bool:
        """Learn what a view has shown anew; True when it was about what was expected, else it is remembered."""
        share = real_m3 / expected_m3 if expected_m3 > 0 else 1.0
        kept = share >= DISAPPOINTING_SHARE
        if not kept:
            self._doubts.append(Doubt(pose, max(share, 0.0)))
        return kept

    def _weighed(self, gains: ViewGains) -> Array:
        void: Array = np.asarray(gains.void_volume_m3, dtype=float)
        unknown = np.asarray(gains.unknown_volume_m3, dtype=float)
        return void + self._settings.known_weight * (unknown - void)

    def _trust(self, poses: Array) -> Array:
        """Share of the expected gain to believe in, from what similar views have shown."""
        trust = np.ones(len(poses))
        spread_rad = math.radians(self._settings.doubt_deg)
        for doubt in self._doubts:
            alike = are_alike(poses, doubt.pose, self._settings.doubt_m, spread_rad)
            trust[alike] = np.minimum(trust[alike], doubt.share)
        return trust
