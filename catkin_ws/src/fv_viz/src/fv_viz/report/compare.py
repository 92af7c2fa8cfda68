"""One page about several runs: coverage with its spread, and tables."""

from __future__ import annotations

from typing import Any

import numpy as np

from fv_viz.report import charts
from fv_viz.report.page import figure, page, table
from fv_viz.report.run_data import TIMES, RunData

KEYS = ("result", "views", "explored_share", "contacts", "wall_s", "sim_s", "resolution_m")


def comparison(runs: list[RunData]) -> str:
    """The whole page as HTML text; runs of the same world and robot count as repetitions of one case."""
    cases = grouped(runs)
    names = [run.folder.name for run in runs]
    parts = [
        f"<h1>{len(runs)} explorations compared</h1>",
        f'<p class="soft">{", ".join(f"{name}: {len(members)} runs" for name, members in cases.items())}. '
        "Lines are medians of a case, bands reach from its smallest to its largest run.</p>",
        *[f'<p class="warn">{run.folder.name}: {"; ".join(run.missing)}</p>' for run in runs if run.missing],
        '<div class="charts">',
        figure(
            "Explored share over views",
            _spread(cases, "explored_share", 100.0, "share of the observable [%]", 100.0),
        ),
        figure(
            "Known share over views", _spread(cases, "known_share", 100.0, "share of the volume [%]", 100.0)
        ),
        figure("Real gain of each view", _spread(cases, "real_gain_m3", 1.0, "newly known volume [m³]")),
        figure("Path length of each view", _spread(cases, "path_length_rad", 1.0, "path [rad]")),
        "</div><h2>Every run</h2>",
        table(
            [[name, *_summary(run)] for name, run in zip(names, runs, strict=True)],
            ["run", "case", *(key.replace("_", " ") for key in KEYS)],
        ),
        "<h2>Mean seconds of a view</h2>",
        table([[name, *_means(run)] for name, run in zip(names, runs, strict=True)], ["run", *TIMES]),
    ]
    return page("Explorations compared", parts)


def grouped(runs: list[RunData]) -> dict[str, list[RunData]]:
    """Runs by world and robot, in order of appearance."""
    cases: dict[str, list[RunData]] = {}
    for run in runs:
        cases.setdefault(_case(run), []).append(run)
    return cases


def spread(runs: list[RunData], name: str) -> tuple[np.ndarray, np.ndarray]:
    """Views (V,) and values (R, V) of a column; a run that ended earlier keeps its last share, and NaN for the rest.

    Views are numbered as in metrics.csv, from 1 where it does not number them.
    """
    columns = [run.column(name) for run in runs]
    length = max(map(len, columns), default=0)
    values = np.full((len(runs), length), np.nan)
    for row, column in zip(values, columns, strict=True):
        row[: len(column)] = column
        if name.endswith("_share") and len(column):
            row[len(column) :] = column[-1]
    begins = [run.column("view")[0] for run in runs if len(run.column("view"))]
    first = int(np.nanmin(begins)) if np.isfinite(begins).any() else 1
    return np.arange(first, first + length), values


def _case(run: RunData) -> str:
    known = [str(run.run[key]) for key in ("world", "robot") if key in run.run]
    return ", ".join(known) or "unnamed"


def _spread(
    cases: dict[str, list[RunData]], name: str, factor: float, label: str, top: float | None = None
) -> str:
    series = []
    for case, runs in cases.items():
        views, values = spread(runs, name)
        valid = np.isfinite(values).any(axis=0) if len(views) else np.zeros(0, bool)
        if valid.any():
            values = factor * values[:, valid]
            low, middle, high = (one(values, axis=0) for one in (np.nanmin, np.nanmedian, np.nanmax))
            series.append(charts.Series(case, views[valid].astype(float), middle, low, high))
    return charts.lines(series, "view", label, top)


def _summary(run: RunData) -> list[Any]:
    return [_case(run), *[run.run.get(key, float("nan")) for key in KEYS]]


def _means(run: RunData) -> list[float]:
    means = []
    for name in TIMES:
        values = run.column(f"{name}_s")
        means.append(float(np.nanmean(values)) if np.isfinite(values).any() else float("nan"))
    return means
