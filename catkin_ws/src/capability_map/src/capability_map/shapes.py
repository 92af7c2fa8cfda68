"""Shapes that stand for reachability spheres (thesis 3.2, step 2), fitted in the C++ core."""

from __future__ import annotations

import numpy as np

from capability_map._core import fit_shapes

TYPE_NAMES = ("empty", "cone", "double cone", "ring")
RULES = ("cover_all", "least_error")  # the thesis's opening angle, and the one of least shape fit error


def fit_all(outward: np.ndarray, valid: np.ndarray) -> dict[str, np.ndarray]:
    """Fit every sphere by both rules.

    :param outward: (N, 3) n-vectors. :param valid: (S, N) bool.
    :return: `<rule>_type` (S,) uint8, `<rule>_axis` (S, 3), `<rule>_opening_rad` (S,), `<rule>_error_percent` (S,).
    """
    fitted = {}
    for rule in RULES:
        shapes = fit_shapes(outward, valid, rule == "least_error")
        fitted.update({f"{rule}_{name}": values for name, values in shapes.items()})
    return fitted


def covered(shapes: dict[str, np.ndarray], rule: str, rows: np.ndarray, n_vectors: np.ndarray) -> np.ndarray:
    """Return (M,) bool: does the shape of sphere rows[i] cover n_vectors[i]?

    :param rows: (M,) sphere rows, -1 for an empty sphere. :param n_vectors: (M, 3) unit vectors, outward.
    """
    if len(shapes[f"{rule}_type"]) == 0:
        return np.zeros(len(rows), bool)
    axis = shapes[f"{rule}_axis"][rows]
    angle = np.arccos(np.clip(np.einsum("ij,ij->i", axis, n_vectors), -1.0, 1.0))
    folded = np.minimum(angle, np.pi - angle)
    opening, kind = shapes[f"{rule}_opening_rad"][rows], shapes[f"{rule}_type"][rows]
    answer = np.select(
        [kind == 1, kind == 2, kind == 3], [angle <= opening, folded <= opening, folded >= opening]
    )
    return answer.astype(bool) & (rows >= 0)


def report(shapes: dict[str, np.ndarray]) -> str:
    """Return how many spheres got which type and the distribution of the shape fit error, for both rules."""
    lines = []
    for rule in RULES:
        kinds, errors = shapes[f"{rule}_type"], shapes[f"{rule}_error_percent"]
        counts = ", ".join(f"{(kinds == k).sum()} {TYPE_NAMES[k]}" for k in (1, 2, 3))
        spread = "/".join(f"{q:.0f}" for q in np.percentile(errors, (10, 50, 90))) if len(errors) else "-"
        mean = errors.mean() if len(errors) else 0.0
        lines.append(f"shapes, {rule}: {counts}; SFE mean {mean:.1f} %, 10/50/90th percentile {spread} %")
    return "\n".join(lines)
