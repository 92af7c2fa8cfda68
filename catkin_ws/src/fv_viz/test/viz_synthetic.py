"""A small room, scanned from a few places by brute force: consistent messages for tests and for trying the drawing.

Nothing here is the project's algorithm: scipy and dense arrays, easy to check by eye.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from fv_msgs.msg import (
    Box,
    Contacts,
    Ellipsoid,
    Evaluation,
    ExplorationVolume,
    FrontierVoid,
    PlannedPath,
    View,
    Views,
)
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from scipy import ndimage
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation
from std_msgs.msg import Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

HEADER = Header(frame_id="world")
LOW, HIGH = np.array([-1.0, -1.6, -0.8]), np.array([2.2, 1.6, 1.4])
SOLIDS = (  # low, high corners [m]: floor, back wall, table, two boxes on it, a cabinet with an open front
    ((-1.0, -1.6, -0.8), (2.2, 1.6, -0.7)),
    ((2.1, -1.6, -0.8), (2.2, 1.6, 1.4)),
    ((0.9, -0.9, -0.05), (1.7, 0.5, 0.05)),
    ((1.1, -0.6, 0.05), (1.4, -0.3, 0.35)),
    ((1.3, 0.0, 0.05), (1.6, 0.3, 0.5)),
    ((1.0, 0.8, -0.7), (1.05, 1.5, 0.9)),
    ((1.0, 1.45, -0.7), (1.8, 1.5, 0.9)),
    ((1.75, 0.8, -0.7), (1.8, 1.5, 0.9)),
)
UNKNOWN, FREE, OCCUPIED = 0, 1, 2


@dataclasses.dataclass
class Room:
    """States (X, Y, Z) of the voxels of LOW..HIGH."""

    resolution: float
    states: np.ndarray

    def centers(self, mask: np.ndarray) -> np.ndarray:
        """Centres (N, 3) float32 of a mask."""
        return ((np.argwhere(mask) + 0.5) * self.resolution + LOW).astype(np.float32)


def scan(resolution: float, eyes, reach_m: float = 2.6) -> Room:
    """March 20 000 rays from each eye (x, y, z, yaw) through the true solids."""
    counts = np.rint((HIGH - LOW) / resolution).astype(int)
    centers = (np.indices(counts).reshape(3, -1).T + 0.5) * resolution + LOW
    solid = np.zeros(len(centers), dtype=bool)
    for low, high in SOLIDS:
        solid |= ((centers > np.array(low) - 1e-9) & (centers < np.array(high) + 1e-9)).all(axis=1)
    solid = solid.reshape(counts)
    states = np.zeros(counts, dtype=np.uint8)
    for x, y, z, yaw in eyes:
        _march(states, solid, np.array([x, y, z]), yaw, resolution, reach_m)
    return Room(resolution, states)


def _march(states, solid, eye, yaw, resolution, reach_m) -> None:
    u, v = np.meshgrid(np.linspace(-0.75, 0.75, 240), np.linspace(-0.6, 0.6, 200))
    directions = np.stack([np.ones_like(u), u, v], axis=-1).reshape(-1, 3)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    directions = directions @ Rotation.from_euler("yz", [0.35, yaw]).as_matrix().T
    alive = np.ones(len(directions), dtype=bool)
    for distance in np.arange(0.1, reach_m, resolution / 2):
        index = np.floor((eye + directions[alive] * distance - LOW) / resolution).astype(int)
        inside = ((index >= 0) & (index < states.shape)).all(axis=1)
        alive[np.flatnonzero(alive)[~inside]] = False
        cells = tuple(index[inside].T)
        hit = solid[cells]
        states[tuple(k[hit] for k in cells)] = OCCUPIED
        open_cells = tuple(k[~hit] for k in cells)
        states[open_cells] = np.maximum(states[open_cells], FREE)
        alive[np.flatnonzero(alive)[hit]] = False


def evaluation(room: Room, sequence: int = 1) -> Evaluation:
    """Frontiers, voids, ellipsoids, sets and a plausible utility of a room."""
    cube = np.ones((3, 3, 3), dtype=bool)
    unknown, free, occupied = (room.states == k for k in (UNKNOWN, FREE, OCCUPIED))
    frontier = free & ndimage.binary_dilation(unknown, cube)
    clusters, _ = ndimage.label(frontier, cube)
    void = unknown & _inside_hull(room, occupied)
    blobs, count = ndimage.label(ndimage.binary_opening(void, cube), cube)
    void &= blobs > 0
    msg = Evaluation(header=HEADER, map_sequence=sequence, resolution=room.resolution)
    for name, mask in (("occupied", occupied), ("free", free), ("frontier", frontier), ("void", void)):
        setattr(msg, name, room.centers(mask).ravel())
    msg.frontier_cluster = clusters[frontier].astype(np.uint32)
    msg.void_ellipsoid = (blobs[void] - 1).astype(np.uint32)
    for number in range(1, count + 1):
        points = room.centers(blobs == number)
        msg.ellipsoids.append(_ellipsoid(points))
        msg.initial_ellipsoids += [_ellipsoid(part) for part in np.array_split(points, 4) if len(part) > 3]
        near = ndimage.binary_dilation(blobs == number, cube, iterations=2) & frontier
        msg.frontier_voids.append(FrontierVoid(number - 1, [int(k) for k in np.unique(clusters[near])]))
    _utility(msg, room, free, void)
    return msg


def _inside_hull(room: Room, occupied: np.ndarray) -> np.ndarray:
    hull = Delaunay(room.centers(occupied)[::7].astype(float))
    every = room.centers(np.ones_like(occupied)).astype(float)
    return (hull.find_simplex(every) >= 0).reshape(occupied.shape)


def _ellipsoid(points: np.ndarray) -> Ellipsoid:
    center = points.mean(axis=0)
    values, axes = np.linalg.eigh(np.cov(points.T) + 1e-9 * np.eye(3))
    axes = axes[:, ::-1] * np.array([1.0, 1.0, np.sign(np.linalg.det(axes[:, ::-1]))])
    out = Ellipsoid(center=Point(*center), orientation=Quaternion(*Rotation.from_matrix(axes).as_quat()))
    out.semi_axes = Vector3(*(2.0 * np.sqrt(values[::-1])))
    out.voxel_count = len(points)
    return out


def _utility(msg: Evaluation, room: Room, free: np.ndarray, void: np.ndarray) -> None:
    distance, nearest = ndimage.distance_transform_edt(~void, sampling=room.resolution, return_indices=True)
    worth = np.where(free, np.exp(-((distance - 0.6) ** 2) / 0.05), 0.0)
    mask = worth > 0.01
    target = room.centers(np.ones_like(free)).reshape(*free.shape, 3)[tuple(nearest)]
    direction = (target[mask] - room.centers(mask)).astype(np.float32)
    msg.utility_points = room.centers(mask).ravel()
    msg.utility = worth[mask].astype(np.float32)
    msg.utility_direction = (
        direction / np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-6)
    ).ravel()


def views(msg: Evaluation, count: int = 15) -> Views:
    """The voxels of highest utility, thinned, as camera poses."""
    points, worth = np.reshape(msg.utility_points, (-1, 3)), np.array(msg.utility)
    looks = np.reshape(msg.utility_direction, (-1, 3))
    out = Views(HEADER, msg.map_sequence, 1, np.deg2rad(58), np.deg2rad(45), 3.0, [], 0)
    taken: list[int] = []
    for k in np.argsort(-worth):
        if len(taken) < count and all(np.linalg.norm(points[k] - points[t]) > 0.3 for t in taken):
            taken.append(k)
            pose = Pose(Point(*points[k]), Quaternion(*_look_along(looks[k])))
            score = float(worth[k])
            out.views.append(View(pose, score, 0.1 * score, 0.12 * score, 0.3, score, 0.5))
    return out


def _look_along(direction: np.ndarray) -> np.ndarray:
    down = np.array([0.0, 0.0, -1.0])
    z = direction / np.linalg.norm(direction)
    x = np.cross(down, z)
    x /= max(np.linalg.norm(x), 1e-9)
    return Rotation.from_matrix(np.column_stack([x, np.cross(z, x), z])).as_quat()


def volume() -> ExplorationVolume:
    """The room's bounds, a clearance box and a sphere."""
    box = Box(Point(-0.3, -0.3, -0.7), Point(0.5, 0.3, 0.6))
    return ExplorationVolume(HEADER, Box(Point(*LOW), Point(*HIGH)), [box], [Point(0.2, -0.4, 0.2)], [0.2])


def path(joints: int = 3, points: int = 20) -> PlannedPath:
    """An arm that swings, and its tip."""
    share = np.linspace(0.0, 1.0, points)
    way = np.outer(share, np.linspace(0.4, 1.2, joints))
    trajectory = JointTrajectory(HEADER, [f"j{k}" for k in range(joints)], [])
    trajectory.points = [JointTrajectoryPoint(positions=list(row)) for row in way]
    tips = [
        Pose(Point(0.6 * np.cos(a), 0.6 * np.sin(a), 0.3 + 0.2 * a), Quaternion(0, 0, 0, 1))
        for a in way.sum(axis=1)
    ]
    return PlannedPath(header=HEADER, map_sequence=1, trajectory=trajectory, tip_poses=tips)


def contacts(touching: bool) -> Contacts:
    """One contact of the third link, or none."""
    pairs = ["l2|table"] if touching else []
    return Contacts(HEADER, len(pairs), pairs, [0.001] * len(pairs))


BASE = '<link name="base_link"><visual><geometry><cylinder radius="0.12" length="0.8"/></geometry></visual></link>'
LINK = """<link name="l{k}"><visual><origin xyz="0.15 0 0"/><geometry><box size="0.3 0.06 0.06"/></geometry></visual>
</link>
<joint name="j{k}" type="revolute"><parent link="{parent}"/><child link="l{k}"/><origin xyz="{x} 0 {z}"/>
<axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>"""


def urdf(joints: int = 3) -> str:
    """A chain of boxes with joints j0, j1, ..."""
    links = [BASE]
    for k in range(joints):
        z, x = (0.3, 0.0) if k == 0 else (0.0, 0.3)
        links.append(LINK.format(k=k, parent=f"l{k - 1}" if k else "base_link", x=x, z=z))
    return f'<robot name="arm">{"".join(links)}</robot>'
