"""Which camera poses the arm can hold at all: the capability map, carried along by the joints before it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class CapabilityQueries(Protocol):
    """The part of ``capability_map.CapabilityMap`` that is used here."""

    centres: Array
    directions: Array
    radius: float
    valid: NDArray[np.bool_]

    def query(self, positions: Array, directions: Array, interpolate: bool = True) -> NDArray[np.float32]:
        """Reachability 0..1 of (N, 3) tip positions with (N, 3) viewing directions, in the map's base frame."""


class ReachableViews:
    """Answers and draws views that the exploring group can hold.

    The capability map's base may itself be moved by joints of the group (HUBO's waist carries the shoulder): it is
    looked at in every base pose of a grid over these joints.

    :param capability: map of the arm, in its own base frame.
    :param T_map_bases: (K, 4, 4) poses of that base frame in the map frame, one for each grid point.
    """

    def __init__(self, capability: CapabilityQueries, T_map_bases: Array) -> None:
        self._capability = capability
        self._T_map_bases = np.asarray(T_map_bases, dtype=float)
        spheres, points = np.nonzero(capability.valid)
        self._valid_spheres = spheres
        self._valid_points = points

    def reachability(self, positions: Array, directions: Array) -> Array:
        """The best answer over all base poses.

        :param positions: (N, 3) [m], map frame.
        :param directions: (N, 3) unit vectors, map frame.
        :return: (N,) 0..1.
        """
        best = np.zeros(len(positions))
        for T_map_base in self._T_map_bases:
            rotation = T_map_base[:3, :3]
            local_positions = (positions - T_map_base[:3, 3]) @ rotation
            local_directions = directions @ rotation
            answers = self._capability.query(local_positions, local_directions, interpolate=True)
            np.maximum(best, answers, out=best)
        return best

    def within_reach(self, positions: Array) -> NDArray[np.bool_]:
        """Which of (N, 3) positions [m] of the map frame lie in the ball that bounds the map, in some base pose."""
        centre = self._capability.centres.mean(axis=0)
        reach = np.linalg.norm(self._capability.centres - centre, axis=1).max() + self._capability.radius
        inside = np.zeros(len(positions), dtype=bool)
        for T_map_base in self._T_map_bases:
            centre_map = T_map_base[:3, :3] @ centre + T_map_base[:3, 3]
            inside |= np.linalg.norm(positions - centre_map, axis=1) <= reach
        return inside

    def sample(self, count: int, random: np.random.Generator) -> tuple[Array, Array]:
        """Views drawn evenly from the valid sphere points and the base poses.

        A sphere point's frame lies one radius before the sphere's centre and looks at it.

        :return: positions (count, 3) [m] and unit directions (count, 3), map frame; empty when nothing is valid.
        """
        if len(self._valid_spheres) == 0:
            return np.empty((0, 3)), np.empty((0, 3))
        drawn = random.integers(len(self._valid_spheres), size=count)
        bases = self._T_map_bases[random.integers(len(self._T_map_bases), size=count)]
        looking = -self._capability.directions[self._valid_points[drawn]]
        positions = self._capability.centres[self._valid_spheres[drawn]] - self._capability.radius * looking
        rotations = bases[:, :3, :3]
        return (
            np.einsum("nij,nj->ni", rotations, positions) + bases[:, :3, 3],
            np.einsum("nij,nj->ni", rotations, looking),
        )


class DrawnViews:
    """Views of a group without a capability map, such as a camera that flies: drawn from its joint space.

    Whatever lies in the box about many drawn positions counts as reachable; the planner has the last word.

    :param draw: ``(count, random) -> (count, 4, 4)`` camera poses in the map frame that the group can take.
    """

    def __init__(self, draw: Callable[[int, np.random.Generator], Array]) -> None:
        self._draw = draw
        positions = draw(4000, np.random.default_rng(0))[:, :3, 3]
        self._low, self._high = positions.min(axis=0), positions.max(axis=0)

    def reachability(self, positions: Array, directions: Array) -> Array:
        """(N,) 1 within the box, 0 elsewhere, whatever the direction."""
        return self.within_reach(positions).astype(float)

    def within_reach(self, positions: Array) -> NDArray[np.bool_]:
        """Which of (N, 3) positions [m] of the map frame lie in the box."""
        return ((positions >= self._low) & (positions <= self._high)).all(axis=1)

    def sample(self, count: int, random: np.random.Generator) -> tuple[Array, Array]:
        """Positions (count, 3) [m] and unit directions (count, 3), map frame."""
        poses = self._draw(count, random)
        return poses[:, :3, 3], poses[:, :3, 2]
