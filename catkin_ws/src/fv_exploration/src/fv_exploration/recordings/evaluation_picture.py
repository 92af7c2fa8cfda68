"""Pictures of an evaluation: slices and projections along the three axes, drawn by matplotlib without a display."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

COLORS = {
    "unknown": (255, 255, 255),
    "free": (214, 232, 250),
    "frontier": (30, 120, 220),
    "void": (250, 190, 20),
    "occupied": (60, 60, 60),
}
"""Later ones are drawn over earlier ones."""


def draw_evaluation(
    occupancy_map: Any, evaluation: Any, views: list[dict[str, Any]], T_map_sensor: NDArray, path: str
) -> None:
    """Write a PNG of six panels: above, slices through the middle of the voids; below, everything projected.

    :param views: dictionaries with ``position_m`` and ``direction``, drawn as red arrows in the projections.
    :param T_map_sensor: (4, 4) of the last scan, drawn as a green dot.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    layers, low = _layers(occupancy_map, evaluation)
    resolution = occupancy_map.resolution_m
    anchor = _anchor(evaluation, layers, low, resolution)
    figure = Figure(figsize=(18, 11), layout="constrained")
    FigureCanvasAgg(figure)
    for axis in range(3):
        across, up = [k for k in range(3) if k != axis]
        shape = np.max([cells.max(axis=0) for cells in layers.values() if len(cells)], axis=0) + 1
        edges = [(low[k], low[k] + shape[k] * resolution) for k in (across, up)]
        for row, only in enumerate((anchor[axis], None)):
            panel = figure.add_subplot(2, 3, 1 + axis + 3 * row)
            image = _image(layers, axis, shape, only)
            panel.imshow(image, origin="lower", extent=(*edges[0], *edges[1]), interpolation="nearest")
            where = f"slice at {'xyz'[axis]} = {low[axis] + (anchor[axis] + 0.5) * resolution:.2f} m"
            panel.set_title(where if row == 0 else f"all along {'xyz'[axis]}")
            panel.set_xlabel(f"{'xyz'[across]} [m]")
            panel.set_ylabel(f"{'xyz'[up]} [m]")
        panel.plot(T_map_sensor[across, 3], T_map_sensor[up, 3], "o", color="#00a040", markersize=10)
        for view in views:
            p, d = np.array(view["position_m"]), np.array(view["direction"]) * 6 * resolution
            panel.annotate(
                "", (p + d)[[across, up]], p[[across, up]], arrowprops={"color": "#d01010", "width": 1}
            )
        panel.set_xlim(edges[0])
        panel.set_ylim(edges[1])
    _add_legend(figure)
    figure.savefig(path, dpi=70)


def _add_legend(figure: Any) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles = [
        Patch(facecolor=np.array(color) / 255, edgecolor="black", label=name)
        for name, color in COLORS.items()
    ]
    handles.append(Line2D([], [], color="#d01010", marker=">", label="best views"))
    handles.append(Line2D([], [], color="#00a040", marker="o", linestyle="none", label="sensor"))
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles), fontsize=14)


def _layers(occupancy_map: Any, evaluation: Any) -> tuple[dict[str, NDArray], NDArray]:
    """Cells (N, 3) of each layer, counted from the lowest corner, and that corner [m]."""
    points = {
        "free": occupancy_map.voxels("free"),
        "frontier": evaluation.frontier,
        "void": evaluation.void,
        "occupied": occupancy_map.voxels("occupied"),
    }
    resolution = occupancy_map.resolution_m
    every = np.concatenate(list(points.values()))
    low = every.min(axis=0) - resolution / 2 if len(every) else np.zeros(3)
    return {name: np.floor((p - low) / resolution).astype(int) for name, p in points.items()}, low


def _anchor(evaluation: Any, layers: dict[str, NDArray], low: NDArray, resolution: float) -> NDArray:
    """Where to cut: the centre of the largest void, or the middle of the map."""
    if len(evaluation.ellipsoids):
        return np.floor((evaluation.ellipsoids[0]["center"] - low) / resolution).astype(int)
    return np.median(np.concatenate(list(layers.values())), axis=0).astype(int)


def _image(layers: dict[str, NDArray], axis: int, shape: NDArray, only: int | None) -> NDArray[np.uint8]:
    across, up = [k for k in range(3) if k != axis]
    image = np.empty((shape[up], shape[across], 3), dtype=np.uint8)
    image[:] = COLORS["unknown"]
    for name, cells in layers.items():
        chosen = cells if only is None else cells[cells[:, axis] == only]
        image[chosen[:, up], chosen[:, across]] = COLORS[name]
    return image
