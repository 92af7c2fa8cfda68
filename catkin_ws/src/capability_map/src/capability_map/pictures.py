"""Off-screen pictures of a map: spikes (figures 3.3, 5.6), index in cuts (3.4), shapes (3.5)."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # no display needed

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from capability_map import geometry
from capability_map.capability_map import CapabilityMap

_DPI = 150


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
    figure, axes = _space(cap, f"{cap.data.robot}/{cap.data.group}: valid points of two rows of spheres")
    rows = _two_rows(cap)
    lines, owners = geometry.spikes(cap, rows)
    colors = geometry.index_colors(cap.index())
    axes.add_collection3d(Line3DCollection(lines.reshape(-1, 2, 3), colors=colors[owners], linewidths=0.5))
    _frame(axes, cap.centres[rows], cap.radius)
    return figure


def draw_index(cap: CapabilityMap) -> plt.Figure:
    """Reachability index in the layers across y and across z through the shoulder."""
    figure, both = plt.subplots(1, 2, figsize=(11, 5))
    figure.suptitle(f"{cap.data.robot}/{cap.data.group}: reachability index D [%]")
    index = cap.index()
    for axes, (across, right, up) in zip(both, ((1, 0, 2), (2, 0, 1)), strict=True):
        rows = geometry.cut_rows(cap, across)
        centers = cap.centres[rows]
        dots = axes.scatter(
            centers[:, right], centers[:, up], c=index[rows], s=12000 * cap.radius / cap.data.arm_length_m / 4,
            cmap="jet_r", vmin=0.0, vmax=max(1.0, float(index.max(initial=0.0))),
        )  # fmt: skip
        axes.set(xlabel=f"{'xyz'[right]} [m]", ylabel=f"{'xyz'[up]} [m]", aspect="equal")
        axes.plot(*cap.data.reach_center_m[[right, up]], "k+")
        figure.colorbar(dots, ax=axes, shrink=0.8)
    return figure


def draw_shapes(cap: CapabilityMap) -> plt.Figure:
    """Shapes fitted to two rows of spheres, by both rules for the opening angle."""
    figure = plt.figure(figsize=(12, 6))
    rows = _two_rows(cap)
    colors = geometry.index_colors(cap.index(), 0.5)
    for place, (rule, title) in enumerate(
        (("cover_all", "covering all points"), ("least_error", "of least error"))
    ):
        axes = figure.add_subplot(1, 2, place + 1, projection="3d", title=f"opening angle {title}")
        triangles, owners = geometry.shape_triangles(cap, rows, rule)
        axes.add_collection3d(Poly3DCollection(triangles.reshape(-1, 3, 3), facecolors=colors[owners]))
        _frame(axes, cap.centres[rows], cap.radius)
    return figure


def _two_rows(cap: CapabilityMap) -> np.ndarray:
    """Spheres along x through the shoulder's layers, at shoulder height and a quarter arm length below."""
    layer = geometry.cut_rows(cap, 1)
    heights = cap.data.reach_center_m[2] - np.array([0.0, 0.25 * cap.data.arm_length_m])
    near = [np.abs(cap.centres[layer, 2] - height) <= cap.radius * (1.0 + 1e-9) for height in heights]
    return layer[near[0] | near[1]]


def _space(cap: CapabilityMap, title: str):
    figure = plt.figure(figsize=(8, 7))
    return figure, figure.add_subplot(projection="3d", title=title)


def _frame(axes, centers: np.ndarray, radius: float) -> None:
    if len(centers) == 0:
        return
    low, high = centers.min(axis=0) - radius, centers.max(axis=0) + radius
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    axes.set_box_aspect(high - low, zoom=1.1)
    for axis, length in zip((axes.xaxis, axes.yaxis, axes.zaxis), high - low, strict=True):
        axis.set_major_locator(
            MaxNLocator(1 + int(6.0 * length / (high - low).max()))
        )  # a short axis has few ticks
    axes.view_init(elev=12.0, azim=-78.0)  # nearly across the rows, so that they do not hide each other
