"""The robot as the exploration knows it: an interface, and what goes over it. Free of ROS."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class ExplorationError(RuntimeError):
    """The exploration cannot go on; the text says why."""


class ScanError(ExplorationError):
    """There was no usable scan this time; the next one may be."""


class StrategyError(ExplorationError):
    """The strategy broke, or answered what no loop can go on with."""


@dataclass(frozen=True)
class Scan:
    """One cloud, taken at rest.

    :param points: (N, 3) in the sensor's optical frame [m]; NaN rows had no return. The robot is already removed.
    :param T_map_sensor: (4, 4) at the stamp of the cloud.
    :param joints: positions [rad or m] by name, at that stamp.
    """

    points: Array
    T_map_sensor: Array
    joints: Mapping[str, float] = field(default_factory=dict)


class PlanStatus(enum.IntEnum):
    """How planning ended; the numbers are those of fv_msgs/PlanMotion."""

    SUCCESS = 1
    INVALID_REQUEST = 2
    START_IN_COLLISION = 3
    START_IN_UNKNOWN = 4
    NO_IK_SOLUTION = 5
    GOALS_IN_COLLISION = 6
    NO_PATH = 7
    NO_MAP = 8
    MAP_TOO_OLD = 9
    NO_JOINT_STATES = 10
    CANCELLED = 11
    INTERNAL_ERROR = 12

    @property
    def hopeless(self) -> bool:
        """Whether there is no motion to any other view either: the answer is not about the views asked for."""
        return self in HOPELESS


HOPELESS = frozenset(
    {
        PlanStatus.INVALID_REQUEST,
        PlanStatus.START_IN_COLLISION,
        PlanStatus.START_IN_UNKNOWN,
        PlanStatus.NO_MAP,
        PlanStatus.NO_JOINT_STATES,
    }
)
"""Answers about the robot's start, the request or the planner itself."""


@dataclass(frozen=True)
class Plan:
    """The planner's answer to a set of views.

    :param view: index of the view that the motion leads to; -1 without a motion.
    :param motion: what the robot knows the motion by; nobody else looks into it.
    :param joints: where the motion ends, of the joints that it moves [rad or m].
    """

    status: PlanStatus
    message: str = ""
    view: int = -1
    motion: int = 0
    duration_s: float = 0.0
    path_length_rad: float = 0.0
    joints: Mapping[str, float] = field(default_factory=dict)


class Robot(Protocol):
    """What the exploration asks of a robot."""

    def now_s(self) -> float:
        """The robot's time [s]."""

    def scan(self) -> Scan:
        """A scan at rest; ScanError when there is none, ExplorationError when there will be none."""

    def plan(self, poses: Array, scores: Array, map_sequence: int, seed: int) -> Plan:
        """A motion to one of the (N, 4, 4) camera poses of the map frame; higher scores are better."""

    def execute(self, plan: Plan) -> str:
        """Move; returns an empty text when the motion was done, else why not. The robot rests afterwards."""
