"""Layers made of voxels: what of an Evaluation each shows, in which colours, and which blocks must be sent."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from fv_viz.config import VizConfig
from fv_viz.drawing import colors, packing, shapes
from fv_viz.drawing.voxels import SHADES, Quads, VoxelBlocks

LABELS = 251  # colours of clusters before they repeat; values of a grid are 1..255

Paint = Callable[[Quads], np.ndarray]  # quads -> RGBA (F, 4)


class VoxelLayer:
    """One layer as blocks of coloured faces; remembers the blocks that RViz holds.

    Args:
        namespace: of the markers.
        paint: colours (F, 4) of quads before shading.
        config: block size.
        nested: see VoxelBlocks.
    """

    def __init__(self, namespace: str, paint: Paint, config: VizConfig, nested: bool = False) -> None:
        self.namespace, self._paint, self._nested = namespace, paint, nested
        self._block, self._upright = config.block_voxels, not isinstance(paint, HeightPaint)
        self._blocks: VoxelBlocks | None = None
        self._numbers: dict[tuple[int, int, int], int] = {}

    def update(self, header: Header, resolution: float, centers, values=1, full: bool = False) -> list[bytes]:
        """Markers that bring RViz from the last call's voxels to these.

        full: send every block, after the caller has cleared the display (a new subscriber knows nothing).
        """
        full |= self._begin(resolution)
        dirty = self._blocks.update(centers, values)
        return [self._marker(header, name) for name in (self._blocks.blocks() if full else dirty)]

    def update_dense(
        self, header: Header, resolution: float, first: np.ndarray, values: np.ndarray, full: bool = False
    ) -> list[bytes]:
        """As update, for voxels that come as an array: see VoxelBlocks.update_dense."""
        full |= self._begin(resolution)
        dirty = self._blocks.update_dense(first, values)
        return [self._marker(header, name) for name in (self._blocks.blocks() if full else dirty)]

    def _begin(self, resolution: float) -> bool:
        """Begin anew when the voxels have another size; True when so."""
        if self._blocks is not None and self._blocks.resolution == resolution:
            return False
        self._blocks = VoxelBlocks(resolution, self._block, self._nested, self._upright)
        return True

    def _marker(self, header: Header, name: tuple[int, int, int]) -> bytes:
        number = self._numbers.setdefault(name, len(self._numbers))
        quads = self._blocks.faces(name)
        out = shapes.marker(header, self.namespace, Marker.TRIANGLE_LIST, (1.0, 1.0, 1.0), 1.0, number)
        if not len(quads):
            out.action = Marker.DELETE
            return packing.pack_marker(out)
        rgba = np.array(self._paint(quads), dtype=np.float32)
        rgba[:, :3] *= SHADES[quads.directions, None]
        out.color.a = float(rgba[:, 3].min())  # RViz blends by the alpha of the marker and of its colours
        return packing.pack_marker(out, quads.triangles(), np.repeat(rgba, 2, axis=0))


def plain(color: np.ndarray, alpha: float = 1.0) -> Paint:
    """One colour (3,) for the whole layer."""
    rgba = np.append(color, alpha).astype(np.float32)
    return lambda quads: np.broadcast_to(rgba, (len(quads), 4))


class HeightPaint:
    """Colours by height between `low_m` and `high_m`, which whoever knows the volume may set."""

    def __init__(self, scale: str, low_m: float = 0.0, high_m: float = 2.0) -> None:
        self.scale, self.low_m, self.high_m = scale, low_m, high_m

    def __call__(self, quads: Quads) -> np.ndarray:
        middle = quads.corners[:, :, 2].mean(axis=1)
        share = (middle - self.low_m) / max(self.high_m - self.low_m, 1e-6)
        return np.column_stack([colors.scale(self.scale, share), np.ones(len(quads))])


def labelled(alpha: float = 1.0) -> Paint:
    """Distinct colours by value, see label_values."""
    table = np.column_stack([colors.distinct(LABELS), np.full(LABELS, alpha)]).astype(np.float32)
    return lambda quads: table[(quads.values.astype(np.int64) - 1) % LABELS]


def label_values(labels: np.ndarray) -> np.ndarray:
    """Grid values 1..LABELS (N,) uint8 of labels (N,) of any size."""
    return (np.asarray(labels, dtype=np.int64) % LABELS + 1).astype(np.uint8)


def utility_values(utility: np.ndarray, levels: int, floor: float) -> np.ndarray:
    """Grid values 0..levels (U,) of utilities (U,) [m^3]; 0 where below the floor (share of the largest) or NaN."""
    utility = np.nan_to_num(np.asarray(utility, dtype=np.float64), posinf=0.0, neginf=0.0)
    top = utility.max(initial=0.0)
    if top <= 0.0:
        return np.zeros(len(utility), dtype=np.uint8)
    share = utility / top
    return np.where(share < floor, 0, np.clip(np.ceil(share * levels), 1, levels)).astype(np.uint8)


def utility_paint(scale: str, levels: int) -> Paint:
    """Colour and opacity by level: low ones nearly transparent."""
    share = np.arange(1, levels + 1) / levels
    table = np.column_stack(
        [colors.scale(scale, (share - share[0]) / max(1.0 - share[0], 1e-9)), 0.1 + 0.65 * share]
    )
    return lambda quads: table[quads.values - 1]


def skin(centers: np.ndarray, resolution: float) -> np.ndarray:
    """Those of the voxel centres (N, 3) [m] that have a face which no other of them covers; finite rows only."""
    centers = centers[np.isfinite(centers).all(axis=1)]
    if not len(centers):
        return centers
    index = np.rint(centers / np.float32(resolution) - np.float32(0.5)).astype(np.int64)
    index -= index.min(axis=0) - 1
    grid = np.zeros(index.max(axis=0) + 2, dtype=bool)
    grid[tuple(index.T)] = True
    inner = grid[1:-1, 1:-1, 1:-1].copy()
    inner &= grid[2:, 1:-1, 1:-1] & grid[:-2, 1:-1, 1:-1]
    inner &= grid[1:-1, 2:, 1:-1] & grid[1:-1, :-2, 1:-1]
    inner &= grid[1:-1, 1:-1, 2:] & grid[1:-1, 1:-1, :-2]
    return centers[~inner[tuple((index - 1).T)]]


def unknown_cells(low, high, resolution: float, known: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The voxels inside the box low..high (3,) [m] that are not in known (K, 3): see VoxelBlocks.update_dense."""
    first = np.rint(np.asarray(low)[::-1] / resolution).astype(np.int64)
    counts = np.maximum(np.rint(np.asarray(high)[::-1] / resolution).astype(np.int64) - first, 0)
    cells = np.ones(counts, dtype=np.uint8)
    index = np.rint(np.asarray(known).reshape(-1, 3).T[::-1] / resolution - 0.5).astype(np.int64)
    index -= first[:, None]
    index = index[:, ((index >= 0) & (index < counts[:, None])).all(axis=0)]
    cells[tuple(index)] = 0
    return first, cells
