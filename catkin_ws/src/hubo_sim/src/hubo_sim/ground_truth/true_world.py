"""The truth about a world, the robot left out: distances, depth inside, occupied voxels."""

from __future__ import annotations

import numpy as np

from fv_common.transforms import transform
from hubo_sim.bullet import pybullet
from hubo_sim.ground_truth.solids import BoxSolid, CylinderSolid, MeshSolid, Solid, SphereSolid, solid_of
from hubo_sim.worlds import Bounds, World, WorldObject
from hubo_sim.worlds.scene import Scene, root_pose
from hubo_sim.worlds.triangles import mesh_triangles, surface_points


class TrueWorld:
    """The solids of a world file, where the file puts them."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.solids: list[Solid] = []
        for item in world.objects:
            self.solids += _solids_of_file(item) if item.shape in ("urdf", "sdf") else [solid_of(item)]

    def distance_to_surface(self, points: np.ndarray, cap_m: float = 1.0) -> np.ndarray:
        """(P,) distance [m] of world points (P, 3) to the nearest true surface, cap_m where it is further.

        Exact for boxes, cylinders and spheres; for meshes too large by at most MESH_SPACING_M.
        """
        out = np.full(len(points), cap_m)
        for solid in self.solids:
            near = _within(points, solid, out)
            if near.size:
                out[near] = np.minimum(out[near], solid.distance(points[near], cap_m))
        return out

    def depth_inside_solid(self, points: np.ndarray) -> np.ndarray:
        """(P,) depth [m] of world points (P, 3) below the surface of the solid they are deepest in, 0 outside of all.

        Where solids overlap this is less than the depth inside of their union.
        """
        out = np.zeros(len(points))
        for solid in self.solids:
            near = np.flatnonzero(((points >= solid.low_m) & (points <= solid.high_m)).all(-1))
            if near.size:
                out[near] = np.maximum(out[near], solid.depth_inside(points[near]))
        return out

    def surface_voxels(self, resolution_m: float, bounds: Bounds | None = None) -> np.ndarray:
        """(V, 3) centres of the voxels that a surface passes through (to a quarter of a voxel)."""
        low, high = (bounds or self.world.bounds).corners
        keys = [np.zeros((0, 3), np.int64)]
        for solid in self.solids:
            if (solid.high_m < low).any() or (solid.low_m > high).any():
                continue
            points = surface_points(solid.triangles, 0.5 * resolution_m, low, high)
            keys.append(np.unique(np.floor(points / resolution_m).astype(np.int64), axis=0))
        centres = (np.unique(np.concatenate(keys), axis=0) + 0.5) * resolution_m
        return centres[((centres > low) & (centres < high)).all(1)]

    def solid_voxels(self, resolution_m: float, bounds: Bounds | None = None) -> np.ndarray:
        """(V, 3) centres of the voxels whose centre lies inside a solid."""
        centres = grid_centres(resolution_m, bounds or self.world.bounds)
        return centres[self.depth_inside_solid(centres) > 0.0]


def grid_centres(resolution_m: float, bounds: Bounds) -> np.ndarray:
    """(V, 3) centres of all voxels with their centre inside the bounds; the grid is OctoMap's: (k + 0.5) resolution."""
    low, high = bounds.corners / resolution_m
    first, last = np.ceil(low - 0.5 + 1e-9).astype(int), np.floor(high - 0.5 - 1e-9).astype(int)
    axes = [(np.arange(a, b + 1) + 0.5) * resolution_m for a, b in zip(first, last, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)


def _within(points: np.ndarray, solid: Solid, reach: np.ndarray) -> np.ndarray:
    """Rows of the points whose distance to the solid's bounding box is below reach (P,)."""
    gap = np.maximum(np.maximum(solid.low_m - points, points - solid.high_m), 0.0)
    return np.flatnonzero((gap**2).sum(-1) < reach**2)


def _solids_of_file(item: WorldObject) -> list[Solid]:
    """The visible shapes of a URDF or SDF, as Bullet loads it."""
    with Scene(egl=False) as scene:
        body = scene.add_object(item)
        client = scene.client
        out = []
        for i, data in enumerate(client.getVisualShapeData(body)):
            state = None if data[1] < 0 else client.getLinkState(body, data[1])
            T_link = root_pose(client, body) if state is None else transform(state[4], state[5])
            T = T_link @ transform(data[5], data[6])
            out.append(_visual_solid(f"{item.name}.{i}", data, T))
        return out


def _visual_solid(name: str, data: tuple, T_world_shape: np.ndarray) -> Solid:
    kind, size = data[2], data[3]
    if kind == pybullet.GEOM_BOX:
        return BoxSolid(name, np.array(size), T_world_shape)
    if kind == pybullet.GEOM_SPHERE:
        return SphereSolid(name, size[0], T_world_shape)
    if kind == pybullet.GEOM_CYLINDER:
        return CylinderSolid(name, size[1], size[0], T_world_shape)
    return MeshSolid(name, mesh_triangles(data[4].decode(), np.array(size)), T_world_shape)
