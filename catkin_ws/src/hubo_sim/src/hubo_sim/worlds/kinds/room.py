"""room:SEED, a closed room with furniture along the walls and crates, cylinders and balls on the floor."""

from __future__ import annotations

from typing import Any

import numpy as np

from hubo_sim.worlds.kinds._shared import CLEAR_M, ROBOT, plain


def make(rng: np.random.Generator, seed: int) -> dict[str, Any]:
    """The world file's content."""
    size = rng.uniform([3.6, 3.6, 2.4], [4.6, 4.6, 2.8]).round(2)
    objects = _walls(size)
    placed: list[tuple[np.ndarray, float]] = [(np.zeros(2), CLEAR_M)]
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
        "robot": ROBOT,
        "bounds": {"min_m": plain(low), "max_m": plain(high)},
        "camera": {
            "eye_m": plain(0.93 * np.array([low[0], low[1], high[2]])),
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
        {"name": name, "box": {"size_m": plain(s)}, "position_m": plain(p), "color": c}
        for name, (s, p, c) in parts.items()
    ]


def _piece(
    rng: np.random.Generator, number: int, where: np.ndarray, half: np.ndarray, height: float
) -> dict[str, Any]:
    """A crate, an open crate's worth of shelf, a column or a ball, standing on the floor."""
    color, kind = plain(rng.uniform(0.15, 0.9, 3)), rng.choice(["box", "box", "cylinder", "sphere"])
    entry: dict[str, Any] = {"name": f"{kind}_{number}", "color": color}
    if kind == "box":
        entry |= {
            "box": {"size_m": plain([*(2 * half / np.sqrt(2)), height])},
            "rpy_deg": plain([0, 0, rng.uniform(0, 180)]),
        }
    elif kind == "cylinder":
        entry |= {"cylinder": {"radius_m": round(float(half.min()), 3), "length_m": round(height, 3)}}
    else:
        height = 2.0 * float(half.min())
        entry |= {"sphere": {"radius_m": round(float(half.min()), 3)}}
    return entry | {"position_m": plain([*where, height / 2.0])}
