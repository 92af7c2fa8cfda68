"""The exploration: scan, evaluate, plan, move, until nothing worth seeing can be reached.

Free of ROS: the robot and the audience are interfaces, so that a test can stand in for both.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fv_exploration import Evaluation, Evaluator, OccupancyMap, ScanConfig, Utility
from fv_exploration.audience import Announced, Audience, Step
from fv_exploration.explore_config import ExploreConfig
from fv_exploration.motion_choice import Motion, MotionSearch, Start
from fv_exploration.outcome import SEEN_SHARE, Decision, Outcome, Reason, nothing_left
from fv_exploration.returns import Returns
from fv_exploration.robot import ExplorationError, Robot, Scan, ScanError, StrategyError
from fv_exploration.strategy.protocol import Reach, Situation, Strategy
from fv_exploration.strategy.ranking import Ranking, require_ranking
from fv_exploration.view_worth import ViewWorth

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Seen:
    """What the last usable scan has left: where it was taken, and the evaluation of the map that it is in."""

    T_map_sensor: Array
    joints: Mapping[str, float]
    evaluation: Evaluation
    utility: Utility | None


class Exploration:
    """One exploration of a bounded volume.

    :param occupancy_map: the one map, with what is known before the first scan.
    :param evaluator: incremental evaluation of that map (frontiers, voids, frontier-voids, utility).
    :param scan_config: range limits of the sensor, and what a ray without return proves.
    :param strategy: ranks the views that may be next.
    :param reach: which views the robot can hold.
    :param judge: expects what views will show, and remembers what scans have failed to show.
    """

    def __init__(
        self,
        occupancy_map: OccupancyMap,
        evaluator: Evaluator,
        scan_config: ScanConfig,
        strategy: Strategy,
        reach: Reach,
        judge: ViewWorth,
        robot: Robot,
        audience: Audience,
        config: ExploreConfig,
        seed: int = 0,
    ) -> None:
        self._map = occupancy_map
        self._evaluator = evaluator
        self._scan_config = scan_config
        self._strategy = strategy
        self._reach = reach
        self._judge = judge
        self._robot = robot
        self._audience = audience
        self._config = config
        self._seed = seed
        self._views = 0  # places that were reached and scanned from
        self._decisions = 0
        self._failed_motions = 0
        self._failed_scans = 0
        self._seen_anything = False  # has any scan had a usable return?
        self._cut_short = ""  # why the last motion was not finished
        self._decision = Decision()  # what became of this decision's candidates
        self._refused: list[Array] = []  # views that the planner refused, since the map has grown
        self._expected: Motion | None = None  # the motion whose view is to be scanned next

    def run(self, stop: Callable[[], bool] = lambda: False) -> Outcome:
        """Explore until something ends it; ``stop`` is asked between the steps and cancels."""
        try:
            return self._explore(stop)
        except ExplorationError as error:
            outcome = self._outcome(Reason.CANCELLED if stop() else Reason.FAILED, str(error))
            return replace(outcome, error=error)

    def _explore(self, stop: Callable[[], bool]) -> Outcome:
        started_s = self._robot.now_s()
        step = Step()
        seen: Seen | None = None
        while True:
            scan = self._announced(step).do("scan", "scanning", self._scan, stop)
            if scan is not None:
                self._announced(step).do("integrate", "integrating the scan", self._integrate, scan, step)
                seen = self._announced(step).do("evaluate", "evaluating the map", self._evaluate, scan, step)
            elif seen is None:
                continue  # nothing has been seen yet: where else could the camera look?
            self._views = step.view
            self._audience.view_done(step)
            ended = self._budget_ended(started_s) or (Reason.CANCELLED if stop() else None)
            if ended is Reason.TIME_BUDGET and not self._views:
                return self._outcome(Reason.FAILED, self._unseen("the time budget was used up"))
            if ended:
                return self._outcome(ended)
            step = Step(view=self._views + 1, known_share=step.known_share, counts=step.counts)
            motion = self._next_motion(step, seen, stop)
            if motion is None:
                return self._outcome(Reason.CANCELLED) if stop() else self._nothing_left()
            self._announced(step).do("move", "moving", self._move, motion, step)
            if stop():  # the motion may have been cut short: that is no view
                return self._outcome(Reason.CANCELLED)

    def _scan(self, stop: Callable[[], bool]) -> Scan | None:
        """A scan, or None when there was none here: then the view has shown nothing, and another is tried."""
        try:
            scan = self._robot.scan()
        except ScanError as error:
            self._failed_scans += 1
            if stop():
                raise
            if self._failed_scans >= self._config.stop.max_failed_motions:
                raise ExplorationError(
                    f"{self._failed_scans} scans in a row failed, the last one: {error}"
                ) from error
            self._audience.activity(f"no scan: {error}")
            self._learn(0.0)
            return None
        self._failed_scans = 0
        return scan

    def _integrate(self, scan: Scan, step: Step) -> None:
        known_before = self._map.known_share()
        result = self._map.insert_scan(scan.points, scan.T_map_sensor, self._scan_config)
        self._note_returns(scan, result.counts)
        step.known_share = self._map.known_share()
        step.real_gain_m3 = (step.known_share - known_before) * self._map.volume_m3()
        self._judge.note_scan(scan.points, scan.T_map_sensor, scan.joints)
        self._learn(step.real_gain_m3)
        self._audience.map_changed(self._map)

    def _learn(self, gain_m3: float) -> None:
        """What the scan has shown anew, against what the motion to its view was taken for."""
        motion, self._expected = self._expected, None
        if motion and self._judge.note_gain(motion.pose, motion.gain_m3, gain_m3):
            self._refused.clear()  # the map has grown: what was out of reach may be within it now

    def _note_returns(self, scan: Scan, counts: Mapping[str, int]) -> None:
        """Say so when the map could use no return of a scan, or when points lie where no sensor sees."""
        returns = Returns(self._scan_config)
        returns.add(scan.points, counts)
        problem = returns.problem()
        self._seen_anything |= not problem
        for text in [problem] if problem else returns.warnings():
            self._audience.warn(text)

    def _evaluate(self, scan: Scan, step: Step) -> Seen:
        evaluation = self._evaluator.update()
        utility = self._utility() if self._strategy.uses_utility else None
        step.counts = {
            **self._map.counts(),
            "frontier": len(evaluation.frontier),
            "void": len(evaluation.void),
            "ellipsoids": len(evaluation.ellipsoids),
            "frontier_clusters": len(np.unique(evaluation.frontier_cluster)),
        }
        self._audience.evaluated(self._map, evaluation, utility)
        return Seen(scan.T_map_sensor, dict(scan.joints), evaluation, utility)

    def _utility(self) -> Utility:
        max_rays = self._config.evaluation.utility_rays
        return self._evaluator.utility(self._scan_config.max_range_m, max_rays=max_rays)

    def _next_motion(self, step: Step, seen: Seen, stop: Callable[[], bool]) -> Motion | None:
        """A planned motion to the best view that can be reached; None when there is nothing left to see or do."""
        announced = self._announced(step)
        ranking = announced.do("choose", "judging views", self._ranking, seen)
        start = Start(seen.joints, self._map.sequence, 1 + self._seed * 100_003 + self._decisions * 101)
        self._decisions += 1
        search = MotionSearch(
            ranking, start, self._robot, self._judge, self._config, self._refused, announced
        )
        self._decision = search.record
        motion = search.run(stop)
        if motion is None or stop():
            self._audience.decided(search.goals(), -1, step)
            return None
        self._accept(motion, step)
        return motion

    def _ranking(self, seen: Seen) -> Ranking:
        """The strategy's answer. What goes wrong in it is told with its name."""
        situation = Situation(
            self._map,
            seen.evaluation,
            seen.utility,
            self._reach,
            self._judge,
            seen.T_map_sensor,
            seen.joints,
            self._config.views,
            np.random.default_rng(self._seed + self._decisions),
        )
        try:
            ranking = self._strategy.choose(situation)
            require_ranking(ranking)
        except Exception as error:  # strategies are anybody's
            what = f"{type(error).__name__}: {error}"
            raise StrategyError(f"policy '{self._config.policy}' broke: {what}") from error
        return ranking

    def _accept(self, motion: Motion, step: Step) -> None:
        step.expected_gain_m3 = motion.gain_m3
        step.path_length_rad = motion.plan.path_length_rad
        step.duration_s = motion.plan.duration_s
        step.joints = motion.plan.joints
        self._expected = motion
        self._audience.decided(motion.goals, motion.plan.view, step)

    def _move(self, motion: Motion, step: Step) -> None:
        """Execute the plan. A motion that was not finished leads to no new view: the scan after it adds to the last."""
        problem = self._cut_short = self._robot.execute(motion.plan)
        self._failed_motions = self._failed_motions + 1 if problem else 0
        if problem:
            step.view = self._views
            self._audience.activity(f"the motion was not finished: {problem}")
        if self._failed_motions >= self._config.stop.max_failed_motions:
            raise ExplorationError(f"{self._failed_motions} motions in a row failed, the last one: {problem}")

    def _budget_ended(self, started_s: float) -> Reason | None:
        limits = self._config.stop
        if limits.max_views and self._views >= limits.max_views:
            return Reason.VIEW_BUDGET
        if limits.max_seconds and self._robot.now_s() - started_s >= limits.max_seconds:
            return Reason.TIME_BUDGET
        return None

    def _announced(self, step: Step) -> Announced:
        return Announced(self._audience, step)

    def _nothing_left(self) -> Outcome:
        share, min_gain_m3 = self._map.known_share(), self._config.views.min_gain_m3
        reason, message = nothing_left(self._decision, self._views, share, min_gain_m3)
        if self._views and not self._seen_anything and share < SEEN_SHARE:
            reason, message = Reason.FAILED, f"none of the scans of {self._views} views had a usable return"
        elif reason is Reason.FAILED:
            message = self._unseen(message)
        return self._outcome(reason, message)

    def _unseen(self, why: str) -> str:
        """Why no view was reached, with what went wrong before."""
        parts = [f"no view was reached: {why}"]
        if not self._seen_anything:
            parts.append("no scan had a usable return")
        if self._cut_short:
            parts.append(f"the motion before was not finished: {self._cut_short}")
        return "; ".join(parts)

    def _outcome(self, reason: Reason, message: str = "") -> Outcome:
        return Outcome(reason, message or reason.value, self._views, self._map.known_share())
