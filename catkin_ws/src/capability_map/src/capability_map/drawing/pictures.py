"""Off-screen pictures of a map: spikes (figures 3.3, 5.6), index in cuts (3.4), shapes (3.5)."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # no display needed

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection, PatchCollection, PolyCollection
from matplotlib.patches import Circle

from capability_map.capability_map import CapabilityMap
from capability_map.drawing import geometry

_DPI = 150
FROM_DEG = -78.0, 12.0  # azimuth and elevation of the viewer of spikes and shapes


def draw_all(cap: CapabilityMap, folder: Path) -> list[Path]:
    """Write `spikes.png`, `index.png` and `shapes.png` into a folder; return their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    drawn = []
    for name, draw in (("spikes", draw_spikes), ("index", draw_index), ("shapes", draw_shapes)):
        figure = draw(cap)
        path = folder / f"{name}.png"
        figure.savefig(path, dpi=_DPI, bbox_inches="tight")
        plt.close(figure)
        drawn.append(path)
    return drawn


def draw_spikes(cap: CapabilityMap) -> plt.Figure:
    """Two rows of spheres through the shoulder with a line to each valid point, coloured by reachability index."""
    rows = geometry.two_rows(cap)
    lines, owners = geometry.spikes(cap, rows)
    colors = geometry.index_colors(cap.index())
    figure, (axes,) = _panels(cap, rows, ["valid points of two rows of spheres"])
    segments = _projected(lines)[0].reshape(-1, 2, 2)
    axes.add_collection(LineCollection(segments, colors=colors[owners], linewidths=1.0))
    return figure


def draw_index(cap: CapabilityMap) -> plt.Figure:
    """Reachability index in the layers across y and across z through the shoulder."""
    figure, both = plt.subplots(1, 2, figsize=(12, 5.5), layout="constrained")
    figure.suptitle(
        f"{cap.data.robot}/{cap.data.group}: reachability index in two layers through the shoulder (+)"
    )
    index = cap.index()
    colors = geometry.index_colors(index)
    for axes, (across, right, up) in zip(both, ((1, 0, 2), (2, 0, 1)), strict=True):
        rows = geometry.cut_rows(cap, across)
        circles = [Circle(center, 0.9 * cap.radius) for center in cap.centres[rows][:, [right, up]]]
        axes.add_collection(PatchCollection(circles, facecolors=colors[rows]))
        axes.autoscale_view()
        axes.set(xlabel=f"{'xyz'[right]} [m]", ylabel=f"{'xyz'[up]} [m]", aspect="equal")
        axes.plot(*cap.data.reach_center_m[[right, up]], "k+", markersize=10)
    _colorbar(figure, both, index)
    return figure


def draw_shapes(cap: CapabilityMap) -> plt.Figure:
    """Shapes fitted to two rows of spheres, by both rules for the opening angle."""
    rows = geometry.two_rows(cap)
    colors = geometry.index_colors(cap.index(), 0.6)
    rules = {"cover_all": "opening angle covering all points", "least_error": "opening angle of least error"}
    figure, panels = _panels(cap, rows, list(rules.values()))
    for axes, rule in zip(panels, rules, strict=True):
        triangles, owners = geometry.shape_triangles(cap, rows, rule)
        flat, nearness = _projected(triangles)
        order = np.argsort(
            nearness.reshape(-1, 3).mean(axis=1)
        )  # what is nearer is drawn over what is behind it
        pieces = flat.reshape(-1, 3, 2)[order]
        axes.add_collection(PolyCollection(pieces, facecolors=colors[owners[order]], edgecolors="none"))
    return figure


def _projected(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) as seen from far away, nearly across the rows: (N, 2) in the picture, and their nearness (N,)."""
    (cy, sy), (cp, sp) = ((np.cos(angle), np.sin(angle)) for angle in np.radians(FROM_DEG))
    axes = np.array(
        [[-sy, cy, 0.0], [-cy * sp, -sy * sp, cp], [cy * cp, sy * cp, sp]]
    )  # right, up, to the viewer
    seen = points @ axes.T
    return seen[:, :2], seen[:, 2]


def _panels(cap: CapabilityMap, rows: np.ndarray, titles: list[str]) -> tuple[plt.Figure, list[plt.Axes]]:
    """A figure with a panel for each title, one above the other, that the spheres of these rows fill.

    A slanting view has no axes to read: a line shows 10 cm along x.
    """
    size = (12, 1.0 + 3.2 * len(titles))
    figure, panels = plt.subplots(len(titles), 1, figsize=size, layout="constrained", squeeze=False)
    panels = list(panels[:, 0])
    centers = cap.centres[rows] if len(rows) else cap.data.reach_center_m[None]
    low, high = centers.min(axis=0) - cap.radius, centers.max(axis=0) + cap.radius
    corners = _projected(np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T)[0]
    line = _projected(np.array([low, low + 0.1 * np.eye(3)[0]]) - [0.0, 0.0, 0.5 * cap.radius])[0]
    for axes, title in zip(panels, titles, strict=True):
        axes.set_title(f"{cap.data.robot}/{cap.data.group}: {title}")
        axes.set_axis_off()
        axes.set_aspect("equal")
        axes.update_datalim(np.concatenate([corners, line]))
        axes.plot(*line.T, color="black", linewidth=2)
        axes.text(*line[1], " 10 cm along x", va="center")
        axes.autoscale_view()
    _colorbar(figure, panels, cap.index())
    return figure, panels


def _colorbar(figure: plt.Figure, axes, index: np.ndarray) -> None:
    scale = geometry.index_scale(float(index.max(initial=0.0)))
    figure.colorbar(scale, ax=axes, label=geometry.INDEX_LABEL)
