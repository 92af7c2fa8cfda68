"""Joint trajectories as piecewise polynomials: quintic, cubic or linear by what the points carry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_FAR = 1e9  # stands for no limit [rad or m]


@dataclass(frozen=True)
class JointSample:
    """State of joints (J,): positions [rad], velocities [rad/s], accelerations [rad/s^2]."""

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray


def segment(duration_s: float, start: JointSample, end: JointSample, order: int) -> np.ndarray:
    """Coefficients (6, J), lowest power first, of a polynomial over [0, duration_s] from `start` to `end`.

    order 1 meets the positions, 3 the velocities too, 5 the accelerations too. A segment of no duration is its end.
    """
    out = np.zeros((6, len(start.position)))
    T = duration_s
    if T <= 0.0:
        out[0] = end.position
        out[1] = end.velocity if order >= 3 else 0.0
        out[2] = end.acceleration / 2.0 if order >= 5 else 0.0
        return out
    out[0] = start.position
    if order == 1:
        out[1] = (end.position - start.position) / T
        return out
    out[1] = start.velocity
    if order == 5:
        out[2] = start.acceleration / 2.0
    # What the known coefficients leave over at the end, solved for the remaining ones.
    position = end.position - (out[0] + out[1] * T + out[2] * T**2)
    velocity = end.velocity - (out[1] + 2.0 * out[2] * T)
    if order == 3:
        out[2] = 3.0 * position / T**2 - velocity / T
        out[3] = velocity / T**2 - 2.0 * position / T**3
        return out
    acceleration = end.acceleration - 2.0 * out[2]
    out[3] = 10.0 * position / T**3 - 4.0 * velocity / T**2 + acceleration / (2.0 * T)
    out[4] = -15.0 * position / T**4 + 7.0 * velocity / T**3 - acceleration / T**2
    out[5] = 6.0 * position / T**5 - 3.0 * velocity / T**4 + acceleration / (2.0 * T**3)
    return out


def evaluate(coefficients: np.ndarray, t: float) -> JointSample:
    """State at time t [s] of a polynomial with coefficients (6, J)."""
    powers = t ** np.arange(6.0)
    k = np.arange(6.0)
    return JointSample(
        powers @ coefficients,
        (k[1:] * powers[:5]) @ coefficients[1:],
        (k[2:] * k[1:5] * powers[:4]) @ coefficients[2:],
    )


class Spline:
    """A piecewise polynomial over absolute times; before its start it is the first state, after its end it rests."""

    def __init__(self, times_s: np.ndarray, coefficients: np.ndarray) -> None:
        """times_s (K+1,) ascending borders of K segments with coefficients (K, 6, J)."""
        self.times_s = np.asarray(times_s, float)
        self._coefficients = coefficients

    @classmethod
    def through(cls, start_s: float, start: JointSample, times_s: np.ndarray, points: dict) -> Spline:
        """From `start` at `start_s` through points at times_s (P,), the first at or after start_s.

        points: position (P, J), and velocity, acceleration (P, J) or None. The order of every segment is 5 with
        accelerations (and velocities), 3 with velocities, 1 with neither.
        """
        position, velocity, acceleration = (
            points["position"],
            points.get("velocity"),
            points.get("acceleration"),
        )
        order = 1 if velocity is None else 3 if acceleration is None else 5
        zero = np.zeros_like(position)
        velocity = zero if velocity is None else velocity
        acceleration = zero if acceleration is None else acceleration
        borders, coefficients, last = [start_s], [], start
        for i, t in enumerate(times_s):
            point = JointSample(position[i], velocity[i], acceleration[i])
            coefficients.append(segment(t - borders[-1], last, point, order))
            borders.append(t)
            last = point
        return cls(np.array(borders), np.array(coefficients))

    @classmethod
    def hold(cls, at_s: float, position: np.ndarray) -> Spline:
        """Rest at positions (J,) from at_s on."""
        coefficients = np.zeros((1, 6, len(position)))
        coefficients[0, 0] = position
        return cls(np.array([at_s, at_s]), coefficients)

    @classmethod
    def stop(
        cls,
        at_s: float,
        start: JointSample,
        duration_s: float,
        limits: tuple[np.ndarray, np.ndarray] = (-np.inf, np.inf),
    ) -> Spline:
        """Come to rest from `start` by even deceleration over duration_s, sooner where limits (J,) are nearer."""
        position, velocity = np.clip(start.position, *limits), start.velocity
        room = np.clip(np.where(velocity > 0.0, limits[1], limits[0]) - position, -_FAR, _FAR)
        speed = np.where(velocity == 0.0, 1.0, velocity)
        ends = np.minimum(duration_s, np.where(velocity == 0.0, 0.0, 2.0 * room / speed))
        if ends.max(initial=0.0) <= 0.0:
            return cls.hold(at_s, position)
        slowing = -velocity / np.where(ends > 0.0, ends, np.inf)
        borders = np.unique(np.append(ends[ends > 0.0], 0.0))
        coefficients = np.zeros((len(borders) - 1, 6, len(position)))
        for row, t in zip(coefficients, borders[:-1], strict=True):
            left = np.minimum(t, ends)
            row[0] = position + velocity * left + 0.5 * slowing * left**2
            row[1] = np.where(ends > t, velocity + slowing * t, 0.0)
            row[2] = np.where(ends > t, 0.5 * slowing, 0.0)
        return cls(at_s + borders, coefficients)

    @property
    def end_s(self) -> float:
        """Time of the last point."""
        return float(self.times_s[-1])

    def sample(self, t: float) -> JointSample:
        """State at time t [s]."""
        if t >= self.end_s:
            duration = self.end_s - self.times_s[-2]
            end = evaluate(self._coefficients[-1], max(duration, 0.0)).position
            rest = np.zeros_like(end)
            return JointSample(end, rest, rest)
        i = max(int(np.searchsorted(self.times_s, t, side="right")) - 1, 0)
        return evaluate(self._coefficients[i], max(t - self.times_s[i], 0.0))

    def followed_by(self, other: Spline) -> Spline:
        """This one until `other` starts, at rest between the two if this one ends before, then `other`."""
        start = other.times_s[0]
        if start > self.end_s:
            rest = Spline.hold(self.end_s, self.sample(self.end_s).position)
            joined = np.concatenate([self._coefficients, rest._coefficients, other._coefficients])
            return Spline(np.concatenate([self.times_s, other.times_s]), joined)
        kept = int(np.searchsorted(self.times_s[:-1], start, side="left"))
        return Spline(
            np.concatenate([self.times_s[:kept], other.times_s]),
            np.concatenate([self._coefficients[:kept], other._coefficients]),
        )
