"""Tables of the report: every view, the map in numbers, what the comparison with the true scene found."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from itertools import groupby
from typing import Any

import numpy as np

from fv_viz.report.markup import Number, figure, is_number, shown, table, text
from fv_viz.report.run_data import TIMES, RunData

Form = Callable[[float], str]


@dataclasses.dataclass(frozen=True)
class Column:
    """A column of metrics.csv in the table of all views: its group, its words, and how its values are written."""

    name: str
    group: str
    words: str
    form: Form


def _digits(count: int) -> Form:
    return lambda value: f"{value:,.{count}f}"


def _seconds(value: float) -> str:
    return f"{value:.2f}" if value < 99.995 else f"{value:.0f}"


def _thousands(value: float) -> str:
    return f"{value / 1000.0:,.1f}"


def percent(share: float) -> str:
    """A share in 0..1 as per cent, without unit."""
    return f"{100.0 * share:.1f}"


SHORT = {"screenshot": "picture"}
COLUMNS = (
    Column("view", "", "view", _digits(0)),
    Column("explored_share", "share [%]", "explored", percent),
    Column("known_share", "share [%]", "known", percent),
    Column("expected_gain_m3", "gain [m³]", "expected worth", _digits(3)),
    Column("real_gain_m3", "gain [m³]", "newly known", _digits(3)),
    Column("path_length_rad", "motion", "path [rad]", _digits(2)),
    Column("duration_s", "motion", "planned [s]", _seconds),
    Column("contacts", "motion", "contact steps", _digits(0)),
    Column("sim_s", "time [s]", "sim", _digits(0)),
    Column("wall_s", "time [s]", "wall", _digits(0)),
    *(Column(f"{name}_s", "wall time of each step [s]", SHORT.get(name, name), _seconds) for name in TIMES),
    *(
        Column(name, "thousand voxels", name, _thousands)
        for name in ("occupied", "free", "unknown", "frontier", "void")
    ),
    Column("ellipsoids", "number of", "void clusters", _digits(0)),
    Column("frontier_clusters", "number of", "frontier clusters", _digits(0)),
)
# What the comparison with the true scene found, in words; other keys are shown as they are.
TRUTH = {
    "free_in_solid_share": "free voxels deeper than a voxel inside solids",
    "occupied_far_share": "occupied voxels away from any surface",
    "explored_share": "explored of what the camera can observe at all",
}


def duration(seconds: float) -> str:
    """Seconds as people write them."""
    return f"{seconds:.0f} s" if seconds < 120 else f"{int(seconds // 60)} min {int(seconds % 60)} s"


def every_view(data: RunData) -> str:
    """All of metrics.csv that has numbers, grouped, with its heading."""
    known = {column.name for column in COLUMNS}
    others = (Column(name, "other", name, shown) for name in data.columns if name not in known)
    wanted = [c for c in (*COLUMNS, *others) if np.isfinite(data.column(c.name)).any()]
    if not wanted:
        return ""
    groups = [(group, len(list(members))) for group, members in groupby(wanted, lambda c: c.group)]
    first = "".join(f'<th class="group" colspan="{count}">{text(group)}</th>' for group, count in groups)
    second = "".join(f'<th class="number">{text(column.words)}</th>' for column in wanted)
    columns = [[_formed(c, value) for value in data.column(c.name).tolist()] for c in wanted]
    body = "".join(f"<tr>{''.join(row)}</tr>" for row in zip(*columns, strict=True))
    head = f"<thead><tr>{first}</tr><tr>{second}</tr></thead>"
    return f'<h2>Every view</h2><div class="dense scroll"><table>{head}{body}</table></div>'


def voxels(data: RunData) -> str:
    """How many voxels of each class the map has, and their volume."""
    if not data.points:
        return ""
    rows, volume = [], _volume_m3(data.run)
    for name, points in data.points.items():
        size_m3 = len(points) * data.resolution**3
        share = f"{percent(size_m3 / volume)} %" if volume else "–"
        rows.append([name, float(len(points)), Number(f"{size_m3:.3f} m³"), Number(share)])
    return figure("Voxels", table(rows, ["class", "voxels", "volume", "of the exploration volume"]))


def facts(data: RunData) -> str:
    """The volume, and what the comparison with the true scene found."""
    run, rows = data.run, []
    if is_number(run.get("resolution_m")):
        rows.append(["edge of a voxel", f"{100 * run['resolution_m']:g} cm"])
    if _volume_m3(run):
        rows.append(["exploration volume", _box(run["bounds_min"], run["bounds_max"])])
    for name, value in data.truth.items():
        if name not in data.points and not name.startswith(
            "observable_"
        ):  # counts of voxels stand beside this
            rows.append([TRUTH.get(name, name.replace("_", " ")), _share(value)])
    if is_number(data.truth.get("observable_samples")):
        verdict = "more of them found nothing new" if data.settled else "more of them would have found more"
        words = f"{shown(data.truth['observable_samples'])} sampled views; {verdict}"
        rows.append(["what the camera can observe was found by", words])
    return figure("The volume, and the map against the true scene", table(rows)) if rows else ""


def _formed(column: Column, value: float) -> str:
    return f'<td class="number">{"–" if value != value else text(column.form(value))}</td>'


def _volume_m3(run: dict[str, Any]) -> float:
    """Size of the exploration volume; 0 when the run does not say it."""
    try:
        sides = np.subtract(run["bounds_max"], run["bounds_min"], dtype=float)
    except (KeyError, TypeError, ValueError):
        return 0.0
    return float(np.prod(sides)) if sides.shape == (3,) and (sides > 0.0).all() else 0.0


def _box(low: list[float], high: list[float]) -> str:
    sides = " × ".join(f"{b - a:g}" for a, b in zip(low, high, strict=True))
    ends = " to ".join(f"({', '.join(f'{k:g}' for k in corner)})" for corner in (low, high))
    return f"{sides} m, from {ends}"


def _share(value: Any) -> str:
    if is_number(value) and 0.0 <= value <= 1.0:
        return f"{100 * value:.3g} %"
    return json.dumps(value) if isinstance(value, (dict, list)) else shown(value)
