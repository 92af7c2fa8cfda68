"""What the readers of recordings share: their error, their warning, and poses of a position and a quaternion."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fv_common.errors import Notice, UserError
from fv_common.transforms import UNIT_TOLERANCE
from fv_common.transforms import transform as make_transform

Warn = Callable[[str], None]
"""Takes one line that says what was seen and what was done about it."""


class RecordingError(UserError, ValueError):
    """A recorded file cannot be used; the text names the file and what would be valid."""


class RecordingWarning(Notice):
    """Something of a recording was left out or replaced; the text says what."""


def python_warning(text: str) -> None:
    """Warn as Python does, where the caller did not say how."""
    warnings.warn(text, RecordingWarning, stacklevel=3)


def matrix_from_quaternion(translation: ArrayLike, quaternion_xyzw: ArrayLike) -> NDArray[np.float64]:
    """(4, 4) transform of a translation (3,) [m] and a quaternion x, y, z, w of any length but 0."""
    p, q = np.asarray(translation, dtype=float), np.asarray(quaternion_xyzw, dtype=float)
    norm = length(q)
    if not np.isfinite(norm) or norm < 1e-9:
        raise RecordingError(f"quaternion x, y, z, w is {q.tolist()}; valid: finite, not 0")
    if not np.isfinite(p).all():
        raise RecordingError(f"position is {p.tolist()}; valid: finite")
    return make_transform(p, q / norm)


def length(quaternion: Iterable[float]) -> float:
    """Euclidean length; neither overflows nor vanishes on the way."""
    return math.hypot(*quaternion)


def is_unit(quaternion: Iterable[float]) -> bool:
    """Whether a quaternion has length 1, but for rounding."""
    return abs(length(quaternion) - 1) <= UNIT_TOLERANCE


def one_line(error: BaseException) -> str:
    """The text of another's error as one line of bounded length."""
    text = " ".join(str(error).split()) or type(error).__name__
    return text if len(text) <= 300 else text[:297] + "..."
