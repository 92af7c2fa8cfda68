"""A run folder as scripts/explore leaves it, made from the synthetic room; for tests of the report."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import viz_synthetic
from PIL import Image as Picture

EYES = [
    (0.2, -0.2, 0.5, 0.1),
    (0.2, 0.5, 0.5, -0.4),
    (0.3, 0.0, 0.3, 0.0),
    (0.1, 0.4, 0.9, 0.5),
    (0.4, -0.6, 0.6, 0.6),
]


def write(folder: Path, seed: int = 1, views: int = 5, resolution: float = 0.1) -> Path:
    """Fill the folder; the same seed gives the same run."""
    rng = np.random.default_rng(seed)
    (folder / "screenshots").mkdir(parents=True)
    since, rows = None, []
    for view in range(1, views + 1):
        room = viz_synthetic.scan(resolution, EYES[: (view - 1) % len(EYES) + 1])
        since = np.full(room.states.shape, -1, np.int16) if since is None else since
        since[(room.states != viz_synthetic.UNKNOWN) & (since < 0)] = view
        rows.append(_row(view, room, rng))
        noise = rng.integers(0, 255, (96, 128, 3), dtype=np.uint8)
        Picture.fromarray(noise).resize((1280, 960)).save(folder / "screenshots" / f"view_{view:03d}.png")
    _write_rows(folder / "metrics.csv", rows)
    _write_map(folder, room, since)
    _write_run(folder, rows, seed)
    return folder


def _row(view: int, room: viz_synthetic.Room, rng: np.random.Generator) -> dict[str, float]:
    known = float((room.states != viz_synthetic.UNKNOWN).mean())
    row = {
        "view": view,
        "sim_s": 7.0 * view,
        "wall_s": 9.0 * view,
        "known_share": known,
        "explored_share": 1.8 * known,
    }
    steps = ("scan", "integrate", "evaluate", "choose", "plan", "move", "screenshot")
    row.update({f"{name}_s": float(rng.uniform(0.1, 2.0)) for name in steps})
    row.update(
        occupied=int((room.states == 2).sum()), free=int((room.states == 1).sum()), frontier=300 - 9 * view
    )
    row.update(expected_gain_m3=0.5 / view, real_gain_m3=0.4 / view, path_length_rad=1.2, contacts=0)
    return row


def _write_rows(path: Path, rows: list[dict[str, float]]) -> None:
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def _write_map(folder: Path, room: viz_synthetic.Room, since: np.ndarray) -> None:
    msg = viz_synthetic.evaluation(room)
    points = {
        name: np.reshape(getattr(msg, name), (-1, 3)) for name in ("free", "occupied", "frontier", "void")
    }
    np.savez_compressed(folder / "map_points.npz", resolution=room.resolution, **points)
    first = np.rint(viz_synthetic.LOW / room.resolution).astype(int)
    np.savez_compressed(folder / "known_since.npz", first_key=first, resolution=room.resolution, view=since)
    poses = []
    for x, y, z, yaw in EYES:
        T = np.eye(4)
        c, s = np.cos(yaw), np.sin(yaw)
        T[:3, :3], T[:3, 3] = [[s, 0, c], [-c, 0, s], [0, -1, 0]], (x, y, z)
        poses.append({"view": len(poses) + 1, "pose": T.tolist()})
    (folder / "views.json").write_text(json.dumps(poses))


def _write_run(folder: Path, rows: list[dict[str, float]], seed: int) -> None:
    last = rows[-1]
    run = {
        "world": "synthetic",
        "robot": "arm",
        "seed": seed,
        "result": "COMPLETE",
        "reason": "no view is worth it",
    }
    run.update(views=len(rows), explored_share=last["explored_share"], contacts=0, wall_s=45.0, sim_s=35.0)
    run.update(
        resolution_m=0.1, bounds_min=viz_synthetic.LOW.tolist(), bounds_max=viz_synthetic.HIGH.tolist()
    )
    run.update(
        config={"map": {"resolution_m": 0.1}},
        versions={"workspace": "test"},
        truth={"false_free_share": 0.0004},
    )
    (folder / "run.json").write_text(json.dumps(run))
