"""Drawing of fv_msgs/Evaluation, layer by layer. Each method turns the message into ready markers; no ROS calls."""

from __future__ import annotations

import numpy as np
from std_msgs.msg import Header

from fv_viz.config import VizConfig
from fv_viz.drawing import colors, layers, packing, shapes
from fv_viz.drawing.voxels import HIDDEN

GREY = np.array([0.55, 0.55, 0.55], dtype=np.float32)


def triples(flat) -> np.ndarray:
    """Points (N, 3) of a flat list of 3 N numbers; a list of any other length raises ValueError."""
    values = np.asarray(flat, dtype=np.float32)
    if values.size % 3:
        raise ValueError(f"{values.size} numbers are no list of x y z triples")
    return values.reshape(-1, 3)


class EvaluationDrawing:
    """Keeps what RViz holds of each layer, so that a new evaluation costs only what changed.

    Every public method takes (header, evaluation, full) and returns serialised markers; full repeats everything.
    """

    def __init__(self, config: VizConfig) -> None:
        self._config = config
        self._height = layers.HeightPaint(config.height_scale)
        self._bounds: tuple[np.ndarray, np.ndarray] | None = None
        steps = config.utility_levels
        voxel = layers.VoxelLayer
        self._occupied = voxel("occupied", self._height, config)
        self._roof = voxel("occupied_roof", self._height, config)
        self._free = voxel("free", layers.plain(colors.rgb("free"), config.free_alpha), config)
        self._unknown = voxel("unknown", layers.plain(colors.rgb("unknown"), config.unknown_alpha), config)
        self._frontier = voxel(
            "frontier", layers.plain(colors.rgb("frontier"), config.frontier_alpha), config
        )
        self._clusters = voxel("frontier_clusters", layers.labelled(), config)
        self._set_void = voxel("frontier_void/void", layers.labelled(config.void_alpha), config)
        self._set_frontier = voxel(
            "frontier_void/frontier", layers.labelled(config.beside_void_alpha), config
        )
        self._utility = voxel(
            "utility", layers.utility_paint(config.utility_scale, steps), config, nested=True
        )

    def set_bounds(self, low: np.ndarray, high: np.ndarray) -> None:
        """The exploration volume [m]: what is unknown inside of it, and the range of the height colours."""
        self._bounds = low, high
        self._height.low_m, self._height.high_m = float(low[2]), float(high[2])

    def occupied(self, header: Header, msg, full: bool) -> list[bytes]:
        """Occupied voxels by height; a namespace of its own for the roof, which would hide the room from above."""
        centers = triples(msg.occupied)
        top = np.inf if self._bounds is None else self._bounds[1][2] - self._config.roof_m
        roof = centers[:, 2] > top
        size = msg.resolution
        return self._occupied.update(header, size, centers[~roof], full=full) + self._roof.update(
            header, size, centers[roof], full=full
        )

    def free(self, header: Header, msg, full: bool) -> list[bytes]:
        """Free space as its translucent skin."""
        return self._free.update(header, msg.resolution, triples(msg.free), full=full)

    def unknown(self, header: Header, msg, full: bool) -> list[bytes]:
        """Space of the exploration volume that is neither free nor occupied; nothing while the volume is not known."""
        if self._bounds is None:
            return self._unknown.update(header, msg.resolution, np.empty((0, 3)), full=full)
        known = np.concatenate([triples(msg.free), triples(msg.occupied)])
        cells = layers.unknown_cells(*self._bounds, msg.resolution, known)
        return self._unknown.update_dense(header, msg.resolution, *cells, full)

    def frontier(self, header: Header, msg, full: bool) -> list[bytes]:
        """Frontier voxels in one colour; their faces towards free space are left out, half of all."""
        free, frontier = triples(msg.free), triples(msg.frontier)
        values = np.concatenate([np.full(len(free), HIDDEN, np.uint8), np.ones(len(frontier), np.uint8)])
        return self._frontier.update(header, msg.resolution, np.concatenate([free, frontier]), values, full)

    def frontier_clusters(self, header: Header, msg, full: bool) -> list[bytes]:
        """Frontier voxels, each cluster in its own colour."""
        values = layers.label_values(msg.frontier_cluster)
        return self._clusters.update(header, msg.resolution, triples(msg.frontier), values, full=full)

    def void(self, header: Header, msg, full: bool):
        """Centres of void voxels as a cloud of dots; of very many only the outer ones, which hide the others."""
        centers = triples(msg.void)
        if len(centers) > self._config.max_dots:
            centers = layers.skin(centers, msg.resolution)
        return packing.cloud(header, centers, colors.rgb("void"))

    def initial_ellipsoids(self, header: Header, msg, full: bool) -> list[bytes]:
        """Void ellipsoids before merging."""
        return self._ellipsoids(header, "initial_ellipsoids", msg.initial_ellipsoids)

    def ellipsoids(self, header: Header, msg, full: bool) -> list[bytes]:
        """Void clusters after merging."""
        return self._ellipsoids(header, "ellipsoids", msg.ellipsoids)

    def frontier_voids(self, header: Header, msg, full: bool) -> list[bytes]:
        """Each void cluster and the frontiers at it in one colour; the frontiers, which may surround it, fainter."""
        set_of_ellipsoid = np.zeros(len(msg.ellipsoids) + 1, dtype=np.uint8)
        set_of_cluster: dict[int, int] = {}
        for number, one in enumerate(msg.frontier_voids):
            set_of_ellipsoid[min(one.ellipsoid, len(msg.ellipsoids))] = number % layers.LABELS + 1
            set_of_cluster.update({int(c): number % layers.LABELS + 1 for c in one.frontier_clusters})
        names = np.minimum(np.asarray(msg.void_ellipsoid, dtype=np.int64), len(msg.ellipsoids))
        clusters, inverse = np.unique(np.asarray(msg.frontier_cluster, dtype=np.int64), return_inverse=True)
        table = np.array([set_of_cluster.get(int(c), 0) for c in clusters], dtype=np.uint8)
        void_values, frontier_values = set_of_ellipsoid[names], table[inverse]
        size = msg.resolution
        return self._set_void.update(
            header, size, triples(msg.void), void_values, full
        ) + self._set_frontier.update(header, size, triples(msg.frontier), frontier_values, full)

    def utility(self, header: Header, msg, full: bool) -> list[bytes]:
        """Free voxels by utility as nested translucent shells, the highest most opaque."""
        config = self._config
        values = layers.utility_values(msg.utility, config.utility_levels, config.utility_floor)
        return self._utility.update(header, msg.resolution, triples(msg.utility_points), values, full=full)

    def _ellipsoids(self, header: Header, name: str, ellipsoids) -> list[bytes]:
        out = [shapes.clear(header)]
        for number, one in enumerate(ellipsoids):
            axes = (one.semi_axes.x, one.semi_axes.y, one.semi_axes.z)
            pose = (one.center, one.orientation)
            out.append(
                shapes.ellipsoid(
                    header, name, *pose, axes, colors.rgb(name), self._config.ellipsoid_alpha, number
                )
            )
        return out
