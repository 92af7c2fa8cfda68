"""True objects as signed distances: exact for boxes, cylinders and spheres; sampled for meshes."""

from __future__ import annotations

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from fv_common.transforms import apply, inverse
from hubo_sim.worlds import WorldObject
from hubo_sim.worlds.triangles import (
    box_triangles,
    cylinder_triangles,
    mesh_triangles,
    sphere_triangles,
    surface_points,
)

# Mesh surfaces are points this close; distances to meshes are too large by at most this.
MESH_SPACING_M = 0.01
_MAX_MESH_POINTS = 3_000_000


class Solid:
    """An object at rest. Distances are positive outside and negative inside [m]."""

    def __init__(self, name: str, triangles: np.ndarray, T_world_object: np.ndarray) -> None:
        self.name = name
        self.triangles = apply(T_world_object, triangles)  # (N, 3, 3) world frame
        self.low_m = self.triangles.min(axis=(0, 1))
        self.high_m = self.triangles.max(axis=(0, 1))
        self._T_object_world = inverse(T_world_object)

    def distance(self, points: np.ndarray, cap_m: float = np.inf) -> np.ndarray:
        """Unsigned distance (P,) of world points (P, 3) to the surface; inf is allowed where it is beyond cap_m."""
        return np.abs(self._signed(apply(self._T_object_world, points)))

    def depth_inside(self, points: np.ndarray) -> np.ndarray:
        """(P,) how far inside world points (P, 3) are, 0 outside."""
        return np.maximum(-self._signed(apply(self._T_object_world, points)), 0.0)

    def _signed(self, p: np.ndarray) -> np.ndarray:
        raise NotImplementedError


class BoxSolid(Solid):
    """An exact box."""

    def __init__(self, name: str, size_m: np.ndarray, T_world_object: np.ndarray) -> None:
        super().__init__(name, box_triangles(size_m), T_world_object)
        self._half = np.asarray(size_m) / 2.0

    def _signed(self, p: np.ndarray) -> np.ndarray:
        q = np.abs(p) - self._half
        return np.linalg.norm(np.maximum(q, 0.0), axis=-1) + np.minimum(q.max(-1), 0.0)


class CylinderSolid(Solid):
    """An exact cylinder along its z axis."""

    def __init__(self, name: str, radius_m: float, length_m: float, T_world_object: np.ndarray) -> None:
        super().__init__(name, cylinder_triangles(radius_m, length_m), T_world_object)
        self._size = np.array([radius_m, length_m / 2.0])

    def _signed(self, p: np.ndarray) -> np.ndarray:
        q = np.stack([np.hypot(p[:, 0], p[:, 1]), np.abs(p[:, 2])], -1) - self._size
        return np.linalg.norm(np.maximum(q, 0.0), axis=-1) + np.minimum(q.max(-1), 0.0)


class SphereSolid(Solid):
    """An exact sphere."""

    def __init__(self, name: str, radius_m: float, T_world_object: np.ndarray) -> None:
        super().__init__(name, sphere_triangles(radius_m), T_world_object)
        self._radius = radius_m

    def _signed(self, p: np.ndarray) -> np.ndarray:
        return np.linalg.norm(p, axis=-1) - self._radius


class MeshSolid(Solid):
    """A mesh: nearest of dense surface points; inside is what a flood from outside does not reach.

    So a mesh need not be closed to the last edge, and sheets have no inside.
    """

    def __init__(self, name: str, triangles: np.ndarray, T_world_object: np.ndarray) -> None:
        super().__init__(name, triangles, T_world_object)
        sides = triangles[:, 1:] - triangles[:, :1]
        area_m2 = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2.0
        self.spacing_m = max(MESH_SPACING_M, 4.0 * float(np.sqrt(area_m2 / _MAX_MESH_POINTS)))
        points = _thinned(surface_points(triangles, self.spacing_m), self.spacing_m / 4.0)
        self._tree = cKDTree(points)
        self._first, self._cell_m, self._inside = _flood(points, self.spacing_m)

    def distance(self, points: np.ndarray, cap_m: float = np.inf) -> np.ndarray:
        """Unsigned distance (P,) of world points (P, 3), too large by at most spacing_m; inf beyond cap_m."""
        return self._tree.query(apply(self._T_object_world, points), distance_upper_bound=cap_m)[0]

    def depth_inside(self, points: np.ndarray) -> np.ndarray:
        """(P,) how far inside world points (P, 3) are, 0 outside and in the cells of the surface itself."""
        local = apply(self._T_object_world, points)
        cells = np.floor((local - self._first) / self._cell_m).astype(int)
        within = ((cells >= 0) & (cells < self._inside.shape)).all(-1)
        rows = np.flatnonzero(within)
        rows = rows[self._inside[tuple(cells[rows].T)]]
        out = np.zeros(len(points))
        out[rows] = self._tree.query(local[rows])[0]
        return out


def _thinned(points: np.ndarray, cell_m: float) -> np.ndarray:
    """One of the points (P, 3) in each cell that has any: slivers of a mesh are sampled many times over."""
    cells = np.floor((points - points.min(axis=0)) / cell_m).astype(np.int64)
    shape = cells.max(axis=0) + 1
    keys = (cells[:, 0] * shape[1] + cells[:, 1]) * shape[2] + cells[:, 2]
    return points[np.unique(keys, return_index=True)[1]]


def _flood(points: np.ndarray, spacing_m: float) -> tuple[np.ndarray, float, np.ndarray]:
    """First corner (3,), cell size [m] and (X, Y, Z) inside flags of a cell grid about surface points (P, 3)."""
    extent = np.ptp(points, axis=0)
    cell_m = max(1.25 * spacing_m, float(extent.max()) / 400.0)
    first = points.min(axis=0) - 1.5 * cell_m  # an empty rim, where the outside begins
    surface = np.zeros(np.ceil(extent / cell_m).astype(int) + 4, bool)
    surface[tuple(np.floor((points - first) / cell_m).astype(int).T)] = True
    labels, _ = ndimage.label(~surface)
    return first, cell_m, ~surface & (labels != labels[0, 0, 0])


def solid_of(item: WorldObject) -> Solid:
    """The solid of a world's primitive or mesh. Raises SimError for a broken mesh."""
    T, size = item.T_world_object, item.size
    if item.shape == "box":
        return BoxSolid(item.name, size["size_m"], T)
    if item.shape == "cylinder":
        return CylinderSolid(item.name, size["radius_m"], size["length_m"], T)
    if item.shape == "sphere":
        return SphereSolid(item.name, size["radius_m"], T)
    return MeshSolid(item.name, mesh_triangles(size["file"], size["scale"]), T)
