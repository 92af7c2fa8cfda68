"""Worlds made from a seed: cluttered rooms, and tables with odd things on them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from hubo_sim.errors import SimError
from hubo_sim.ground_truth.triangles import mesh_triangles
from hubo_sim.paths import resolve_file

_ROBOT = {"position_m": [0.0, 0.0, 0.01], "yaw_deg": 0.0}
_CLEAR_M = 0.8  # nothing is put nearer to the robot's vertical axis than this
_THINGS = 1000  # objects in pybullet_data's random_urdfs


def generate(kind: str, seed: int) -> dict[str, Any]:
    """Content of a world file of a kind (see KINDS). The same seed gives the same world. Raises SimError."""
    if kind not in KINDS:
        raise SimError(f"unknown kind of world {kind!r}; valid: {', '.join(KINDS)}")
    return KINDS[kind](np.random.default_rng(seed), seed)


def _room(rng: np.random.Generator, seed: int) -> dict[str, Any]:
    """A closed room with furniture along the walls and crates, cylinders and balls on the floor."""
    size = rng.uniform([3.6, 3.6, 2.4], [4.6, 4.6, 2.8]).round(2)
    objects = _walls(size)
    placed: list[tuple[np.ndarray, float]] = [(np.zeros(2), _CLEAR_M)]
    wanted = int(rng.integers(10, 18))
    for _ in range(400):
        if len(placed) > wanted:
            break
        height, half = rng.uniform(0.25, 1.8), rng.uniform([0.12, 0.12], [0.4, 0.4])
        radius = float(np.hypot(*half))
        where = rng.uniform(-size[:2] / 2 + radius, size[:2] / 2 - radius)
        if all(np.linalg.norm(where - other) > radius + reach for other, reach in placed):
            objects.append(_piece(rng, len(placed), where, half, height))
            placed.append((where, radius))
    low, high = [-size[0] / 2, -size[1] / 2, 0.0], [size[0] / 2, size[1] / 2, size[2]]
    return {
        "description": f"a cluttered room made from seed {seed}",
        "robot": _ROBOT,
        "bounds": {"min_m": _plain(low), "max_m": _plain(high)},
        "camera": {
            "eye_m": _plain(0.93 * np.array([low[0], low[1], high[2]])),
            "target_m": [0.3, 0.3, 0.5],
            "fov_deg": 90.0,
        },
        "objects": objects,
    }


def _walls(size: np.ndarray) -> list[dict[str, Any]]:
    """Floor, ceiling and four walls, 0.1 m thick, about a room of size (3,) [m]."""
    x, y, z = size
    parts = {
        "floor": ([x + 0.2, y + 0.2, 0.1], [0, 0, -0.05], [0.5, 0.45, 0.4]),
        "ceiling": ([x + 0.2, y + 0.2, 0.1], [0, 0, z + 0.05], [0.95, 0.95, 0.95]),
        "wall_front": ([0.1, y + 0.2, z], [x / 2 + 0.05, 0, z / 2], [0.9, 0.88, 0.82]),
        "wall_back": ([0.1, y + 0.2, z], [-x / 2 - 0.05, 0, z / 2], [0.9, 0.88, 0.82]),
        "wall_left": ([x, 0.1, z], [0, y / 2 + 0.05, z / 2], [0.82, 0.87, 0.9]),
        "wall_right": ([x, 0.1, z], [0, -y / 2 - 0.05, z / 2], [0.82, 0.87, 0.9]),
    }
    return [
        {"name": name, "box": {"size_m": _plain(s)}, "position_m": _plain(p), "color": c}
        for name, (s, p, c) in parts.items()
    ]


def _piece(
    rng: np.random.Generator, number: int, where: np.ndarray, half: np.ndarray, height: float
) -> dict[str, Any]:
    """A crate, an open crate's worth of shelf, a column or a ball, standing on the floor."""
    color, kind = _plain(rng.uniform(0.15, 0.9, 3)), rng.choice(["box", "box", "cylinder", "sphere"])
    entry: dict[str, Any] = {"name": f"{kind}_{number}", "color": color}
    if kind == "box":
        entry |= {
            "box": {"size_m": _plain([*(2 * half / np.sqrt(2)), height])},
            "rpy_deg": _plain([0, 0, rng.uniform(0, 180)]),
        }
    elif kind == "cylinder":
        entry |= {"cylinder": {"radius_m": round(float(half.min()), 3), "length_m": round(height, 3)}}
    else:
        height = 2.0 * float(half.min())
        entry |= {"sphere": {"radius_m": round(float(half.min()), 3)}}
    return entry | {"position_m": _plain([*where, height / 2.0])}


def _tabletop(rng: np.random.Generator, seed: int) -> dict[str, Any]:
    """A table in front of the robot with things of pybullet_data's random_urdfs on it."""
    top = 0.76
    objects = [
        {
            "name": "floor",
            "box": {"size_m": [8.0, 8.0, 0.1]},
            "position_m": [0, 0, -0.05],
            "color": [0.55, 0.5, 0.45],
        },
        {
            "name": "table_top",
            "box": {"size_m": [0.8, 1.4, 0.04]},
            "position_m": [1.2, -0.1, top - 0.02],
            "color": [0.72, 0.52, 0.33],
        },
    ]
    for i, (x, y) in enumerate([(0.85, -0.75), (0.85, 0.55), (1.55, -0.75), (1.55, 0.55)]):
        leg = {
            "name": f"table_leg_{i}",
            "box": {"size_m": [0.06, 0.06, top - 0.04]},
            "color": [0.6, 0.42, 0.26],
        }
        objects.append(leg | {"position_m": [x, y, (top - 0.04) / 2]})
    cells = [(x, y) for x in (0.97, 1.2, 1.43) for y in (-0.65, -0.37, -0.1, 0.17, 0.45)]
    numbers = rng.choice(_THINGS, len(cells), replace=False)
    for i in rng.permutation(len(cells))[:12]:
        objects.append(_thing(rng, int(numbers[i]), cells[i], top))
    return {
        "description": f"a table with odd things (random_urdfs of pybullet_data) on it, made from seed {seed}",
        "robot": _ROBOT,
        "bounds": {"min_m": [-0.5, -1.1, 0.1], "max_m": [1.8, 0.9, 1.6]},
        "camera": {"eye_m": [-0.5, -1.5, 1.85], "target_m": [1.0, -0.1, 0.75], "fov_deg": 55.0},
        "objects": objects,
    }


def _thing(rng: np.random.Generator, number: int, where: tuple[float, float], top_m: float) -> dict[str, Any]:
    """One of the random objects, standing on a table of height top_m."""
    file, scale = f"pybullet_data:random_urdfs/{number:03d}/{number:03d}.obj", 0.028
    lowest = mesh_triangles(resolve_file(file, "tabletop"), np.full(3, scale))[..., 2].min()
    return {
        "name": f"thing_{number:03d}",
        "mesh": {"file": file, "scale": scale},
        "position_m": _plain([where[0], where[1], top_m - lowest]),
        "rpy_deg": _plain([0, 0, rng.uniform(0, 360)]),
        "color": _plain(rng.uniform(0.2, 0.95, 3)),
    }


def _plain(values: Any) -> list[float]:
    return [round(float(v), 4) for v in values]


KINDS: dict[str, Callable[[np.random.Generator, int], dict[str, Any]]] = {
    "room": _room,
    "tabletop": _tabletop,
}
