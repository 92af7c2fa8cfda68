"""What a strategy answers: views in its order of preference, and how many fell out before."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = NDArray[np.bool_] | NDArray[np.int64]

RIGID = 1e-3
"""Of the products of a rotation's columns."""


def _none() -> Array:
    return np.empty(0)


def _no_poses() -> Array:
    return np.empty((0, 4, 4))


@dataclass(frozen=True)
class Candidates:
    """Views with what is known of them; row i of every array belongs to view i.

    :param poses: (N, 4, 4) camera poses of the map frame, optical (z along the viewing direction). The roll is free.
    :param worth: (N,) what the strategy maximises, such as m^3; higher is better.
    :param cost_s: (N,) seconds that the view takes, above 0.
    :param gain_m3: (N,) what the judge expects to see anew; NaN, or left out: it has not been asked.
    :param reachability: (N,) 0..1; this and what follows is for who looks at the run, and may be left out.
    """

    poses: Array = field(default_factory=_no_poses)
    worth: Array = field(default_factory=_none)
    cost_s: Array = field(default_factory=_none)
    gain_m3: Array = field(default_factory=_none)
    reachability: Array = field(default_factory=_none)
    utility: Array = field(default_factory=_none)
    void_gain: Array = field(default_factory=_none)
    unknown_gain: Array = field(default_factory=_none)
    frontier_gain: Array = field(default_factory=_none)

    def __post_init__(self) -> None:
        for column in fields(self):
            values = np.asarray(getattr(self, column.name), dtype=float)
            if len(values) == 0 and column.name not in ("poses", "worth", "cost_s"):
                values = np.full(len(self.poses), np.nan if column.name == "gain_m3" else 0.0)
            object.__setattr__(self, column.name, values)

    def __len__(self) -> int:
        return len(self.poses)

    @property
    def scores(self) -> Array:
        """(N,) worth for its cost: what ranks the views."""
        return self.worth / self.cost_s

    def take(self, rows: Rows) -> Candidates:
        """The candidates of these rows (indices or a mask), in their order."""
        return Candidates(**{name: values[rows] for name, values in vars(self).items()})


@dataclass(frozen=True)
class Funnel:
    """How many candidate views were left after each sieve of a decision."""

    proposed: int = 0
    in_free_space: int = 0
    reachable: int = 0
    worth_it: int = 0


@dataclass(frozen=True)
class Ranking:
    """A strategy's answer.

    :param candidates: in any order; their scores rank them. None: there is nothing left to see.
    :param proposed: how many views were thought of, and
    :param in_free_space: how many of them lie in free space, before reachability was asked: they tell a user what held
        the robot when nothing is left. -1: as many as there are candidates.
    """

    candidates: Candidates = field(default_factory=Candidates)
    proposed: int = -1
    in_free_space: int = -1

    def funnel(self, worth_it: int) -> Funnel:
        """The sieves, with how many candidates are worth a motion."""
        reachable = len(self.candidates)
        in_free_space = max(self.in_free_space, reachable)
        return Funnel(max(self.proposed, in_free_space), in_free_space, reachable, worth_it)


def require_ranking(answer: object) -> None:
    """:raises TypeError, ValueError: naming what no loop can go on with; strategies are anybody's."""
    if not isinstance(answer, Ranking):
        raise TypeError(f"choose returned a {type(answer).__name__}; valid: a Ranking")
    views = answer.candidates
    count = len(views)
    if views.poses.shape != (count, 4, 4):
        raise ValueError(f"poses are {views.poses.shape}; valid: (N, 4, 4)")
    for column in fields(views)[1:]:
        shape = getattr(views, column.name).shape
        if shape != (count,):
            raise ValueError(f"{column.name} is {shape}; valid: ({count},), one number a pose")
    if not _rigid(views.poses).all():
        raise ValueError("a pose is no rigid transform; valid: rotations (to 0.1 %) and finite positions")
    if not np.isfinite(views.worth).all():
        raise ValueError("worth is not finite")
    if not (np.isfinite(views.cost_s) & (views.cost_s > 0)).all():
        raise ValueError("cost_s is not above 0")


def _rigid(poses: Array) -> Rows:
    """(N,) which of (N, 4, 4) are rigid transforms."""
    turns = poses[:, :3, :3]
    with np.errstate(invalid="ignore", over="ignore"):
        skew = np.abs(turns @ turns.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2), initial=0.0)
        rigid: Rows = (skew < RIGID) & (np.linalg.det(turns) > 0) & np.isfinite(poses).all(axis=(1, 2))
    return rigid
