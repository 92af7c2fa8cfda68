"""One page about several runs: coverage with its spread, and tables."""

from __future__ import annotations

from typing import Any

import numpy as np

from fv_viz.report import charts
from fv_viz.report.markup import Number, figure, is_number, page, table, text
from fv_viz.report.page import explored_words
from fv_viz.report.run_data import TIMES, RunData
from fv_viz.report.tables import duration, percent

SUMMARY = (
    "run",
    "case",
    "ended",
    "views",
    "explored",
    "known",
    "contacts",
    "wall time",
    "simulated",
    "voxel",
)
ENDED = {  # words for run.json's result where a table has little room
    "COMPLETE": "nothing left",
    "VIEW_BUDGET": "budget of views",
    "TIME_BUDGET": "budget of time",
    "CANCELLED": "cancelled",
    "FAILED": "failed",
}
USED = ("run.json", "metrics.csv")  # of a run's files


def comparison(runs: list[RunData]) -> str:
    """The whole page as HTML text; runs of one case (see grouped) count as its repetitions."""
    cases = grouped(runs)
    names = _names(runs)
    parts = [
        f"<h1>{_count(len(runs), 'exploration')} compared</h1>",
        f'<p class="soft">{text(_sizes(cases))}. {_what_lines_are(cases)}</p>',
        *_warnings(runs, names),
        '<div class="charts">',
        figure(
            "Explored share over views",
            _spread(cases, "explored_share", 100.0, "share of the observable [%]", 100.0),
        ),
        figure(
            "Known share over views", _spread(cases, "known_share", 100.0, "share of the volume [%]", 100.0)
        ),
        figure("Volume that each view made known", _spread(cases, "real_gain_m3", 1.0, "newly known [m³]")),
        figure("Motion to each view", _spread(cases, "path_length_rad", 1.0, "path in joint space [rad]")),
        "</div><h2>Every run</h2>",
        table(
            [
                [name, case, *_summary(run)]
                for name, case, run in zip(names, case_names(runs), runs, strict=True)
            ],
            SUMMARY,
        ),
        "<h2>Mean wall time of each step of a view [s]</h2>",
        table([[name, *_means(run)] for name, run in zip(names, runs, strict=True)], ["run", *TIMES]),
    ]
    return page("Explorations compared", parts)


def grouped(runs: list[RunData]) -> dict[str, list[RunData]]:
    """Runs by world and robot, and by the size of voxels where it differs, in order of appearance."""
    cases: dict[str, list[RunData]] = {}
    for name, run in zip(case_names(runs), runs, strict=True):
        cases.setdefault(name, []).append(run)
    return cases


def case_names(runs: list[RunData]) -> list[str]:
    """The case of each run: shares of maps with other voxels are no repetition of a case."""
    names, sizes = [_case(run) for run in runs], [_voxel(run) for run in runs]
    several = {name for name in names if len({s for n, s in zip(names, sizes, strict=True) if n == name}) > 1}
    return [f"{n}, {s}" if n in several else n for n, s in zip(names, sizes, strict=True)]


def _voxel(run: RunData) -> str:
    size = run.run.get("resolution_m")
    return f"{100 * size:g} cm" if is_number(size) else "–"


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


def _names(runs: list[RunData]) -> list[str]:
    """Folders' names, with as many parents as tell them apart."""
    paths = [run.folder.resolve().parts for run in runs]
    for length in range(1, max(map(len, paths)) + 1):
        names = ["/".join(parts[-length:]) for parts in paths]
        if len(set(names)) == len(set(paths)):
            break
    return names


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _sizes(cases: dict[str, list[RunData]]) -> str:
    return "; ".join(f"{name}: {_count(len(members), 'run')}" for name, members in cases.items())


def _what_lines_are(cases: dict[str, list[RunData]]) -> str:
    if all(len(members) == 1 for members in cases.values()):
        return "Each line is one run."
    return (
        "Each line is the median of a case's runs, its band reaches from the smallest to the largest. A run that has "
        "ended keeps its last share."
    )


def _warnings(runs: list[RunData], names: list[str]) -> list[str]:
    """What is missing, and whose explored shares are upper bounds."""
    out = []
    for run, name in zip(runs, names, strict=True):
        missing = [line for line in run.missing if line.startswith(USED)]
        if missing:
            out.append(f'<p class="warn">{text(name)}: {text("; ".join(missing))}.</p>')
    bounds = [name for run, name in zip(runs, names, strict=True) if not run.settled]
    if bounds:
        out.append(
            f'<p class="warn">Explored shares of {text(", ".join(bounds))} are upper bounds: what the camera can '
            "observe there was still growing when the search for it ended.</p>"
        )
    return out


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
    """The cells of SUMMARY behind name and case."""
    said = run.run
    result = str(said.get("result", "–"))

    def number(key: str, form) -> Number:
        return Number(form(said[key]) if is_number(said.get(key)) else "–")

    return [
        ENDED.get(result, result),
        number("views", lambda v: f"{v:g}"),
        number("explored_share", lambda _: explored_words(run)),
        number("known_share", lambda v: f"{percent(v)} %"),
        number("contacts", lambda v: f"{v:,g}"),
        number("wall_s", duration),
        number("sim_s", duration),
        Number(_voxel(run)),
    ]


def _means(run: RunData) -> list[Number]:
    means = []
    for name in TIMES:
        values = run.column(f"{name}_s")
        means.append(Number(f"{np.nanmean(values):.3f}" if np.isfinite(values).any() else "–"))
    return means
