"""What readers of recordings share."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


class RecordingError(ValueError):
    """A recorded file cannot be used; the text names the file and what would be valid."""


def matrix_from_quaternion(translation: ArrayLike, quaternion_xyzw: ArrayLike) -> NDArray[np.float64]:
    """(4, 4) transform of a translation (3,) [m] and a quaternion x, y, z, w of any length but 0."""
    q = np.asarray(quaternion_xyzw, dtype=float)
    norm = np.linalg.norm(q)
    if not np.isfinite(norm) or norm < 1e-9:
        raise RecordingError(f"quaternion is {q.tolist()}; valid: finite, not 0")
    x, y, z, w = q / norm
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, 3] = translation
    return matrix
