"""Assembly of report.html."""

from __future__ import annotations

import json
from importlib import resources
from typing import Any

import numpy as np

from fv_viz.report import charts, media, tables
from fv_viz.report.markup import figure, is_number, page, shown, text
from fv_viz.report.run_data import TIMES, RunData
from fv_viz.report.scene import scene

OPEN_ALL = """
const closed = () => document.querySelectorAll("details:not([open])");
addEventListener("beforeprint", () => closed().forEach((one) => { one.open = one.dataset.printed = true; }));
addEventListener("afterprint", () => document.querySelectorAll("[data-printed]").forEach((one) => {
  one.open = false; delete one.dataset.printed; }));
"""
# How it ended, and why when run.json does not say it.
RESULTS = {
    "COMPLETE": ("ended by itself", "nothing worth seeing is left within reach"),
    "VIEW_BUDGET": ("ended", "its budget of views was used up"),
    "TIME_BUDGET": ("ended", "its time was used up"),
    "CANCELLED": ("ended", "it was cancelled"),
    "FAILED": ("failed", ""),
}
UPPER_BOUND = (
    "The explored share is an upper bound: what the camera can observe at all was still growing after {samples} "
    "sampled views of the true scene, so there is more to see than the share is measured by."
)


def report(data: RunData) -> str:
    """The whole page as HTML text."""
    parts = [
        f"<h1>Exploration: {text(data.name)}</h1>",
        f'<p class="lead">{text(outcome(data))}</p>',
        _missing(data),
        _warnings(data),
        _tiles(data),
        upper_bound_note(data),
        media.scene(data),
        media.strip(data),
        _scene(data),
        _charts(data),
        tables.every_view(data),
        _statistics(data),
        _details(data),
        f"<script>{OPEN_ALL}</script>",
    ]
    return page(f"Exploration: {data.name}", parts)


def outcome(data: RunData) -> str:
    """What happened, in one sentence, from whatever is known of it."""
    run, views = data.run, data.run.get("views", len(data.column("view")) or None)
    gained = []
    if is_number(run.get("explored_share")):
        gained.append(f"{explored_words(data)} of what the camera can observe is explored")
    if is_number(run.get("contacts")):
        count = int(run["contacts"])
        steps = f"{count} physics step{'' if count == 1 else 's'}"
        gained.append("nothing was touched" if count == 0 else f"something was touched in {steps}")
    after = "The" if views is None else f"After {views} view{'' if views == 1 else 's'} the"
    return f"{after} exploration {_fate(run)}{'; ' if gained else ''}{' and '.join(gained)}."


def _fate(run: dict[str, Any]) -> str:
    """How it ended and why, told once."""
    if "result" not in run:
        return "left no result"
    fate, why = RESULTS.get(str(run["result"]), (f"ended with {run['result']}", ""))
    why = str(run.get("reason") or why).rstrip(".")
    return f"{fate}: {why}" if why else fate


def explored_words(data: RunData) -> str:
    """The explored share as people write it; an upper bound is called one."""
    bound = "" if data.settled else "at most "
    return f"{bound}{100 * data.run['explored_share']:.1f}\u00a0%"


def upper_bound_note(data: RunData) -> str:
    """A paragraph that says why an explored share is only an upper bound; empty when it is not."""
    if data.settled:
        return ""
    samples = data.truth.get("observable_samples")
    return f'<p class="warn">{UPPER_BOUND.format(samples=shown(samples) if samples else "all")}</p>'


def _missing(data: RunData) -> str:
    if not data.missing:
        return ""
    return f'<p class="warn">Not everything of this run was found: {text("; ".join(data.missing))}.</p>'


def _warnings(data: RunData) -> str:
    """What was left out, replaced or is likely to be wrong, as run.json lists it."""
    warnings = data.run.get("warnings")
    if not isinstance(warnings, list) or not warnings:
        return ""
    items = "".join(f"<li>{text(line)}</li>" for line in warnings)
    return f'<div class="warn">Warnings of this run:<ul>{items}</ul></div>'


def _tiles(data: RunData) -> str:
    run, tiles = data.run, []
    bound = "" if data.settled else "≤ "
    for key, label, form in (
        ("explored_share", "explored of the observable", lambda v: f"{bound}{100 * v:.1f} %"),
        ("known_share", "known of the whole volume", lambda v: f"{100 * v:.1f} %"),
        ("views", "views", lambda v: f"{v:g}"),
        ("wall_s", "wall time", tables.duration),
        ("sim_s", "simulated time", tables.duration),
        ("contacts", "steps in contact", lambda v: f"{v:g}"),
    ):
        if is_number(run.get(key)):
            tiles.append(f'<div class="tile"><b>{form(run[key])}</b><span>{label}</span></div>')
    return f'<div class="tiles">{"".join(tiles)}</div>'


def _scene(data: RunData) -> str:
    content = scene(data)
    if content is None:
        return ""
    script = resources.files(__package__).joinpath("scene3d.js").read_text()
    packed = json.dumps(content, separators=(",", ":")).replace("</", "<\\/")
    last = int(data.since["view"].max()) if data.since and data.since["view"].size else 0
    last = max(last, len(data.poses)) if last else 0  # the last views may have shown nothing new
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
    gains = [
        ("expected worth", _of_chosen(data, "expected_gain_m3")),
        ("newly known volume", data.column("real_gain_m3")),
    ]
    counts = [(name, data.column(name)) for name in ("occupied", "free", "unknown", "frontier", "void")]
    motions = [("length of the path", _of_chosen(data, "path_length_rad"))]
    steps = {name: data.column(f"{name}_s") for name in TIMES}
    figures = [
        figure("Coverage over views", charts.lines(_series(shares, view), "view", "share [%]", 100.0)),
        figure(
            "Coverage over time", charts.lines(_series(shares, wall), "wall time [s]", "share [%]", 100.0)
        ),
        figure("Gain of each view", charts.lines(_series(gains, view), "view", "[m³]"), worth_note(data)),
        figure("Time per step", charts.stacked_bars(view, steps, "view", "wall time [s]")),
        figure("Voxels of each class", charts.lines(_series(counts, view), "view", "voxels")),
        figure(
            "Motion to each view", charts.lines(_series(motions, view), "view", "path in joint space [rad]")
        ),
    ]
    return f'<h2>Coverage, gain and time</h2><div class="charts">{"".join(figures)}</div>'


def _of_chosen(data: RunData, name: str) -> np.ndarray:
    """A column of what was decided: nothing was for view 0, the first scan."""
    return np.where(data.column("view") == 0.0, np.nan, data.column(name))


def _series(named: list[tuple[str, np.ndarray]], x: np.ndarray) -> list[charts.Series]:
    return [charts.Series(name, x, y) for name, y in named]


def worth_note(data: RunData) -> str:
    """What the expected worth of a view counts, beside the volume that became known."""
    views = data.run.get("config", {}).get("views", {}) if isinstance(data.run.get("config"), dict) else {}
    weight = views.get("known_weight") if isinstance(views, dict) else None
    part = f"by {weight:g}" if is_number(weight) else "by the configured known_weight"
    return (
        f"Expected worth counts unseen void in full and other unseen space {part}, less where a view nearby has "
        "disappointed; newly known volume counts all that became known."
    )


def _statistics(data: RunData) -> str:
    parts = [tables.voxels(data), tables.facts(data)]
    return f'<h2>The map in numbers</h2><div class="charts">{"".join(parts)}</div>' if any(parts) else ""


def _details(data: RunData) -> str:
    out = []
    for key, title in (("config", "Configuration"), ("versions", "Versions")):
        if key in data.run:
            content = text(json.dumps(data.run[key], indent=2, sort_keys=True))
            out.append(f"<details><summary>{title}</summary><pre>{content}</pre></details>")
    return f"<h2>How it was run</h2>{''.join(out)}" if out else ""
