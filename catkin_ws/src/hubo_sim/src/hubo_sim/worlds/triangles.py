"""Objects as triangles, and triangles as points."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hubo_sim.errors import SimError

_AROUND = 48  # facets around cylinders and spheres: within 0.3 % of the radius of the true surface


def box_triangles(size_m: np.ndarray) -> np.ndarray:
    """(12, 3, 3) triangles of an axis-aligned box about the origin."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * size_m / 2.0
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return np.array([corners[list(t)] for q in quads for t in (q[:3], (q[0], q[2], q[3]))])


def revolved_triangles(radius_m: np.ndarray, z_m: np.ndarray) -> np.ndarray:
    """(N, 3, 3) triangles of a profile (radius, z) (K,) turned about the z axis."""
    angle = np.linspace(0.0, 2.0 * np.pi, _AROUND + 1)
    ring = np.stack([np.cos(angle), np.sin(angle)], -1)  # (A, 2)
    grid = np.concatenate(
        [radius_m[:, None, None] * ring, np.broadcast_to(z_m[:, None, None], (len(z_m), _AROUND + 1, 1))], -1
    )
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    return np.concatenate(
        [np.stack([a, b, c], 2).reshape(-1, 3, 3), np.stack([a, c, d], 2).reshape(-1, 3, 3)]
    )


def cylinder_triangles(radius_m: float, length_m: float) -> np.ndarray:
    """Triangles of a cylinder along z about the origin."""
    half = length_m / 2.0
    return revolved_triangles(np.array([0.0, radius_m, radius_m, 0.0]), np.array([-half, -half, half, half]))


def sphere_triangles(radius_m: float) -> np.ndarray:
    """Triangles of a sphere about the origin."""
    angle = np.linspace(-np.pi / 2.0, np.pi / 2.0, _AROUND // 2 + 1)
    return revolved_triangles(radius_m * np.cos(angle), radius_m * np.sin(angle))


def mesh_triangles(file: str, scale: np.ndarray) -> np.ndarray:
    """(N, 3, 3) triangles of an OBJ or STL (binary or text) file. Raises SimError."""
    suffix = Path(file).suffix.lower()
    readers = {".obj": _read_obj, ".stl": _read_stl}
    if suffix not in readers:
        raise SimError(f"{file}: ground truth reads {', '.join(readers)} meshes, not {suffix}")
    try:
        triangles = readers[suffix](Path(file))
    except (ValueError, IndexError, OSError) as err:
        raise SimError(f"{file}: broken mesh: {err}") from err
    return triangles * np.asarray(scale, float)


def _read_obj(path: Path) -> np.ndarray:
    vertices, faces = [], []
    for line in path.read_text(errors="replace").splitlines():
        parts = line.split()
        if parts[:1] == ["v"]:
            vertices.append([float(v) for v in parts[1:4]])
        elif parts[:1] == ["f"]:
            corners = [int(p.split("/")[0]) for p in parts[1:]]
            corners = [c - 1 if c > 0 else len(vertices) + c for c in corners]
            faces += [(corners[0], corners[i], corners[i + 1]) for i in range(1, len(corners) - 1)]
    return np.array(vertices, float).reshape(-1, 3)[np.array(faces, int).reshape(-1, 3)]


def _read_stl(path: Path) -> np.ndarray:
    raw = path.read_bytes()
    count = int.from_bytes(raw[80:84], "little")
    if len(raw) == 84 + 50 * count:
        record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
        return np.frombuffer(raw, record, count, 84)["corners"].astype(float)
    rows = [line.split()[1:4] for line in raw.decode().splitlines() if line.strip().startswith("vertex")]
    return np.array(rows, float).reshape(-1, 3, 3)


def surface_points(triangles: np.ndarray, spacing_m: float, low_m=None, high_m=None) -> np.ndarray:
    """(M, 3) points that cover the triangles (N, 3, 3): no surface point is further than spacing_m / 2 from one.

    Triangles are halved across their longest edge until that is at most 0.75 spacing_m; the points are centroids.
    With low_m, high_m (3,) only what reaches into that box is covered.
    """
    done, todo = [np.zeros((0, 3))], triangles
    while len(todo):
        if low_m is not None:
            todo = todo[(todo.max(1) >= low_m).all(1) & (todo.min(1) <= high_m).all(1)]
        edges = np.linalg.norm(todo - np.roll(todo, -1, axis=1), axis=2)  # corner i to corner i + 1
        longest = edges.argmax(1)
        small = edges[np.arange(len(todo)), longest] <= 0.75 * spacing_m
        done.append(todo[small].mean(axis=1))
        todo, longest = todo[~small], longest[~small]
        rows = np.arange(len(todo))
        a, b, c = (todo[rows, (longest + k) % 3] for k in range(3))
        middle = (a + b) / 2.0
        todo = np.concatenate([np.stack([a, middle, c], 1), np.stack([middle, b, c], 1)])
    return np.concatenate(done)
