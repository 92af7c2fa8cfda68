"""How true is a map? Its answers against fresh inverse kinematics at random views."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from capability_map import shapes
from capability_map._core import ViewProbe
from capability_map.building.plan import probe_options
from capability_map.capability_map import CapabilityMap
from capability_map.errors import CapabilityMapError
from capability_map.parameters import BuildParameters
from capability_map.robots import Arm


@dataclasses.dataclass(frozen=True)
class Accuracy:
    """Agreement with the truth; shares in 0..1."""

    method: str
    accuracy: float  # right answers of all
    found: float  # of the views that can be held
    false_positives: float  # of the views that cannot be held


def score(method: str, answer: np.ndarray, truth: np.ndarray) -> Accuracy:
    """Compare (N,) bool answers with the truth."""
    held, not_held = max(1, int(truth.sum())), max(1, int((~truth).sum()))
    return Accuracy(
        method,
        float((answer == truth).mean()),
        float((answer & truth).sum() / held),
        float((answer & ~truth).sum() / not_held),
    )


def best_threshold(answer: np.ndarray, truth: np.ndarray) -> float | None:
    """Return the threshold for (N,) answers 0..1 that keeps three errors small at once.

    The three are measured in units of what is asked of a map at the default resolution: 1 % of all answers wrong, 2 %
    of what can be held not found, 1 % of what cannot be held called reachable. The threshold of the smallest largest
    error wins. None when all views or none can be held: then nothing can be learned.
    """
    if truth.all() or not truth.any():
        return None
    worst = {}
    for threshold in np.arange(0.2, 0.81, 0.02):
        row = score("", answer >= threshold, truth)
        worst[float(threshold)] = max(
            100 * (1 - row.accuracy), 50 * (1 - row.found), 100 * row.false_positives
        )
    return round(min(worst, key=worst.__getitem__), 2)


def random_views(cap: CapabilityMap, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return tip positions (count, 3) uniform in the map's box and uniform directions (count, 3)."""
    random = np.random.default_rng(seed)
    size = 2.0 * cap.radius * np.asarray(cap.grid.size)
    positions = cap.grid.origin + random.uniform(size=(count, 3)) * size
    directions = random.normal(size=(count, 3))
    return positions, directions / np.linalg.norm(directions, axis=1, keepdims=True)


def fresh_truth(
    cap: CapabilityMap, arm: Arm, positions: np.ndarray, directions: np.ndarray, roll_step_deg: float
):
    """Return (N,) bool by inverse kinematics with the map's own settings, but its own roll step."""
    if arm.urdf_sha256 != cap.data.urdf_sha256:
        raise CapabilityMapError(
            f"the map was made for URDF {cap.data.urdf_sha256}, robot {arm.robot} has {arm.urdf_sha256}"
        )
    stored = {name: value for name, value in cap.data.parameters.items() if name != "key"}
    parameters = BuildParameters.from_mapping(stored)
    options = probe_options(parameters, len(cap.data.joint_names))
    options.roll_step_rad = math.radians(roll_step_deg)
    return ViewProbe(arm.model(), arm.group, options).decide(positions, directions)[0]


def compare(
    cap: CapabilityMap, truth: np.ndarray, positions: np.ndarray, directions: np.ndarray
) -> list[Accuracy]:
    """Score every way of asking the map."""
    results = [
        score("interpolated bits", cap.reachable(positions, directions), truth),
        score("nearest bits", cap.reachable(positions, directions, interpolate=False), truth),
    ]
    for rule in shapes.RULES:
        results.append(score(f"shapes, {rule}", cap.covered(positions, directions, rule), truth))
    return results
