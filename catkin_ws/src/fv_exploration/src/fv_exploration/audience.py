"""Who is told how an exploration goes, and what of each step. Free of ROS."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import ParamSpec, Protocol, TypeVar

from fv_exploration import Evaluation, OccupancyMap, Utility
from fv_exploration.strategy.ranking import Candidates

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


@dataclass
class Step:
    """What happened for one scan: a row of metrics.csv. Times are wall-clock seconds.

    :param view: number of the view; that of the one before when the motion to the next was not finished.
    :param joints: where the motion was to end, of the joints that it moved [rad or m].
    """

    view: int = 0
    seconds: dict[str, float] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    known_share: float = 0.0
    expected_gain_m3: float = 0.0
    real_gain_m3: float = 0.0
    path_length_rad: float = 0.0
    duration_s: float = 0.0
    joints: Mapping[str, float] = field(default_factory=dict)


class Audience(Protocol):
    """Who is told what happens."""

    def activity(self, text: str) -> None:
        """What is being done now."""

    def warn(self, text: str) -> None:
        """Something was left out, replaced or is likely to be wrong; told whenever it happens."""

    def map_changed(self, occupancy_map: OccupancyMap) -> None:
        """The map has a new sequence number; must be handed on before a plan is asked for."""

    def evaluated(self, occupancy_map: OccupancyMap, evaluation: Evaluation, utility: Utility | None) -> None:
        """An evaluation of the map is there; no utility where the strategy does not use it."""

    def decided(self, candidates: Candidates, chosen: int, step: Step) -> None:
        """Candidates were ranked; ``chosen`` is the index of the one to be executed, -1 for none."""

    def view_done(self, step: Step) -> None:
        """A view's scan is in the map and its figures are complete."""


@dataclass(frozen=True)
class Announced:
    """Does work of a step: says what it is before, and adds its wall time to the step."""

    audience: Audience
    step: Step

    def do(
        self,
        name: str,
        text: str,
        work: Callable[Arguments, Result],
        *arguments: Arguments.args,
        **keywords: Arguments.kwargs,
    ) -> Result:
        """What the work gives; its time goes to ``step.seconds[name]``, also when it fails."""
        self.audience.activity(text)
        start = time.perf_counter()
        try:
            return work(*arguments, **keywords)
        finally:
            self.step.seconds[name] = self.step.seconds.get(name, 0.0) + time.perf_counter() - start
