"""Figures of scans: the map, frontiers, voids, frontier-voids and utility. Numbers are those of the thesis."""

from __future__ import annotations

import numpy as np
from fv_msgs.msg import Evaluation

from fv_figures.compose import SLICE, Figure, slice_picture
from fv_figures.material import Material, lines
from fv_figures.stage import FRAME
from fv_viz.config import VizConfig
from fv_viz.drawing import colors, layers, legend, packing, shapes
from fv_viz.drawing.evaluation import GREY, triples

ONE = (-2.5, 0.6)  # yaw, pitch [rad]: from behind the camera, to its right
OTHER = (2.5, 0.45)  # to its left
LEAVES = 4  # sizes of octree leaves told apart


def figure_2_2(m: Material) -> Figure:
    """A slice of the map."""
    msg, low = m.scans.several, m.scans.bounds[0]
    size = msg.resolution
    counts = np.rint((m.scans.bounds[1] - low) / size).astype(int)
    states = np.zeros(counts[:2], dtype=np.uint8)
    level = np.rint((np.median(triples(msg.occupied)[:, 2]) - low[2]) / size - 0.5)
    for value, name in enumerate(("free", "occupied", "frontier"), 1):
        index = np.rint((triples(getattr(msg, name)) - low) / size - 0.5).astype(int)
        index = index[(index[:, 2] == level) & ((index >= 0) & (index < counts)).all(axis=1)]
        states[index[:, 0], index[:, 1]] = value
    seen = np.argwhere(states)
    first, last = np.maximum(seen.min(axis=0) - 3, 0), seen.max(axis=0) + 4
    words = f"one level of the map, {low[2] + (level + 0.5) * size:.2f} m above the floor"
    shows = "walls black, explored free space grey, frontiers red, unknown space white, in one level of the 3D map"
    key = [
        legend.Entry("fill", SLICE[[k]] / 255.0, name)
        for k, name in ((2, "wall"), (1, "free"), (3, "frontier"))
    ]
    panel = slice_picture(states[first[0] : last[0], first[1] : last[1]])
    return Figure([(words, panel)], shows, m.scans.made_by, key, {"red": 0.01, "grey": 0.1})


def figure_3_1(m: Material) -> Figure:
    """Cloud, occupied, free, all."""
    scans, eye = m.scans, m.at_scan(*ONE)
    m.show(scans.first)
    m.stage.cloud(packing.cloud(FRAME, scans.cloud, scans.cloud_colors))
    views = (
        ("point cloud of the first scan", ["Cloud"]),
        ("its occupied voxels", ["Occupied by height"]),
        ("free voxels", ["Free"]),
        ("occupied and free voxels", ["Occupied by height", "Free"]),
    )
    shows = (
        "the first scan of the scene, and the occupied and free voxels that come of it; the rest is unknown"
    )
    panels = [(words, m.stage.take(show, eye)) for words, show in views]
    return Figure(panels, shows, scans.made_by, lines("occupied", "free"), {"blue": 0.05})


def figure_3_2(m: Material) -> Figure:
    """Ellipsoids before and after merging."""
    m.show(m.scans.first)
    eye = m.at_scan(*ONE)
    panels = [
        ("initial ellipsoids, built from random samples", m.stage.take(["Void", "Initial ellipsoids"], eye)),
        ("what merging leaves", m.stage.take(["Void", "Void ellipsoids"], eye)),
    ]
    shows = f"void ellipsoids before ({len(m.scans.first.initial_ellipsoids)}) and after merging"
    shows += f" ({len(m.scans.first.ellipsoids)}); dots are centres of void voxels"
    key = lines("void", "initial_ellipsoids", "ellipsoids")
    return Figure(panels, shows, m.scans.made_by, key, {"purple": 0.01})


def figure_3_6(m: Material) -> Figure:
    """The octree at several depths."""
    msg, panels = m.scans.first, []
    occupied = triples(msg.occupied)
    eye = m.look(np.concatenate([occupied - 0.2, occupied + 0.2, triples(msg.frontier)]), *ONE)
    for up in (0, 1, 2):
        size = msg.resolution * 2**up
        coarse = np.unique(np.floor(occupied / size).astype(int), axis=0)
        part = Evaluation(header=FRAME, resolution=size)
        part.occupied = ((coarse + 0.5) * size).astype(np.float32).ravel()
        m.show(part)
        words = f"depth {16 - up}: {100 * size:g} cm, {len(coarse)} occupied nodes"
        panels.append((words, m.stage.take(["Occupied by height"], eye)))
    m.show(msg)
    counts, drawn = _leaves(msg)
    m.stage.draw(drawn)
    words = f"inner structure: {sum(counts)} leaves hold {len(triples(msg.free))} free voxels"
    panels.append((words, m.stage.take(["Drawing", "Occupied by height"], eye)))
    shows = "the map's octree: occupied nodes at three depths (occupied when a child is), and leaves of free space"
    tones = _leaf_colors()
    key = lines("occupied") + [
        legend.Entry("frame", tones[[k]], f"free leaf of {100 * msg.resolution * 2**k:g} cm")
        for k in range(LEAVES)
    ]
    return Figure(panels, shows, m.scans.made_by, key, {"blue": 0.02})


def figure_5_1(m: Material) -> Figure:
    """Frontiers from six sides."""
    m.show(m.scans.first)
    sides = (
        ("from behind, left", *OTHER, None),
        ("from behind, right", *ONE, None),
        ("from the right", -1.57, 0.2, None),
        ("from the left", 1.57, 0.2, None),
        ("from above", 3.1416, 1.55, None),
        ("from behind, cut open: hollow", 3.1416, 0.2, 0.0),
    )
    shown = ["Frontier", "Occupied by height"]
    panels = [
        (words, m.stage.take(shown, m.at_scan(yaw, pitch, cut=cut))) for words, yaw, pitch, cut in sides
    ]
    shows = "frontier voxels (red) of the first scan, before clustering; the set is hollow"
    return Figure(panels, shows, m.scans.made_by, lines("occupied", "frontier"), {"red": 0.1, "blue": 0.01})


def figure_5_2(m: Material) -> Figure:
    """The map by height."""
    m.show(m.scans.several)
    panel = m.stage.take(["Occupied by height"], m.at_scan(*ONE, several=True))
    shows = f"the map after {m.scans.count} scans by the depth camera, coloured by height"
    words = f"{len(triples(m.scans.several.occupied))} occupied voxels by height"
    return Figure([(words, panel)], shows, m.scans.made_by, lines("occupied"), {"blue": 0.03})


def figure_5_3(m: Material) -> Figure:
    """Voids and ellipsoids from four sides."""
    m.show(m.scans.first)
    common = ["Occupied by height", "Void"]
    plan = (
        ("void voxels", [], ONE),
        ("initial ellipsoids", ["Initial ellipsoids"], OTHER),
        ("void clusters", ["Void ellipsoids"], ONE),
        ("void clusters, view of (b)", ["Void ellipsoids"], OTHER),
    )
    panels = [(words, m.stage.take([*common, *more], m.at_scan(*eye))) for words, more, eye in plan]
    shows = "void voxels as dots, initial ellipsoids, and the void clusters that merging leaves, of the first scan"
    key = lines("occupied", "void", "initial_ellipsoids", "ellipsoids")
    return Figure(panels, shows, m.scans.made_by, key, {"purple": 0.002, "blue": 0.05})


def figure_5_4(m: Material) -> Figure:
    """Frontier clusters, the four largest alone."""
    msg, panels = m.scans.first, []
    clusters = np.asarray(msg.frontier_cluster)
    labels, counts = np.unique(clusters, return_counts=True)
    for label in labels[np.argsort(-counts)][:4]:
        mask = clusters == label
        part = Evaluation(header=FRAME, resolution=msg.resolution, void=msg.void)
        part.frontier, part.frontier_cluster = triples(msg.frontier)[mask].ravel(), clusters[mask]
        m.show(part)
        panels.append(
            (f"{mask.sum()} voxels", m.stage.take(["Frontier clusters", "Void"], m.at_scan(*OTHER)))
        )
    shows = f"the {len(panels)} largest of {len(labels)} frontier clusters of the first scan; dots are void voxels"
    return Figure(panels, shows, m.scans.made_by, lines("frontier_clusters", "void"), {"orange": 0.001})


def figure_5_5(m: Material) -> Figure:
    """Frontier-voids, the two largest alone."""
    msg, panels = m.scans.first, []
    order = sorted(msg.frontier_voids, key=lambda one: -msg.ellipsoids[one.ellipsoid].voxel_count)
    for one in [fv for fv in order if len(fv.frontier_clusters)][:2]:
        part = Evaluation(header=FRAME, resolution=msg.resolution, ellipsoids=msg.ellipsoids)
        part.void, part.void_ellipsoid, part.occupied = msg.void, msg.void_ellipsoid, msg.occupied
        part.frontier, part.frontier_cluster = msg.frontier, msg.frontier_cluster
        part.frontier_voids = [one]
        m.show(part)
        count = len(one.frontier_clusters)
        clusters = f"{count} frontier cluster{'' if count == 1 else 's'}"
        words = f"void of {msg.ellipsoids[one.ellipsoid].voxel_count} voxels beside {clusters}"
        panels.append((words, m.stage.take(["Frontier-voids", "Occupied by height"], m.at_scan(*ONE))))
    shows = (
        "the two largest frontier-voids of the first scan: a void (translucent) with the frontiers beside it"
    )
    return Figure(panels, shows, m.scans.made_by, lines("frontier_voids", "occupied"), {"blue": 0.004})


def figure_5_7(m: Material) -> Figure:
    """Utility."""
    msg = m.scans.first
    m.show(msg)
    m.stage.draw(_grey_frontiers(msg))
    eye = m.at_scan(*ONE)
    panels = [
        ("utility of free voxels, and occupied voxels", m.stage.take(["Utility", "Occupied by height"], eye)),
        ("with the frontier-voids, frontiers grey", m.stage.take(["Utility", "Drawing", "Void"], eye)),
    ]
    shows = "utility of free voxels of the first scan, light green (low) to opaque red (high)"
    key = [
        *lines("utility", "occupied", "void"),
        legend.Entry("fill", GREY[None], "frontiers of frontier-voids"),
    ]
    return Figure(panels, shows, m.scans.made_by, key, {"orange": 0.001})


def _grey_frontiers(msg: Evaluation) -> list[bytes]:
    """The frontier voxels that belong to a frontier-void, in grey."""
    wanted = [cluster for one in msg.frontier_voids for cluster in one.frontier_clusters]
    mask = np.isin(np.asarray(msg.frontier_cluster), wanted)
    layer = layers.VoxelLayer("grey", layers.plain(GREY, 0.35), VizConfig())
    return layer.update(FRAME, msg.resolution, triples(msg.frontier)[mask], full=True)


def _leaf_colors() -> np.ndarray:
    return colors.scale("viridis", np.linspace(0.9, 0.1, LEAVES))


def _leaves(msg: Evaluation) -> tuple[list[int], list[bytes]]:
    """Counts and boxes of the leaves that free voxels make when eight equal children become one, up to 3 levels."""
    index = np.floor(triples(msg.free) / msg.resolution).astype(int)
    counts, drawn, tones = [], [], _leaf_colors()
    for up in range(LEAVES):
        parents, owner, sizes = np.unique(index // 2, axis=0, return_inverse=True, return_counts=True)
        whole = (sizes == 8) & (up < LEAVES - 1)
        leaves = index[~whole[owner.ravel()]]
        size = msg.resolution * 2**up
        edges = [shapes.box_edges((leaf + 0.04) * size, (leaf + 0.96) * size) for leaf in leaves]
        counts.append(len(leaves))
        if edges:
            drawn.append(shapes.lines(FRAME, "leaves", np.concatenate(edges), tones[up], 0.003, up))
        index = parents[whole]
    return counts, drawn


FIGURES = {
    name.removeprefix("figure_").replace("_", "."): function
    for name, function in list(globals().items())
    if name.startswith("figure_")
}
