"""Which camera poses the arm can hold at all: the capability map, carried along by the joints before it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from fv_exploration.view_geometry import upright_poses

Array = NDArray[np.float64]

FREE = 0
"""What ``OccupancyMap.classify`` says of a free voxel."""


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
        centres_map = self._T_map_bases[:, :3, :3] @ centre + self._T_map_bases[:, :3, 3]
        within: NDArray[np.bool_] = (cdist(positions, centres_map) <= reach).any(axis=1)
        return within

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


class CameraFit:
    """Whether what moves with the camera fits into known free space at a view, whatever the rest of the robot does.

    :param balls: (S, 4) centre and radius [m] in the camera's frame, that cover what moves with it.
    :param classify: ``(positions (N, 3)) -> (N,)`` with 0 for free.
    """

    ROLLS = 4

    def __init__(self, balls: Array, classify: Callable[[Array], NDArray[np.int8]]) -> None:
        reach = np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
        self._points = (balls[:, None, :3] + balls[:, None, 3:] * reach).reshape(-1, 3)
        self._classify = classify

    def __call__(self, positions: Array, directions: Array) -> NDArray[np.bool_]:
        """(N,) which views, positions (N, 3) and unit directions (N, 3), have room for it in some roll of the image."""
        poses = upright_poses(positions, directions)
        fits = np.zeros(len(poses), dtype=bool)
        for angle in np.arange(self.ROLLS) * 2.0 * math.pi / self.ROLLS:
            rows = np.nonzero(~fits)[0]
            c, s = math.cos(angle), math.sin(angle)
            rolled = self._points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
            points = np.einsum("nij,pj->npi", poses[rows, :3, :3], rolled) + poses[rows, None, :3, 3]
            free = self._classify(points.reshape(-1, 3)).reshape(len(rows), len(rolled)) == FREE
            fits[rows] = free.all(axis=1)
        return fits


class DrawnViews:
    """Views of a group without a capability map, such as a camera that flies: drawn from its joint space.

    Where the camera has room in the box about many drawn positions counts as reachable; the planner has the last word.
    Half of the samples are drawn poses, half look in drawn directions from known free space: of a large joint space
    little may be free.

    :param draw: ``(count, random) -> (count, 4, 4)`` camera poses in the map frame that the group can take.
    :param free_space: centres (F, 3) of the voxels that are known to be free, at the moment.
    :param fits: ``(positions (N, 3), directions (N, 3)) -> (N,)`` whether the camera has room there.
    """

    def __init__(
        self,
        draw: Callable[[int, np.random.Generator], Array],
        free_space: Callable[[], Array],
        fits: Callable[[Array, Array], NDArray[np.bool_]],
    ) -> None:
        self._draw = draw
        self._free_space = free_space
        self._fits = fits
        positions = draw(4000, np.random.default_rng(0))[:, :3, 3]
        self._low, self._high = positions.min(axis=0), positions.max(axis=0)

    def reachability(self, positions: Array, directions: Array) -> Array:
        """(N,) 1 where the camera has room within the box, 0 elsewhere."""
        inside = self.within_reach(positions)
        inside[inside] = self._fits(positions[inside], directions[inside])
        return inside.astype(float)

    def within_reach(self, positions: Array) -> NDArray[np.bool_]:
        """Which of (N, 3) positions [m] of the map frame lie in the box."""
        within: NDArray[np.bool_] = ((positions >= self._low) & (positions <= self._high)).all(axis=1)
        return within

    def sample(self, count: int, random: np.random.Generator) -> tuple[Array, Array]:
        """Positions (count, 3) [m] and unit directions (count, 3), map frame."""
        poses = self._draw(count, random)
        positions, directions = poses[:, :3, 3], poses[:, :3, 2]
        free = np.asarray(self._free_space(), dtype=float)
        free = free[self.within_reach(free)]
        if len(free):
            half = count // 2
            positions[:half] = free[random.integers(len(free), size=half)]
        return positions, directions
