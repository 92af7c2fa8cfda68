"""What the benchmarks share: synthetic rooms and cameras, and rows of the benchmark table."""

from __future__ import annotations

import gc
import math
import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def row(
    bench: str, case: str, ours: list[float], reference: list[float] | None = None, **more: Any
) -> dict[str, Any]:
    """A row of scripts/bench: medians, ratio reference / ours, spread (largest - smallest of ours over its median).

    :param more: unit, reference_name, target (a bound on the ratio, or on ours when there is no reference) and
        at_most=True when the target is an upper bound.
    """
    median = statistics.median(ours)
    other = statistics.median(reference) if reference else None
    ratio = other / median if other is not None and median else None
    target, at_most = more.get("target"), more.get("at_most", False)
    judged = ratio if ratio is not None else median
    met = None if target is None else bool(judged <= target if at_most else judged >= target)
    return {
        "bench": bench,
        "case": case,
        "ours": median,
        "reference": other,
        "reference_name": more.get("reference_name"),
        "unit": more.get("unit", "s"),
        "ratio": ratio,
        "spread": (max(ours) - min(ours)) / median if median else 0.0,
        "runs": len(ours),
        "target": target,
        "met": met,
    }


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """Seconds and result."""
    gc.collect()
    start = time.perf_counter()
    result = work()
    return time.perf_counter() - start, result


class Room:
    """A box-shaped room with boxes in it; rays are cast analytically."""

    def __init__(
        self, size: tuple[float, float, float] = (4.0, 4.0, 2.6), seed: int = 1, furniture: int = 14
    ) -> None:
        rng = np.random.default_rng(seed)
        self.low, self.high = np.zeros(3), np.array(size)
        corner = rng.uniform(0.1, 0.75, (furniture, 3)) * size
        corner[: furniture // 2, 2] = 0
        edges = rng.uniform(0.15, 0.7, (furniture, 3))
        self.boxes = [(a, np.minimum(a + e, self.high)) for a, e in zip(corner, edges, strict=True)]

    def free(self, point: Array, margin: float = 0.15) -> bool:
        """Is the point in no box?"""
        return not any(np.all(point > a - margin) and np.all(point < b + margin) for a, b in self.boxes)

    def ranges(self, origin: Array, directions: Array) -> Array:
        """(N,) distance [m] to the first surface along unit rays (N, 3)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1 / directions
            far = np.maximum((self.low - origin) * inverse, (self.high - origin) * inverse).min(axis=1)
            for a, b in self.boxes:
                s, t = (a - origin) * inverse, (b - origin) * inverse
                enter, leave = np.minimum(s, t).max(axis=1), np.maximum(s, t).min(axis=1)
                far = np.where((enter <= leave) & (enter > 0), np.minimum(far, enter), far)
        return far


def camera_rays(width: int, height: int, horizontal_deg: float = 58.0, vertical_deg: float = 45.0) -> Array:
    """(N, 3) unit rays, optical frame."""
    u = np.tan(math.radians(horizontal_deg) / 2) * ((np.arange(width) + 0.5) / width * 2 - 1)
    v = np.tan(math.radians(vertical_deg) / 2) * ((np.arange(height) + 0.5) / height * 2 - 1)
    x, y = np.meshgrid(u, v)
    rays = np.stack([x.ravel(), y.ravel(), np.ones(x.size)], axis=1)
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)


def look(position: Array, yaw: float, pitch: float) -> Array:
    """(4, 4) optical pose; yaw about z, pitch upwards [rad]."""
    forward = np.array([math.cos(yaw) * math.cos(pitch), math.sin(yaw) * math.cos(pitch), math.sin(pitch)])
    right = np.array([math.sin(yaw), -math.cos(yaw), 0.0])
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    pose[:3, 3] = position
    return pose


def scan(room: Room, pose: Array, rays: Array, noise_m: float = 0.0, seed: int = 0) -> Array:
    """(N, 3) points, sensor frame."""
    ranges = room.ranges(pose[:3, 3], rays @ pose[:3, :3].T)
    noise = np.random.default_rng(seed).normal(size=len(ranges)) * noise_m
    return rays * (ranges + noise)[:, None]


def tour(room: Room, count: int, seed: int = 3) -> list[Array]:
    """Poses of a walk once around the room, looking about."""
    rng = np.random.default_rng(seed)
    centre, reach = room.high / 2, room.high[0] * 0.36
    poses = []
    while len(poses) < count:
        angle = 2 * math.pi * len(poses) / count
        across = np.array([math.cos(angle), math.sin(angle)]) * reach
        position = centre + np.append(across, rng.uniform(-0.5, 0.8))
        if not room.free(position):
            position[2] = room.high[2] - 0.3
        poses.append(look(position, angle + math.pi * 0.75 + rng.uniform(-0.6, 0.6), rng.uniform(-0.6, 0.3)))
    return poses
