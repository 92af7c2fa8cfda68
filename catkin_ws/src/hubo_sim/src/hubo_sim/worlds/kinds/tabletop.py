"""tabletop:SEED, a table in front of the robot with things of pybullet_data's random_urdfs on it."""

from __future__ import annotations

from typing import Any

import numpy as np

from hubo_sim.paths import resolve_file
from hubo_sim.worlds.kinds._shared import ROBOT, plain
from hubo_sim.worlds.triangles import mesh_triangles

_THINGS = 1000  # objects in pybullet_data's random_urdfs


def make(rng: np.random.Generator, seed: int) -> dict[str, Any]:
    """The world file's content."""
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
        "robot": ROBOT,
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
        "position_m": plain([where[0], where[1], top_m - lowest]),
        "rpy_deg": plain([0, 0, rng.uniform(0, 360)]),
        "color": plain(rng.uniform(0.2, 0.95, 3)),
    }
