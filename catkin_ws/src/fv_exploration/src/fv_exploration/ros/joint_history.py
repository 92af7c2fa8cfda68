"""What the joints were told to be over the last seconds: newest, at a time, and whether they rest. Free of ROS."""

from __future__ import annotations

import collections
import math
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

KEPT_S = 10.0
STALE_S = 2.0
"""A joint that has not been heard of for longer than this behind the others is not known to rest."""


@dataclass(frozen=True)
class Sample:
    """One joint at one time; ``speed`` is NaN where the publisher gave none."""

    stamp_s: float
    position: float
    speed: float


class JointHistory:
    """Positions of the last seconds [rad or m], each joint with times of its own.

    Several publishers may share the topic, each with some of the joints and at its own rate. Safe for calls from
    several threads.
    """

    def __init__(self) -> None:
        self._joints: dict[str, collections.deque[Sample]] = {}
        self._lock = threading.Lock()

    def add(
        self, stamp_s: float, names: Sequence[str], positions: Sequence[float], speeds: Sequence[float] = ()
    ) -> str:
        """Take a message; what cannot be taken is left out and said in the text that is returned, else it is empty.

        A stamp that lies far before a joint's newest belongs to a clock that has jumped back: its history begins anew.
        """
        if len(names) != len(positions):
            return f"{len(names)} names with {len(positions)} positions: left out"
        if len(set(names)) != len(names):
            return f"a joint is named twice in {', '.join(names)}: left out"
        if stamp_s <= 0.0:
            return f"no stamp with the positions of {', '.join(names)}: left out"
        if len(speeds) != len(names):
            speeds = [math.nan] * len(names)
        wrong = [name for name, position in zip(names, positions, strict=True) if not math.isfinite(position)]
        with self._lock:
            for name, position, speed in zip(names, positions, speeds, strict=True):
                if math.isfinite(position):
                    self._take(name, Sample(stamp_s, position, speed))
        return f"position of {', '.join(wrong)} is not finite: left out" if wrong else ""

    def _take(self, name: str, sample: Sample) -> None:
        samples = self._joints.setdefault(name, collections.deque())
        if samples and sample.stamp_s < samples[-1].stamp_s - STALE_S:
            samples.clear()
        samples.append(sample)
        while samples[0].stamp_s < sample.stamp_s - KEPT_S:
            samples.popleft()

    def missing(self, names: Sequence[str]) -> list[str]:
        """Those of the joints that nothing has been heard of."""
        with self._lock:
            return [name for name in names if name not in self._joints]

    def newest(self) -> dict[str, float]:
        """The newest position of every joint."""
        return {name: samples[-1].position for name, samples in self._copy().items()}

    def at(self, stamp_s: float) -> tuple[dict[str, float], float]:
        """The position of every joint that is nearest in time, and how far away the farthest of these is [s]."""
        nearest = {
            name: min(samples, key=lambda sample: abs(sample.stamp_s - stamp_s))
            for name, samples in self._copy().items()
        }
        gap_s = max((abs(sample.stamp_s - stamp_s) for sample in nearest.values()), default=0.0)
        return {name: sample.position for name, sample in nearest.items()}, gap_s

    def newest_s(self) -> float:
        """The newest stamp [s]; -inf while there is none."""
        return newest_stamp(self._copy())

    def unrest(self, names: Sequence[str], rest_s: float, max_speed: float) -> str:
        """Why these joints are not known to have been at rest for so long; empty when they are.

        Rest needs both: no reported speed above the limit, and positions that stay within what the limit allows over
        the time, for some publishers report no speeds, and some report zeros. A joint that has only just been heard
        of, or no longer, does not rest.
        """
        joints = self._copy()
        now_s = newest_stamp(joints)
        for name in names:
            problem = joint_unrest(joints.get(name, []), now_s, rest_s, max_speed)
            if problem:
                return f"joint '{name}' {problem}"
        return ""

    def _copy(self) -> dict[str, list[Sample]]:
        with self._lock:
            return {name: list(samples) for name, samples in self._joints.items()}


def newest_stamp(joints: Mapping[str, Sequence[Sample]]) -> float:
    """The newest stamp [s] of any joint; -inf while there is none."""
    return max((samples[-1].stamp_s for samples in joints.values()), default=-math.inf)


def joint_unrest(samples: Sequence[Sample], now_s: float, rest_s: float, max_speed: float) -> str:
    """As ``JointHistory.unrest``, of one joint."""
    if not samples:
        return "has not been heard of"
    samples = sorted(samples, key=lambda sample: sample.stamp_s)
    end_s = samples[-1].stamp_s
    if end_s < now_s - max(rest_s, STALE_S):
        return f"has not been heard of for {now_s - end_s:.1f} s"
    first = max((i for i, sample in enumerate(samples) if sample.stamp_s <= end_s - rest_s), default=None)
    if first is None:
        return f"has been heard of for less than {rest_s:g} s"
    window = samples[first:]
    positions = [sample.position for sample in window]
    travelled = (max(positions) - min(positions)) / (end_s - window[0].stamp_s)
    speed = max([travelled, *(abs(sample.speed) for sample in window if math.isfinite(sample.speed))])
    return f"moves at {speed:.3g} a second" if speed > max_speed else ""
