"""The exploration: scan, evaluate, plan, move, until nothing worth seeing can be reached.

Free of ROS: the robot and the audience are interfaces, so that a test can stand in for both.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fv_exploration.explore_config import ExploreConfig
from fv_exploration.gain_judge import GainJudge
from fv_exploration.outcome import SEEN_SHARE, Decision, Outcome, Reason, nothing_left
from fv_exploration.returns import Returns
from fv_exploration.strategy.frontier_void import Candidates, ViewChooser

Array = NDArray[np.float64]


class ExplorationError(RuntimeError):
    """The exploration cannot go on; the text says why."""


class ScanError(ExplorationError):
    """There was no usable scan this time; the next one may be."""


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


@dataclass(frozen=True)
class Plan:
    """The planner's answer to a set of views; ``trajectory`` is None when there is no motion.

    :param joints: where the motion ends, of the joints that it moves [rad or m].
    :param hopeless: there is no motion to any other view either: the robot cannot leave where it is, or nothing can be
        planned at all.
    """

    trajectory: Any
    view: int
    message: str
    duration_s: float = 0.0
    path_length_rad: float = 0.0
    joints: Mapping[str, float] = field(default_factory=dict)
    hopeless: bool = False


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

    def map_changed(self, occupancy_map: Any) -> None:
        """The map has a new sequence number; must be handed on before a plan is asked for."""

    def evaluated(self, occupancy_map: Any, evaluation: Any, utility: Any) -> None:
        """An evaluation of the map is there."""

    def decided(self, candidates: Candidates, chosen: int, step: Step) -> None:
        """Candidates were ranked; ``chosen`` is the index of the one to be executed, -1 for none."""

    def view_done(self, step: Step) -> None:
        """A view's scan is in the map and its figures are complete."""


@dataclass(frozen=True)
class Choice:
    """A view with a motion to it, and what it is worth [m^3] from where that ends; ``score`` is per cost."""

    plan: Plan
    candidates: Candidates
    gain_m3: float
    score: float


class Exploration:
    """One exploration of a bounded volume.

    :param occupancy_map: the one map, with what is known before the first scan.
    :param evaluator: incremental evaluation of that map (frontiers, voids, frontier-voids, utility).
    :param judge: expects what views will show, and remembers what scans have failed to show.
    :param chooser: makes and ranks candidate views.
    :param scan_config: ``ScanConfig`` of the sensor: range limits, and what a ray without return proves.
    """

    def __init__(
        self,
        occupancy_map: Any,
        evaluator: Any,
        judge: GainJudge,
        chooser: ViewChooser,
        scan_config: Any,
        robot: Robot,
        audience: Audience,
        config: ExploreConfig,
        seed: int = 0,
    ) -> None:
        self._map = occupancy_map
        self._evaluator = evaluator
        self._judge = judge
        self._chooser = chooser
        self._scan_config = scan_config
        self._robot = robot
        self._audience = audience
        self._config = config
        self._seed = seed
        self._views = 0  # places that were reached and scanned from
        self._decisions = 0
        self._failed_motions = 0
        self._failed_scans = 0
        self._joints: dict[str, float] = {}  # at the last scan
        self._seen_anything = False  # has any scan had a usable return?
        self._cut_short = ""  # why the last motion was not finished
        self._decision = Decision()  # what became of this decision's candidates

    def run(self, stop: Callable[[], bool] = lambda: False) -> Outcome:
        """Explore until something ends it; ``stop`` is asked between the steps and cancels."""
        try:
            return self._explore(stop)
        except ExplorationError as error:
            return self._outcome(Reason.CANCELLED if stop() else Reason.FAILED, str(error))

    def _explore(self, stop: Callable[[], bool]) -> Outcome:
        started_s = self._robot.now_s()
        step = Step()
        T_map_sensor = utility = None
        while True:
            scan = self._timed(step, "scan", "scanning", self._scan, stop)
            if scan is not None:
                T_map_sensor = scan.T_map_sensor
                self._timed(step, "integrate", "integrating the scan", self._integrate, scan, step)
                utility = self._timed(step, "evaluate", "evaluating the map", self._evaluate, step)
            elif utility is None:
                continue  # nothing has been seen yet: where else could the camera look?
            self._views = step.view
            self._audience.view_done(step)
            ended = self._budget_ended(started_s) or (stop() and Reason.CANCELLED)
            if ended is Reason.TIME_BUDGET and not self._views:
                return self._outcome(Reason.FAILED, self._unseen("the time budget was used up"))
            if ended:
                return self._outcome(ended)
            step = Step(view=self._views + 1, known_share=step.known_share, counts=step.counts)
            plan = self._next_motion(step, T_map_sensor, utility, stop)
            if plan is None:
                return self._outcome(Reason.CANCELLED) if stop() else self._nothing_left()
            self._timed(step, "move", "moving", self._move, plan, step)
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
            self._chooser.learn(0.0)
            return None
        self._failed_scans = 0
        return scan

    def _integrate(self, scan: Scan, step: Step) -> None:
        known_before = self._map.known_share()
        result = self._map.insert_scan(scan.points, scan.T_map_sensor, self._scan_config)
        self._note_returns(scan, result.counts)
        step.known_share = self._map.known_share()
        step.real_gain_m3 = (step.known_share - known_before) * self._map.volume_m3()
        self._judge.note(scan.points, scan.T_map_sensor, scan.joints)
        self._joints = dict(scan.joints)
        self._chooser.learn(step.real_gain_m3)
        self._audience.map_changed(self._map)

    def _note_returns(self, scan: Scan, counts: Mapping[str, int]) -> None:
        """Say so when the map could use no return of a scan, or when points lie where no sensor sees."""
        returns = Returns(self._scan_config)
        returns.add(scan.points, counts)
        problem = returns.problem()
        self._seen_anything |= not problem
        for text in [problem] if problem else returns.warnings():
            self._audience.warn(text)

    def _evaluate(self, step: Step) -> Any:
        evaluation = self._evaluator.update()
        utility = self._evaluator.utility(
            self._scan_config.max_range_m, max_rays=self._config.evaluation.utility_rays
        )
        step.counts = {
            **self._map.counts(),
            "frontier": len(evaluation.frontier),
            "void": len(evaluation.void),
            "ellipsoids": len(evaluation.ellipsoids),
            "frontier_clusters": len(np.unique(evaluation.frontier_cluster)),
        }
        self._audience.evaluated(self._map, evaluation, utility)
        return utility

    def _next_motion(
        self, step: Step, T_map_sensor: Array, utility: Any, stop: Callable[[], bool]
    ) -> Plan | None:
        """A planned motion to the best view that can be reached; None when there is nothing left to see or do."""
        seed = self._seed + self._decisions
        self._decisions += 1
        funnel = self._timed(
            step, "choose", "judging views", self._chooser.prepare, seed, T_map_sensor, utility
        )
        self._decision = Decision(funnel)
        choice = self._choose(step, stop)
        if choice is None or stop():
            self._audience.decided(self._chooser.shortlist(), -1, step)
            return None
        self._accept(choice, step)
        return choice.plan

    def _choose(self, step: Step, stop: Callable[[], bool]) -> Choice | None:
        """The best view that there is a motion to; None when there is none.

        What the robot itself would hide is known only from where a motion ends. So motions are planned, and the views
        they lead to judged, until none of those left promises much more than the best that was found.
        """
        best: Choice | None = None
        refused = planned = 0
        while refused < self._config.motion.max_rounds and not stop():
            candidates = self._timed(step, "choose", "choosing the next view", self._chooser.shortlist)
            if len(candidates) == 0 or (best and self._good_enough(best, candidates, planned)):
                break
            text = f"planning to {len(candidates)} views"
            plan = self._timed(step, "plan", text, self._plan, candidates, refused + planned)
            if plan.trajectory is None:
                refused += 1
                self._refuse(plan, candidates)
                if best:
                    break
                if plan.hopeless and not stop():
                    raise ExplorationError(f"the robot cannot move: {plan.message}")
                continue
            planned += 1
            choice = self._timed(step, "choose", "judging the view", self._judged, plan, candidates)
            if choice.gain_m3 < self._config.views.min_gain_m3:
                self._decision.hidden += 1
            elif not best or choice.score > best.score:
                best = choice
            self._chooser.leave_out(candidates.poses[plan.view])
        return best

    def _good_enough(self, best: Choice, left: Candidates, planned: int) -> bool:
        motion = self._config.motion
        return planned >= motion.max_plans or best.score >= motion.good_share * left.scores[0]

    def _judged(self, plan: Plan, candidates: Candidates) -> Choice:
        """The planned view with what it is worth at the joints where the motion ends."""
        gain_m3 = self._chooser.gain_at(candidates.poses[plan.view], {**self._joints, **plan.joints})
        before_m3 = float(candidates.gains[plan.view])
        return Choice(plan, candidates, gain_m3, float(candidates.scores[plan.view]) * gain_m3 / before_m3)

    def _refuse(self, plan: Plan, candidates: Candidates) -> None:
        self._decision.refused += len(candidates)
        self._decision.last_refusal = plan.message
        self._audience.activity(f"no motion to these views: {plan.message}")
        self._chooser.reject(candidates)

    def _plan(self, candidates: Candidates, attempt: int) -> Plan:
        seed = 1 + self._seed * 100_003 + (self._decisions - 1) * 101 + attempt
        return self._robot.plan(candidates.poses, candidates.scores, self._map.sequence, seed)

    def _accept(self, choice: Choice, step: Step) -> None:
        plan, candidates = choice.plan, choice.candidates
        step.expected_gain_m3 = choice.gain_m3
        step.path_length_rad = plan.path_length_rad
        step.duration_s = plan.duration_s
        step.joints = plan.joints
        self._chooser.expect(candidates.poses[plan.view], step.expected_gain_m3)
        self._audience.decided(candidates, plan.view, step)

    def _move(self, plan: Plan, step: Step) -> None:
        """Execute the plan. A motion that was not finished leads to no new view: the scan after it adds to the last."""
        problem = self._cut_short = self._robot.execute(plan)
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

    def _timed(self, step: Step, name: str, text: str, work: Callable[..., Any], *arguments: Any) -> Any:
        """Do the work, announce it, and add its wall time to the step."""
        self._audience.activity(text)
        start = time.perf_counter()
        try:
            return work(*arguments)
        finally:
            step.seconds[name] = step.seconds.get(name, 0.0) + time.perf_counter() - start

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
