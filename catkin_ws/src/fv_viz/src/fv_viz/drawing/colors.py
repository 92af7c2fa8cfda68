"""Colours of the house: one place says what each class looks like, and every scale stays readable without hue.

Colours are RGB in 0..1, arrays float32. Categorical colours follow Okabe and Ito's set for colour-blind readers; the
scales change monotonically in lightness, so that grey-scale print keeps their order.
"""

from __future__ import annotations

import numpy as np

# name -> (RGB 0..255, what the legend says)
CLASSES: dict[str, tuple[tuple[int, int, int], str]] = {
    "free": ((120, 190, 230), "free space (seen, empty)"),
    "unknown": ((110, 110, 120), "unknown space"),
    "frontier": ((213, 60, 40), "frontier: free beside unknown"),
    "void": ((230, 159, 0), "void: unknown inside the hull"),
    "initial_ellipsoids": ((150, 120, 190), "void ellipsoids before merging"),
    "ellipsoids": ((120, 60, 160), "void clusters as ellipsoids"),
    "views": ((0, 90, 200), "candidate views (numbers: rank, score)"),
    "chosen_view": ((200, 0, 120), "the view that is taken next"),
    "path": ((200, 0, 120), "path of the camera"),
    "start": ((90, 180, 60), "robot at the start of the path"),
    "goal": ((235, 120, 0), "robot at the goal of the path"),
    "bounds": ((30, 30, 30), "exploration volume"),
    "clearance": ((0, 158, 115), "space vouched for by the operator"),
    "removed": ((90, 50, 20), "points on the robot itself, not mapped"),
    "contacts": ((255, 0, 0), "contact"),
}

# Anchors over 0..1, RGB 0..255. "utility" runs from green to red as in the thesis (5.7), light to dark.
SCALES: dict[str, tuple[tuple[int, int, int], ...]] = {
    "viridis": (
        (68, 1, 84),
        (70, 50, 127),
        (54, 92, 141),
        (39, 127, 142),
        (31, 161, 135),
        (74, 194, 109),
        (159, 218, 58),
        (253, 231, 37),
    ),
    "green_red": ((190, 245, 165), (210, 205, 80), (236, 150, 45), (205, 75, 30), (130, 5, 20)),
    "height": (
        (28, 38, 84),
        (45, 88, 138),
        (80, 135, 160),
        (140, 178, 170),
        (205, 208, 170),
        (245, 235, 205),
    ),
    "grey": ((40, 40, 40), (230, 230, 230)),
}


def rgb(name: str) -> np.ndarray:
    """Colour (3,) of a class.

    Raises KeyError that lists the valid names.
    """
    if name not in CLASSES:
        raise KeyError(f"no colour for class {name!r}; known: {', '.join(CLASSES)}")
    return np.asarray(CLASSES[name][0], dtype=np.float32) / 255.0


def scale(name: str, values: np.ndarray) -> np.ndarray:
    """Colours (N, 3) of values (N,) in 0..1; values outside are clipped, NaN counts as 0.

    Raises KeyError that lists the valid scales.
    """
    if name not in SCALES:
        raise KeyError(f"no colour scale {name!r}; known: {', '.join(SCALES)}")
    anchors = np.asarray(SCALES[name], dtype=np.float64) / 255.0
    at = np.clip(np.nan_to_num(np.asarray(values, dtype=np.float64)), 0.0, 1.0) * (len(anchors) - 1)
    steps = np.arange(len(anchors))
    return np.stack([np.interp(at, steps, anchors[:, k]) for k in range(3)], axis=-1).astype(np.float32)


def distinct(count: int) -> np.ndarray:
    """Colours (count, 3) for labels: neighbours in number differ in hue and lightness; the first look best."""
    turn = (np.arange(count) * 0.61803398875 + 0.02) % 1.0  # golden ratio: never the same hue soon again
    value = np.array([0.95, 0.7, 0.85])[np.arange(count) % 3]
    saturation = np.array([0.75, 0.85, 0.5, 0.65])[np.arange(count) % 4]
    return hsv_to_rgb(turn, saturation, value)


def hsv_to_rgb(hue: np.ndarray, saturation: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Vectorised HSV (each (N,), 0..1) to RGB (N, 3)."""
    offset = np.array([5.0, 3.0, 1.0])
    k = (offset[None, :] + hue[:, None] * 6.0) % 6.0
    ramp = np.clip(np.minimum(k, 4.0 - k), 0.0, 1.0)
    return (value[:, None] * (1.0 - saturation[:, None] * ramp)).astype(np.float32)
