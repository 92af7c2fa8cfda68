"""Assembly of report.html."""

from __future__ import annotations

import html
import json
from collections.abc import Iterable
from importlib import resources
from typing import Any

import numpy as np

from fv_viz.report import charts, media
from fv_viz.report.run_data import TIMES, RunData
from fv_viz.report.scene import scene

# What the comparison with the true scene found, in words; other keys are shown as they are.
TRUTH = {
    "free_in_solid_share": "free voxels deeper than a voxel inside solids",
    "occupied_far_share": "occupied voxels away from any surface",
    "explored_share": "explored of what the camera can observe at all",
    "observable_samples": "views tried to find what can be observed",
    "observable_settled": "more of them would have found no more",
}
OPEN_ALL = """
const closed = () => document.querySelectorAll("details:not([open])");
addEventListener("beforeprint", () => closed().forEach((one) => { one.open = one.dataset.printed = true; }));
addEventListener("afterprint", () => document.querySelectorAll("[data-printed]").forEach((one) => {
  one.open = false; delete one.dataset.printed; }));
"""
RESULTS = {
    "COMPLETE": "ended by itself: nothing worth seeing is left within reach",
    "VIEW_BUDGET": "ended because its budget of views was used up",
    "TIME_BUDGET": "ended because its time was used up",
    "CANCELLED": "was cancelled",
    "FAILED": "failed",
}


def report(data: RunData) -> str:
    """The whole page as HTML text."""
    parts = [
        f"<h1>Exploration: {_text(data.name)}</h1>",
        f'<p class="lead">{_text(outcome(data))}</p>',
        _missing(data),
        _tiles(data),
        media.scene(data),
        media.strip(data),
        _scene(data),
        _charts(data),
        _views_table(data),
        _statistics(data),
        _details(data),
        f"<script>{OPEN_ALL}</script>",
    ]
    return page(f"Exploration: {data.name}", parts)


def page(title: str, parts: Iterable[str]) -> str:
    """HTML document with the house's style sheet inside."""
    style = resources.files(__package__).joinpath("page.css").read_text()
    head = f'<meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{_text(title)}</title>'
    head = f'<head>{head}<link rel="icon" href="data:,"><style>{style}</style></head>'
    return f'<!DOCTYPE html>\n<html lang="en">{head}<body>{"".join(parts)}</body></html>\n'


def outcome(data: RunData) -> str:
    """What happened, in one sentence, from whatever is known of it."""
    run, views = data.run, data.run.get("views", len(data.column("view")) or None)
    fate = RESULTS.get(
        str(run.get("result")), f"ended with {run['result']}" if "result" in run else "left no result"
    )
    if run.get("reason"):
        fate += f" ({str(run['reason']).rstrip('.')})"
    gained = []
    if _is_number(run.get("explored_share")):
        gained.append(f"{100 * run['explored_share']:.1f} % of what the camera can observe is explored")
    if _is_number(run.get("contacts")):
        count = int(run["contacts"])
        gained.append(
            "nothing was touched" if count == 0 else f"something was touched in {count} physics steps"
        )
    after = "The" if views is None else f"After {views} view{'' if views == 1 else 's'} the"
    return f"{after} exploration {fate}{'; ' if gained else ''}{' and '.join(gained)}."


def table(rows: Iterable[Iterable[Any]], header: Iterable[str] = ()) -> str:
    """An HTML table; numbers are set right."""
    rows, header = [list(row) for row in rows], list(header)
    kinds = [_kind(value) for value in rows[0]] if rows else [""] * len(header)
    head = "".join(f"<th{kind}>{_text(name)}</th>" for name, kind in zip(header, kinds, strict=False))
    body = "".join("<tr>" + "".join(_cell(value) for value in row) + "</tr>" for row in rows)
    head = f"<thead><tr>{head}</tr></thead>" if head else ""
    return f'<div class="scroll"><table>{head}{body}</table></div>'


def figure(title: str, content: str) -> str:
    """A titled figure; empty text stays empty."""
    return f"<figure><figcaption>{_text(title)}</figcaption>{content}</figure>" if content else ""


def shown(value: Any) -> str:
    """A value as people write it."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return str(value)
    if value != value:
        return "–"
    return f"{int(value):,}" if float(value).is_integer() and abs(value) < 1e15 else f"{value:.4g}"


def _text(value: Any) -> str:
    return html.escape(str(value))


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and value == value


def _cell(value: Any) -> str:
    return f"<td{_kind(value)}>{_text(shown(value))}</td>"


def _kind(value: Any) -> str:
    return ' class="number"' if _is_number(value) or value != value else ""


def _missing(data: RunData) -> str:
    if not data.missing:
        return ""
    return f'<p class="warn">Not everything of this run was found: {_text("; ".join(data.missing))}.</p>'


def _tiles(data: RunData) -> str:
    run, tiles = data.run, []
    for key, label, form in (
        ("explored_share", "explored of the observable", lambda v: f"{100 * v:.1f} %"),
        ("known_share", "known of the whole volume", lambda v: f"{100 * v:.1f} %"),
        ("views", "views", lambda v: f"{v:g}"),
        ("wall_s", "wall time", _duration),
        ("sim_s", "simulated time", _duration),
        ("contacts", "steps in contact", lambda v: f"{v:g}"),
    ):
        if _is_number(run.get(key)):
            tiles.append(f'<div class="tile"><b>{form(run[key])}</b><span>{label}</span></div>')
    return f'<div class="tiles">{"".join(tiles)}</div>'


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 120 else f"{int(seconds // 60)} min {int(seconds % 60)} s"


def _scene(data: RunData) -> str:
    content = scene(data)
    if content is None:
        return ""
    script = resources.files(__package__).joinpath("scene3d.js").read_text()
    packed = json.dumps(content, separators=(",", ":")).replace("</", "<\\/")
    last = int(data.since["view"].max()) if data.since and data.since["view"].size else 0
    sliders = (
        '<label>cut off above <input id="scene-cut" type="range"> <span id="scene-cut-text"></span></label>'
    )
    if last > 0:
        sliders += (
            f'<label>the map <input id="scene-slider" type="range" min="0" max="{last}" value="{last}"> '
            f'<span id="scene-slider-text">after view {last}</span></label>'
        )
    return (
        '<h2>The map in 3D</h2><p class="soft noprint" id="scene-note">Drag to turn, wheel to zoom, '
        "shift and drag to move, double click to start again.</p>"
        '<canvas id="scene"></canvas><div id="scene-controls" class="keys"></div>'
        f'<div class="keys noprint">{sliders}</div>'
        f'<script type="application/json" id="scene-data">{packed}</script><script>{script}</script>'
    )


def _charts(data: RunData) -> str:
    if not data.columns:
        return ""
    view, wall = data.column("view"), data.column("wall_s")
    shares = [
        ("explored of the observable", 100 * data.column("explored_share")),
        ("known of the whole volume", 100 * data.column("known_share")),
    ]
    gains = [("expected", data.column("expected_gain_m3")), ("real", data.column("real_gain_m3"))]
    counts = [(name, data.column(name)) for name in ("occupied", "free", "unknown", "frontier", "void")]
    steps = {name: data.column(f"{name}_s") for name in TIMES}
    figures = [
        figure("Coverage over views", charts.lines(_series(shares, view), "view", "share [%]", 100.0)),
        figure(
            "Coverage over time", charts.lines(_series(shares, wall), "wall time [s]", "share [%]", 100.0)
        ),
        figure("Gain of each view", charts.lines(_series(gains, view), "view", "newly known volume [m³]")),
        figure("Time per step", charts.stacked_bars(view, steps, "view", "wall time [s]")),
        figure("Voxels of each class", charts.lines(_series(counts, view), "view", "voxels")),
    ]
    return f'<h2>Coverage, gain and time</h2><div class="charts">{"".join(figures)}</div>'


def _series(named: list[tuple[str, np.ndarray]], x: np.ndarray) -> list[charts.Series]:
    return [charts.Series(name, x, y) for name, y in named]


def _views_table(data: RunData) -> str:
    if not data.columns:
        return ""
    names = [name for name, values in data.columns.items() if np.isfinite(values).any()]
    columns = [[_short(value) for value in data.columns[name].tolist()] for name in names]
    rows = zip(*columns, strict=True)
    words = [name.replace("_", " ") for name in names]
    return f'<h2>Every view</h2><div class="dense">{table(rows, words)}</div>'


def _short(value: float) -> float:
    """Three digits are enough where columns are many."""
    return value if value != value or value.is_integer() else float(f"{value:.3g}")


def _statistics(data: RunData) -> str:
    rows = [
        [f"{name} voxels", len(points), f"{len(points) * data.resolution**3:.3f} m³"]
        for name, points in data.points.items()
    ]
    run = data.run
    if _is_number(run.get("resolution_m")):
        rows.append(["edge of a voxel", f"{100 * run['resolution_m']:g} cm", ""])
    if "bounds_min" in run and "bounds_max" in run:
        rows.append(["exploration volume", f"{run['bounds_min']} to {run['bounds_max']} m", ""])
    truth = run.get("truth")
    for name, value in truth.items() if isinstance(truth, dict) else ():
        if name not in data.points:  # its counts of voxels are those above
            words = TRUTH.get(name, name.replace("_", " "))
            rows.append([f"against the true scene: {words}", _share(value), ""])
    return f"<h2>The map in numbers</h2>{table(rows)}" if rows else ""


def _share(value: Any) -> str:
    if _is_number(value) and 0.0 <= value <= 1.0:
        return f"{100 * value:.3g} %"
    return json.dumps(value) if isinstance(value, (dict, list)) else shown(value)


def _details(data: RunData) -> str:
    out = []
    for key, title in (("config", "Configuration"), ("versions", "Versions")):
        if key in data.run:
            text = _text(json.dumps(data.run[key], indent=2, sort_keys=True))
            out.append(f"<details><summary>{title}</summary><pre>{text}</pre></details>")
    return f"<h2>How it was run</h2>{''.join(out)}" if out else ""
