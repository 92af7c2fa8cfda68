"""How an exploration ended, in words. Where no view was reached it is a failure, and the words say of what."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field

from fv_exploration.strategy.ranking import Funnel

SEEN_SHARE = 0.9
"""A volume that is known to this share may be called explored without a view that was moved to, or without a return."""


class Reason(enum.Enum):
    """Why an exploration ended."""

    COMPLETE = "nothing left whose expected gain and reachability pass the thresholds"
    VIEW_BUDGET = "the view budget is used up"
    TIME_BUDGET = "the time budget is used up"
    CANCELLED = "it was cancelled"
    FAILED = "it failed"


@dataclass(frozen=True)
class Outcome:
    """How an exploration ended.

    :param views: places that were reached and scanned from.
    :param error: what ended it, if an error did.
    """

    reason: Reason
    message: str
    views: int
    known_share: float
    error: Exception | None = None


@dataclass
class Decision:
    """What became of the candidates of one decision.

    :param refused: views that the planner found no motion to, in ``refusals`` answers; ``last_refusal`` are its words.
    :param hidden: views with a motion that are worth too little where it ends.
    """

    funnel: Funnel = field(default_factory=Funnel)
    refused: int = 0
    last_refusal: str = ""
    hidden: int = 0


def nothing_left(
    decision: Decision, views: int, known_share: float, min_gain_m3: float
) -> tuple[Reason, str]:
    """Reason and message when a decision ends without a motion.

    After at least one view that is the ordinary end. Before, it is one only when the planner was never refused and the
    first scan has shown (nearly) all; else the robot has not explored, and the message says what held it.
    """
    if views:
        return Reason.COMPLETE, Reason.COMPLETE.value + _left_over(decision)
    why = _obstacle(decision, min_gain_m3)
    share = f"{100 * known_share:.1f} % of the volume are known"
    if not decision.refused and decision.funnel.reachable and known_share >= SEEN_SHARE:
        return Reason.COMPLETE, f"the first scan has shown it all: {share}, and {why}"
    return Reason.FAILED, f"{why} ({share})"


def _left_over(decision: Decision) -> str:
    if not decision.refused:
        return ""
    return (
        f"; the planner found no motion to the {decision.refused} best views that were left: "
        f"{decision.last_refusal}"
    )


def _obstacle(decision: Decision, min_gain_m3: float) -> str:
    """Which sieve held the last of the candidates back."""
    funnel = decision.funnel
    if not funnel.proposed:
        return "there was no candidate view at all, neither of the arm's reach nor by utility"
    if not funnel.in_free_space:
        return (
            f"none of {funnel.proposed} candidate views lies in known free space; the bounds may lie where the camera "
            "does not look or the arm does not reach, or its scans return nothing"
        )
    if not funnel.reachable:
        return (
            f"none of {funnel.in_free_space} candidate views in free space can be held by the arm; the bounds may lie "
            "out of its reach, or views/min_reachability is too high"
        )
    if not funnel.worth_it:
        return (
            f"none of {funnel.reachable} views that can be held is expected to show {min_gain_m3:g} m^3 or more anew "
            "(views/min_gain_m3)"
        )
    parts = []
    if not decision.refused and not decision.hidden:
        parts.append("the planner has refused all views before that are worth a motion")
    if decision.refused:
        parts.append(
            f"the planner found no motion to any of {decision.refused} views: {decision.last_refusal}"
        )
    if decision.hidden:
        parts.append(
            f"{decision.hidden} views with a motion are worth less than {min_gain_m3:g} m^3 where it ends: the robot "
            "itself would hide what they show"
        )
    return "; ".join(parts)
