"""From ranked views to one motion: plan to the best, judge the view where the motion ends, take it or go on."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fv_exploration.audience import Announced
from fv_exploration.explore_config import ExploreConfig, ViewSettings
from fv_exploration.outcome import Decision
from fv_exploration.robot import ExplorationError, Plan, PlanStatus, Robot
from fv_exploration.strategy.ranking import Candidates, Ranking
from fv_exploration.view_geometry import are_alike, spread_out
from fv_exploration.view_worth import ViewWorth

Array = NDArray[np.float64]

REFUSED_KEPT = 200
"""Of the views that the planner refused, the last so many are not planned to again until the map has grown."""


@dataclass(frozen=True)
class Motion:
    """A planned motion to a view, and what that is worth [m^3] from where the motion ends; ``score`` is per cost.

    :param goals: the views that were planned to; ``plan.view`` is one of them.
    """

    plan: Plan
    goals: Candidates
    gain_m3: float
    score: float

    @property
    def pose(self) -> Array:
        """(4, 4) of the view, as the strategy gave it."""
        pose: Array = self.goals.poses[self.plan.view]
        return pose


@dataclass(frozen=True)
class Start:
    """What the motions of one decision begin with.

    :param joints: the robot's [rad or m], by name.
    :param seed: of the decision's first plan; those after it count up.
    """

    joints: Mapping[str, float]
    map_sequence: int
    seed: int


class ViewsLeft:
    """The views of a ranking that are worth a motion and have not been dropped."""

    def __init__(self, candidates: Candidates, judge: ViewWorth, settings: ViewSettings) -> None:
        self._judge = judge
        self._settings = settings
        poor = candidates.gain_m3 < settings.min_gain_m3  # not those that the judge has not been asked about
        self._views = candidates.take(~poor)
        self.worth_it = len(self._views)

    def best(self) -> Candidates:
        """The best of them that differ from each other, best first, each worth a motion; empty when none is left."""
        settings = self._settings
        while True:
            scores, spread_rad = self._views.scores, math.radians(settings.spread_deg)
            rows = spread_out(scores, self._views.poses, settings.shortlist, settings.spread_m, spread_rad)
            goals = self._judged(self._views.take(rows))
            poor = goals.gain_m3 < settings.min_gain_m3
            if not poor.any():
                return goals
            self.worth_it -= int(poor.sum())
            self._views = self._views.take(np.setdiff1d(np.arange(len(self._views)), rows[poor]))

    def drop(self, pose: Array) -> None:
        """Leave out the view (4, 4) and its like."""
        spread_rad = math.radians(self._settings.spread_deg)
        alike = are_alike(self._views.poses, pose, self._settings.spread_m, spread_rad)
        self._views = self._views.take(~alike)

    def _judged(self, views: Candidates) -> Candidates:
        """The views with what is expected of each, also where the strategy has not asked."""
        unasked = np.isnan(views.gain_m3)
        if not unasked.any():
            return views
        gain_m3 = views.gain_m3.copy()
        gain_m3[unasked] = self._judge.expect(views.poses[unasked]).gain_m3
        return replace(views, gain_m3=gain_m3)


class MotionSearch:
    """One decision: the search for a motion among ranked views.

    :param refused: views that the planner refused before: they and their like are not planned to; grows.
    :ivar record: what became of the views.
    """

    def __init__(
        self,
        ranking: Ranking,
        start: Start,
        robot: Robot,
        judge: ViewWorth,
        config: ExploreConfig,
        refused: list[Array],
        announced: Announced,
    ) -> None:
        self._start = start
        self._robot = robot
        self._judge = judge
        self._config = config
        self._refused = refused
        self._announced = announced
        self._left = ViewsLeft(ranking.candidates, judge, config.views)
        self._planned = self._refusals = 0
        self.record = Decision(ranking.funnel(self._left.worth_it))
        for pose in refused[-REFUSED_KEPT:]:
            self._left.drop(pose)

    def run(self, stop: Callable[[], bool]) -> Motion | None:
        """The best view that there is a motion to; None when there is none.

        What the robot itself would hide is known only from where a motion ends. So motions are planned, and the views
        they lead to judged, until none of those left promises much more than the best that was found.
        """
        best: Motion | None = None
        while self._refusals < self._config.motion.max_rounds and not stop():
            goals = self._announced.do("choose", "choosing the next view", self.goals)
            if len(goals) == 0 or (best and self._good_enough(best, goals)):
                break
            plan = self._announced.do("plan", f"planning to {len(goals)} views", self._plan, goals)
            if plan.status is not PlanStatus.SUCCESS:
                self._refuse(plan, goals)
                if best:
                    break
                if plan.status.hopeless and not stop():
                    raise ExplorationError(f"the robot cannot move: {plan.message}")
                continue
            motion = self._announced.do("choose", "judging the view", self._judged, plan, goals)
            best = self._better(motion, best)
        return best

    def goals(self) -> Candidates:
        """The views to plan to next, best first; empty when none is left that is worth a motion."""
        goals = self._left.best()
        self.record.funnel = replace(self.record.funnel, worth_it=self._left.worth_it)
        return goals

    def _good_enough(self, best: Motion, goals: Candidates) -> bool:
        settings = self._config.motion
        return self._planned >= settings.max_plans or best.score >= settings.good_share * goals.scores[0]

    def _plan(self, goals: Candidates) -> Plan:
        start = self._start
        seed = start.seed + self._refusals + self._planned
        return self._robot.plan(goals.poses, goals.scores, start.map_sequence, seed)

    def _judged(self, plan: Plan, goals: Candidates) -> Motion:
        """The planned view with what it is worth at the joints where the motion ends."""
        gain_m3 = self._judge.gain_at(goals.poses[plan.view], {**self._start.joints, **plan.joints})
        before_m3 = float(goals.gain_m3[plan.view])
        return Motion(plan, goals, gain_m3, float(goals.scores[plan.view]) * gain_m3 / before_m3)

    def _better(self, motion: Motion, best: Motion | None) -> Motion | None:
        """The better of the two; the view waits for the next decision, whether its motion is taken or not."""
        self._planned += 1
        self._left.drop(motion.pose)
        if motion.gain_m3 < self._config.views.min_gain_m3:
            self.record.hidden += 1
            return best
        return motion if not best or motion.score > best.score else best

    def _refuse(self, plan: Plan, goals: Candidates) -> None:
        """They and their like are not planned to again."""
        self._refusals += 1
        self.record.refused += len(goals)
        self.record.last_refusal = plan.message
        self._announced.audience.activity(f"no motion to these views: {plan.message}")
        for pose in goals.poses:
            self._refused.append(pose)
            self._left.drop(pose)
