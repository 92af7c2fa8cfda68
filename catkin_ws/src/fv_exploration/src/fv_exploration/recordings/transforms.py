"""The transforms of a recording: who is whose parent, when, and the one way from frame to frame."""

from __future__ import annotations

import bisect
import math
from array import array
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fv_common.transforms import inverse
from fv_exploration.recordings.errors import RecordingError, is_unit, length, matrix_from_quaternion

Array = NDArray[np.float64]
Pose = tuple[Sequence[float], Sequence[float]]
"""Translation (3,) [m] and quaternion x, y, z, w."""
Pair = tuple[str, str]
"""Parent and child."""

MANY = 10
"""Names that a message lists at most."""
LONG_GAP = 10.0
"""In usual steps between samples of TF, and at least as many tenths of a second: a motion in there is a guess."""
STILL = 0.01
"""What moves no more than that [m, rad] between two samples stands still."""
FASTEST = 100.0
"""What moves faster [m/s, rad/s] between two samples has jumped."""


class OutsideSpan(RecordingError):
    """A stamp lies outside of what was recorded, by ``beyond_s`` [s]."""

    def __init__(self, text: str, beyond_s: float) -> None:
        super().__init__(text)
        self.beyond_s = beyond_s


class _History:
    """The poses of a child in its parent: at stamps [ns], and static ones, of which the last one counts."""

    def __init__(self, note: Callable[[str], None]) -> None:
        self._note = note
        self._stamps = array("q")
        self._poses = array("d")  # seven numbers each
        self._in_order = True
        self._gap_ns: float | None = None  # longer ones are no usual step; found out when first asked for
        self.fixed: Pose | None = None

    def add(self, stamp_ns: int, pose: Pose) -> None:
        self._in_order &= not self._stamps or self._stamps[-1] <= stamp_ns
        self._stamps.append(stamp_ns)
        for part in pose:
            self._poses.extend(part)

    def at(self, pair: Pair, stamp_ns: int) -> Array:
        if self.fixed is not None:
            self._require_one_kind(pair, self.fixed)
            return matrix_from_quaternion(*self.fixed)
        self._sort()
        first, last = self._stamps[0], self._stamps[-1]
        beyond_ns = max(first - stamp_ns, stamp_ns - last)
        if beyond_ns > 0:
            raise OutsideSpan(
                f"TF's span of {_arrow(pair)}, {first / 1e9:.3f} to {last / 1e9:.3f} s", beyond_ns / 1e9
            )
        after = bisect.bisect_left(self._stamps, stamp_ns)
        if self._stamps[after] == stamp_ns:
            return matrix_from_quaternion(*self._pose(after))
        before = self._stamps[after - 1]
        gap_ns = self._stamps[after] - before
        share = (stamp_ns - before) / gap_ns
        if gap_ns > self._longest_ns() and self._moves(after - 1, after + 1).max() > STILL:
            self._note(
                f"{_arrow(pair)} moved in a gap of {gap_ns / 1e9:.1f} s without samples: taken as steady"
            )
        return _between(self._pose(after - 1), self._pose(after), share)

    def _pose(self, index: int) -> Pose:
        numbers = np.array(self._poses[7 * index : 7 * index + 7])
        return numbers[:3], numbers[3:]

    def jumps(self) -> int:
        """How often it moves faster than anything does: two nodes that send it, or a clock that was set back."""
        self._sort()
        seconds = np.diff(np.asarray(self._stamps)) / 1e9
        return int((self._moves(0, len(self._stamps)) > FASTEST * seconds + STILL).sum())

    def _longest_ns(self) -> float:
        if self._gap_ns is None:
            usual_ns = float(np.median(np.diff(np.asarray(self._stamps))))
            self._gap_ns = LONG_GAP * max(usual_ns, 1e8)
        return self._gap_ns

    def _moves(self, begin: int, end: int) -> Array:
        """From each sample of a range to the next: the way [m] or the angle [rad], whichever is more."""
        poses = np.asarray(self._poses).reshape(-1, 7)[begin:end]
        with np.errstate(over="ignore", invalid="ignore"):
            q = poses[:, 3:] / np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
            angles = 2 * np.arccos(np.clip(np.abs((q[1:] * q[:-1]).sum(axis=1)), 0.0, 1.0))
            return np.maximum(np.linalg.norm(np.diff(poses[:, :3], axis=0), axis=1), angles)

    def _sort(self) -> None:
        if self._in_order:
            return
        order = np.argsort(self._stamps, kind="stable")
        self._poses = array("d", np.asarray(self._poses).reshape(-1, 7)[order].ravel())
        self._stamps = array("q", np.asarray(self._stamps)[order])
        self._in_order = True

    def _require_one_kind(self, pair: Pair, fixed: Pose) -> None:
        """Some nodes send static transforms on both topics: that is fine as long as they agree."""
        moving = np.asarray(self._poses).reshape(-1, 7)
        if not np.allclose(moving, np.concatenate(fixed), atol=1e-6):
            raise RecordingError(f"{_arrow(pair)} is static and also moves in TF; valid: one of both")


def _between(start: Pose, end: Pose, share: float) -> Array:
    """Positions on a line, rotations on the shorter arc (Shoemake 1985)."""
    (p, q), (r, s) = (tuple(map(np.asarray, pose)) for pose in (start, end))
    q, s = q / length(q), s / length(s)
    cosine = float(np.dot(q, s))
    if cosine < 0:
        s, cosine = -s, -cosine
    angle = np.arccos(min(cosine, 1.0))
    if angle < 1e-6:
        turned = q + share * (s - q)
    else:
        turned = (np.sin((1 - share) * angle) * q + np.sin(share * angle) * s) / np.sin(angle)
    return matrix_from_quaternion(p + share * (r - p), turned)


class TransformTree:
    """All transforms of a recording. Frames may have several parents: a way is used only if it is the only one."""

    def __init__(self) -> None:
        self._histories: dict[Pair, _History] = {}
        self._parents: dict[str, list[str]] = {}
        self._children: dict[str, list[str]] = {}
        self._ways: dict[Pair, list[tuple[Pair, bool]]] = {}
        self._notes: dict[str, int] = {}

    def __contains__(self, frame: str) -> bool:
        return frame in self._parents or frame in self._children

    def add(
        self,
        parent: str,
        child: str,
        stamp_ns: int,
        translation: Sequence[float],
        quaternion_xyzw: Sequence[float],
        static: bool = False,
    ) -> None:
        """A transform that takes child-frame points to the parent frame, at a time [ns] or always.

        What tf2 would not take either is left out and noted.
        """
        pair = (parent, child)
        if not self._usable(pair, translation, quaternion_xyzw):
            return
        if pair not in self._histories:
            self._histories[pair] = _History(self.note)
            self._parents.setdefault(child, []).append(parent)
            self._children.setdefault(parent, []).append(child)
            self._ways.clear()
        history, pose = self._histories[pair], (tuple(translation), tuple(quaternion_xyzw))
        if not static:
            history.add(stamp_ns, pose)
            return
        if history.fixed and history.fixed != pose:
            self.note(f"the static {_arrow(pair)} was sent with other values: the last ones count")
        history.fixed = pose

    def _usable(self, pair: Pair, translation: Sequence[float], quaternion: Sequence[float]) -> bool:
        if not all(pair) or pair[0] == pair[1]:
            self.note(f"{_arrow(pair)} left out: parent and child must be two named frames")
        elif not all(map(math.isfinite, (*translation, *quaternion))):
            self.note(f"{_arrow(pair)} left out: not finite")
        elif not 1e-9 < length(quaternion) < np.inf:
            self.note(f"{_arrow(pair)} left out: its quaternion has no direction")
        else:
            if not is_unit(quaternion):
                self.note(f"quaternions of {_arrow(pair)} were brought to length 1")
            return True
        return False

    def note(self, text: str) -> None:
        """Something was left out or replaced."""
        self._notes[text] = self._notes.get(text, 0) + 1

    def noted(self) -> str:
        """All notes as one line; empty when there are none."""
        parts = [text if count == 1 else f"{text} ({count} times)" for text, count in self._notes.items()]
        return _listed(parts, "; ")

    def root(self, frame: str) -> str:
        """The frame above all others.

        :raises RecordingError: when there is none or more than one, naming loop or parents.
        """
        above = self._reached(frame, self._parents)
        roots = [name for name in above if not self._parents.get(name)]
        if len(roots) == 1:
            return roots[0]
        if not roots:
            raise RecordingError(f"TF has the loop {self._loop(above)}; valid: a tree")
        forked = next(name for name in above if len(self._parents.get(name, ())) > 1)
        raise RecordingError(
            f"frame {forked!r} has the parents {quoted(self._parents[forked])} in TF; "
            f"choose the frame of the map: {quoted(roots)}"
        )

    def unconnected(self, frame: str) -> list[str]:
        """The frames that no way leads to."""
        every = {**self._parents, **self._children}
        reached = self._reached(frame, {name: self._neighbours(name) for name in every})
        return [name for name in every if name not in reached]

    def lookup(self, target: str, source: str, stamp_ns: int) -> Array:
        """(4, 4) that takes source-frame points to the target frame at a time [ns].

        Between two samples it is interpolated, never beyond them.

        :raises OutsideSpan: before the first or after the last sample of a transform that is not static.
        :raises RecordingError: when there is no way from frame to frame, or more than one.
        """
        matrix = np.eye(4)
        with np.errstate(over="ignore", invalid="ignore"):
            for pair, upwards in self._way(target, source):
                step = self._histories[pair].at(pair, stamp_ns)
                matrix = (step if upwards else inverse(step)) @ matrix
        if not np.isfinite(matrix).all():
            raise RecordingError(
                f"positions between {source!r} and {target!r} add up to more than a number holds"
            )
        return matrix

    def _way(self, target: str, source: str) -> list[tuple[Pair, bool]]:
        if (target, source) not in self._ways:
            frames = self._shortest(target, source)
            self._require_only(frames, target)
            steps = pairwise(frames)
            self._ways[target, source] = [
                ((b, a), True) if (b, a) in self._histories else ((a, b), False) for a, b in steps
            ]
            for pair, _ in self._ways[target, source]:
                if jumps := self._histories[pair].jumps():
                    self.note(
                        f"{_arrow(pair)} jumps {jumps} times: is it sent twice, or is the clock set back?"
                    )
        return self._ways[target, source]

    def _neighbours(self, frame: str) -> list[str]:
        return [*self._parents.get(frame, ()), *self._children.get(frame, ())]

    def _shortest(self, target: str, source: str) -> list[str]:
        came_from = {source: source}
        waiting = deque([source])
        while waiting and target not in came_from:
            frame = waiting.popleft()
            for other in self._neighbours(frame):
                if other not in came_from:
                    came_from[other] = frame
                    waiting.append(other)
        if target not in came_from:
            raise RecordingError(self._no_way(target, source, came_from))
        frames = [target]
        while frames[-1] != source:
            frames.append(came_from[frames[-1]])
        return frames[::-1]

    def _no_way(self, target: str, source: str, reached: Iterable[str]) -> str:
        text = f"TF does not lead from {source!r} to {target!r}"
        above = self._reached(source, self._parents)
        if all(self._parents.get(name) for name in above):
            text += f": it has the loop {self._loop(above)}"
        others = [name for name in reached if name != source]
        text += f"; valid: {quoted(others)}" if others else f"; it does not know {source!r}"
        return text + (f" ({self.noted()})" if self._notes else "")

    def _require_only(self, frames: list[str], target: str) -> None:
        """Throw if another way connects two frames of this one: the frames between would have two poses."""
        group: dict[str, str] = {}

        def find(name: str) -> str:
            while group.setdefault(name, name) != name:
                group[name] = group[group[name]]
                name = group[name]
            return name

        on_the_way = set(pairwise(frames))
        for parent, child in self._histories:
            other = (parent, child) in on_the_way or (child, parent) in on_the_way
            if not other or (child, parent) in self._histories:  # both directions: a loop of two
                group[find(parent)] = find(child)
        first: dict[str, int] = {}
        for at, name in enumerate(frames):
            begin = first.setdefault(find(name), at)
            if begin != at:
                raise RecordingError(self._two_ways(frames[begin : at + 1], target))

    def _two_ways(self, frames: list[str], target: str) -> str:
        """What is wrong with frames of a way of which the first and the last are connected by another one, too."""
        above = self._reached(frames[0], self._parents)
        cyclic = self._peeled(above)
        if cyclic and set(frames) & cyclic:
            return f"TF has the loop {self._loop(above)}; valid: a tree"
        either = [
            *frames,
            *self._reached(frames[0], self._parents),
            *self._reached(frames[-1], self._parents),
        ]
        forked = next((name for name in either if len(self._parents.get(name, ())) > 1), frames[0])
        return (
            f"frame {forked!r} has the parents {quoted(self._parents.get(forked, []))} in TF, and more than one "
            f"of them leads to {target!r}; valid: one parent"
        )

    @staticmethod
    def _reached(frame: str, links: dict[str, list[str]]) -> list[str]:
        """The frame and all that its links lead to, nearest first."""
        found, waiting = {frame: None}, deque([frame])
        while waiting:
            for other in links.get(waiting.popleft(), ()):
                if other not in found:
                    found[other] = None
                    waiting.append(other)
        return list(found)

    def _peeled(self, frames: list[str]) -> set[str]:
        """Loops of frames and what hangs below them: what is left when those without a parent go, over and over."""
        count = {name: len(self._parents.get(name, ())) for name in frames}
        waiting = deque(name for name, parents in count.items() if parents == 0)
        while waiting:
            for child in self._children.get(waiting.popleft(), ()):
                if child in count:
                    count[child] -= 1
                    if count[child] == 0:
                        waiting.append(child)
        return {name for name, parents in count.items() if parents > 0}

    def _loop(self, frames: list[str]) -> str:
        left = self._peeled(frames)
        at, seen = next(name for name in frames if name in left), []
        while at not in seen:
            seen.append(at)
            at = next(name for name in self._parents[at] if name in left)
        return " -> ".join(repr(name) for name in [*seen[seen.index(at) :], at])


def _arrow(pair: Pair) -> str:
    return f"{pair[0]!r} -> {pair[1]!r}"


def quoted(names: Iterable[str]) -> str:
    """The first few names as people write them."""
    return _listed([repr(name) for name in names], ", ")


def _listed(parts: list[str], between: str) -> str:
    more = f"{between}and {len(parts) - MANY} more" if len(parts) > MANY else ""
    return between.join(parts[:MANY]) + more
