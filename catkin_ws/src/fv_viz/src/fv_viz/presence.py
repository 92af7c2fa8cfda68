"""What the marker node has drawn, from the newest messages: pictures wait for it, and legends list nothing else."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from typing import Any

# layer -> the field of fv_msgs/Evaluation that it shows
FIELDS = {
    "occupied": "occupied",
    "free": "free",
    "frontier": "frontier",
    "frontier_clusters": "frontier",
    "void": "void",
    "initial_ellipsoids": "initial_ellipsoids",
    "ellipsoids": "ellipsoids",
    "frontier_voids": "frontier_voids",
    "utility": "utility_points",
}


def filled(messages: Mapping[str, Any]) -> set[str]:
    """Names of legend lines whose layer is not empty.

    messages: the newest of each source, "evaluation" or one of viz_node.SOURCES.
    """
    evaluation, volume = messages.get("evaluation"), messages.get("volume")
    views, path = (None if is_stale(messages, name) else messages.get(name) for name in ("views", "path"))
    contacts = messages.get("contacts")
    shown = {
        **{
            name: evaluation is not None and len(getattr(evaluation, field)) for name, field in FIELDS.items()
        },
        "unknown": evaluation is not None and volume is not None,
        "views": views is not None and len(views.views),
        "chosen_view": views is not None and 0 <= views.chosen < len(views.views),
        "path": path is not None and (len(path.tip_poses) or len(path.trajectory.points)),
        "volume": volume is not None,
        "clearance": volume is not None and (len(volume.clearance_boxes) or len(volume.clearance_centers)),
        "contacts": contacts is not None and len(contacts.pairs),
    }
    return {name for name, is_there in shown.items() if is_there}


def is_stale(messages: Mapping[str, Any], source: str) -> bool:
    """Whether a decision or a path is older than the newest evaluation: the view it led to has been taken.

    A message or evaluation without a stamp is never called old.
    """
    message, evaluation = messages.get(source), messages.get("evaluation")
    if source not in ("views", "path") or message is None or evaluation is None:
        return False
    stamp = message.header.stamp
    return not stamp.is_zero() and stamp < evaluation.header.stamp


@dataclasses.dataclass(frozen=True)
class State:
    """What markers are out: of which map, of which decision (its stamp [ns]), and which layers are not empty."""

    map_sequence: int = 0
    views_ns: int = 0
    filled: frozenset[str] = frozenset()

    @classmethod
    def of(cls, messages: Mapping[str, Any]) -> State:
        """The state after these messages have been drawn."""
        evaluation, views = messages.get("evaluation"), messages.get("views")
        sequence = 0 if evaluation is None else int(evaluation.map_sequence)
        return cls(
            sequence, 0 if views is None else views.header.stamp.to_nsec(), frozenset(filled(messages))
        )

    @classmethod
    def from_text(cls, text: str) -> State:
        """The inverse of to_text."""
        values = json.loads(text)
        return cls(**{**values, "filled": frozenset(values["filled"])})

    def to_text(self) -> str:
        """As JSON, for a std_msgs/String."""
        return json.dumps({**dataclasses.asdict(self), "filled": sorted(self.filled)})

    def topics(self) -> list[str]:
        """Topics of the layers that are not empty."""
        return [f"/fv_viz/{name}" for name in sorted(self.filled)]
