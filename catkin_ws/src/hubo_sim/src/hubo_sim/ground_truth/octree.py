"""Voxels as an OctoMap binary tree (.bt), as octovis and octomap_server read it; format after OcTree::writeBinary."""

from __future__ import annotations

import numpy as np

_DEPTH = 16
_CENTRE_KEY = 1 << (_DEPTH - 1)
# Two bits a child, in the order of OctoMap's bit set: the first bit is the lower one.
_FREE, _OCCUPIED, _INNER = 0b01, 0b10, 0b11


def octree_bytes(occupied: np.ndarray, free: np.ndarray, resolution_m: float) -> bytes:
    """A .bt file with a leaf for each voxel centre (N, 3) and (M, 3) [m]; a voxel in both is occupied.

    Raises ValueError for centres outside of what 16 levels hold.
    """
    data, size = octree_data(occupied, free, resolution_m)
    head = f"# Octomap OcTree binary file\nid OcTree\nsize {size}\nres {resolution_m:g}\ndata\n"
    return head.encode() + data


def octree_data(occupied: np.ndarray, free: np.ndarray, resolution_m: float) -> tuple[bytes, int]:
    """The nodes of `octree_bytes` without its header, as octomap_msgs/Octomap has them, and their number."""
    points = np.concatenate(
        [np.asarray(free, float).reshape(-1, 3), np.asarray(occupied, float).reshape(-1, 3)]
    )
    keys = np.floor(points / resolution_m).astype(np.int64) + _CENTRE_KEY
    if keys.size and (keys.min() < 0 or keys.max() >= 2 * _CENTRE_KEY):
        raise ValueError(
            f"voxels beyond {_CENTRE_KEY * resolution_m} m do not fit into an octree of {_DEPTH} levels"
        )
    flags = np.repeat([_FREE, _OCCUPIED], [len(free), len(occupied)])
    path = _paths(keys)
    order = np.lexsort((flags, path))
    path, flags = path[order], flags[order]
    last = np.append(path[1:] != path[:-1], True) if len(path) else np.zeros(0, bool)  # occupied comes last
    data, inner = _levels(path[last], flags[last])
    return data, int(last.sum()) + inner


def _paths(keys: np.ndarray) -> np.ndarray:
    """(N,) numbers whose octal digits are the child numbers (x + 2 y + 4 z) from the root down to keys (N, 3)."""
    out = np.zeros(len(keys), np.int64)
    for level in range(_DEPTH - 1, -1, -1):
        bits = (keys >> level) & 1
        out = 8 * out + bits[:, 0] + 2 * bits[:, 1] + 4 * bits[:, 2]
    return out


def _levels(path: np.ndarray, flags: np.ndarray) -> tuple[bytes, int]:
    """The nodes depth first, two bytes an inner node, and how many inner nodes there are."""
    pieces: list[bytes] = []

    def write(first: int, last: int, level: int) -> None:
        child = (path[first:last] >> (3 * level)) & 7
        starts = np.searchsorted(child, np.arange(9)) + first
        filled = [i for i in range(8) if starts[i + 1] > starts[i]]
        code = sum((int(flags[starts[i]]) if level == 0 else _INNER) << (2 * i) for i in filled)
        pieces.append(code.to_bytes(2, "little"))
        if level > 0:
            for i in filled:
                write(starts[i], starts[i + 1], level - 1)

    if len(path):
        write(0, len(path), _DEPTH - 1)
    return b"".join(pieces), len(pieces)
