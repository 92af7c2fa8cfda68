"""What the 3D view of the report is given: faces of voxels, camera poses and bounds, as compact JSON."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

from fv_viz.drawing import colors, shapes
from fv_viz.drawing.voxels import VoxelBlocks
from fv_viz.report.run_data import RunData

MAX_FACES = 90_000  # of one class, 1.2 MB of text; what has more is drawn in larger voxels
_LAST = 254  # grid values count down from here: known early is high, so that later voxels do not hide earlier faces

# class -> (opacity, shown at first)
LOOKS = {"occupied": (1.0, True), "frontier": (0.45, False), "void": (0.3, False), "free": (0.12, False)}


def scene(data: RunData) -> dict[str, Any] | None:
    """The scene as JSON values; None when the run left no voxels."""
    if not any(len(points) for points in data.points.values()):
        return None
    every = np.concatenate([points for points in data.points.values() if len(points)])
    low, high = every.min(axis=0), every.max(axis=0)
    layers = [_layer(data, name) for name in LOOKS if len(data.points.get(name, ()))]
    steps = np.linspace(0.0, 1.0, 32)
    return {
        "resolution": data.resolution,
        "low": np.asarray(data.run.get("bounds_min", low), dtype=float).tolist(),
        "high": np.asarray(data.run.get("bounds_max", high), dtype=float).tolist(),
        "heights": np.round(colors.scale("height", steps) * 255).astype(int).tolist(),
        "layers": layers,
        "views": [_camera(T) for T in data.poses],
    }


def _layer(data: RunData, name: str) -> dict[str, Any]:
    points = data.points[name]
    values = (
        _known_since(data, points) if name in ("occupied", "free") else np.full(len(points), _LAST, np.uint8)
    )
    plain = name in colors.CLASSES  # else coloured by height
    size, faces = _few_faces(points, data.resolution, values, plain)
    alpha, shown = LOOKS[name]
    return {
        "name": name,
        "count": len(points),
        "rgb": np.round(colors.rgb(name) * 255).astype(int).tolist() if plain else None,
        "alpha": alpha,
        "shown": shown,
        "size": size,
        "faces": base64.b64encode(faces.tobytes()).decode(),
    }


def _few_faces(
    points: np.ndarray, resolution: float, values: np.ndarray, upright: bool
) -> tuple[float, np.ndarray]:
    """Edge of a voxel [m] and faces; voxels are joined to larger ones, early before late, until they are few enough."""
    size = resolution
    while True:
        faces = encoded_faces(points, size, values, upright)
        if len(faces) <= MAX_FACES:
            return size, faces
        size *= 2.0
        order = np.argsort(
            values, kind="stable"
        )  # of voxels in one place the last counts: that of the highest value
        points, values = (np.floor(points[order] / size) + 0.5) * size, values[order]


FACE = np.dtype([("cell", "<i2", 3), ("direction", "u1"), ("length", "u1"), ("since", "u1"), ("width", "u1")])


def encoded_faces(
    points: np.ndarray, resolution: float, values: np.ndarray, upright: bool = False
) -> np.ndarray:
    """Rectangles of faces (F,) of dtype FACE: lower corner and size in voxels, direction, view of first sight.

    upright: see VoxelBlocks.
    """
    blocks = VoxelBlocks(resolution, block=64, nested=True, upright=upright)
    blocks.update(points, values)
    found = [np.empty(0, FACE)]
    for name in blocks.blocks():
        quads = blocks.faces(name)
        part = np.zeros(len(quads), FACE)
        part["cell"] = np.clip(np.rint(quads.corners.min(axis=1) / resolution), -32768, 32767)
        part["direction"] = quads.directions
        part["length"], part["width"] = quads.sizes.T
        part["since"] = _LAST - quads.values
        found.append(part)
    return np.concatenate(found)


def _known_since(data: RunData, points: np.ndarray) -> np.ndarray:
    """Grid values (N,) of points by the view at which they became known; all known from the start without that file."""
    values = np.full(len(points), _LAST, dtype=np.uint8)
    if not data.since:
        return values
    index = np.rint(points / data.resolution - 0.5).astype(int) - data.since["first_key"]
    inside = ((index >= 0) & (index < data.since["view"].shape)).all(axis=1)
    views = data.since["view"][tuple(index[inside].T)]
    values[inside] = _LAST - np.clip(views, 0, _LAST - 1)
    return values


def _camera(T_map_camera: np.ndarray) -> list[list[float]]:
    """Corners (6, 3) of a pyramid of 12 cm, fields of view as those of a common depth camera."""
    pyramid = shapes.pyramid_points(np.deg2rad(58.0), np.deg2rad(45.0), 0.12)
    return np.round(pyramid @ T_map_camera[:3, :3].T + T_map_camera[:3, 3], 4).tolist()
