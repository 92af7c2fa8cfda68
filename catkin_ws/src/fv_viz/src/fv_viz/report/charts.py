"""Charts as inline SVG text: small, printable, readable without colour (direct labels, own dashes for lines)."""

from __future__ import annotations

import dataclasses
import html
from collections.abc import Sequence

import numpy as np

COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#6b6b76", "#8c564b")
DASHES = ("", "7 4", "2 3", "9 3 2 3")
WIDTH, HEIGHT = 560, 300
LEFT, RIGHT, TOP, BOTTOM = 58, 18, 14, 44


@dataclasses.dataclass(frozen=True)
class Series:
    """A named line: x and y (N,), points with NaN are left out; low and high (N,) draw a band around it."""

    name: str
    x: np.ndarray
    y: np.ndarray
    low: np.ndarray | None = None
    high: np.ndarray | None = None


class Frame:
    """Axes of a chart: maps data to pixels and draws grid and labels."""

    def __init__(
        self, x_range: tuple[float, float], y_range: tuple[float, float], x_label: str, y_label: str
    ) -> None:
        self._x, self._y = _widened(x_range), _widened(y_range)
        self._labels = html.escape(x_label), html.escape(y_label)

    def x(self, value: float) -> float:
        """Pixel column of a value."""
        return LEFT + (value - self._x[0]) / (self._x[1] - self._x[0]) * (WIDTH - LEFT - RIGHT)

    def y(self, value: float) -> float:
        """Pixel row of a value."""
        return HEIGHT - BOTTOM - (value - self._y[0]) / (self._y[1] - self._y[0]) * (HEIGHT - TOP - BOTTOM)

    def svg(self) -> str:
        """Grid lines, tick labels and axis titles."""
        parts = []
        for tick in ticks(*self._y):
            row = self.y(tick)
            parts.append(
                f'<line class="grid" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{row:.1f}" y2="{row:.1f}"/>'
            )
            parts.append(f'<text x="{LEFT - 7}" y="{row + 4:.1f}" text-anchor="end">{tick:,.10g}</text>')
        for tick in ticks(*self._x, least=1.0 if self._labels[0] == "view" else 0.0):
            parts.append(
                f'<text x="{self.x(tick):.1f}" y="{HEIGHT - BOTTOM + 17}" text-anchor="middle">{tick:g}</text>'
            )
        middle_x, middle_y = (LEFT + WIDTH - RIGHT) / 2, (TOP + HEIGHT - BOTTOM) / 2
        parts.append(f'<text x="{middle_x}" y="{HEIGHT - 8}" text-anchor="middle">{self._labels[0]}</text>')
        turn = f'transform="rotate(-90 14 {middle_y})"'
        parts.append(f'<text x="14" y="{middle_y}" text-anchor="middle" {turn}>{self._labels[1]}</text>')
        return "".join(parts)


def ticks(low: float, high: float, about: int = 5, least: float = 0.0) -> list[float]:
    """Round numbers within low..high, no nearer to each other than `least`."""
    raw = max((high - low) / about, least)
    base = 10.0 ** np.floor(np.log10(raw))
    step = base * min((k for k in (1, 2, 2.5, 5, 10) if k * base >= raw), default=10)
    return [
        round(k * step, 10)
        for k in range(int(np.ceil(low / step - 1e-9)), int(np.floor(high / step + 1e-9)) + 1)
    ]


def lines(series: Sequence[Series], x_label: str, y_label: str, y_top: float | None = None) -> str:
    """A line chart from zero; empty text when no series has a finite point."""
    series = [one for one in series if (np.isfinite(one.x) & np.isfinite(one.y)).any()]
    if not series:
        return ""
    x_all, y_all = np.concatenate([s.x for s in series]), np.concatenate([_tops(s) for s in series])
    top = y_top if y_top is not None else float(np.nanmax(y_all))
    frame = Frame(
        (float(np.nanmin(x_all)), float(np.nanmax(x_all))),
        (min(0.0, float(np.nanmin(y_all))), top),
        x_label,
        y_label,
    )
    body = frame.svg() + "".join(_line(frame, one, number) for number, one in enumerate(series))
    return _svg(body, y_label) + legend([one.name for one in series], dashed=True)


def stacked_bars(x: np.ndarray, parts: dict[str, np.ndarray], x_label: str, y_label: str) -> str:
    """Stacked bars, one per x; empty text when nothing is finite and positive."""
    parts = {name: np.nan_to_num(values) for name, values in parts.items() if np.nansum(values) > 0}
    if not parts or not np.isfinite(x).all():
        return ""
    top = float(np.sum(list(parts.values()), axis=0).max())
    frame = Frame((float(x.min()) - 0.5, float(x.max()) + 0.5), (0.0, top), x_label, y_label)
    width, body, base = 0.8 * (frame.x(1.0) - frame.x(0.0)), frame.svg(), np.zeros(len(x))
    for number, (name, values) in enumerate(parts.items()):
        for at, low, value in zip(x, base, values, strict=True):
            if value > 0:
                title = f"<title>{html.escape(x_label)} {at:g}: {html.escape(name)} {value:.3g}</title>"
                place = (
                    f'x="{frame.x(at) - width / 2:.1f}" y="{frame.y(low + value):.1f}" width="{width:.1f}"'
                )
                height = frame.y(low) - frame.y(low + value)
                body += f'<rect {place} height="{height:.2f}" fill="{COLORS[number % len(COLORS)]}">{title}</rect>'
        base = base + values
    return _svg(body, y_label) + legend(list(parts))


def legend(names: Sequence[str], dashed: bool = False) -> str:
    """Colour samples with names, as HTML."""
    items = []
    for number, name in enumerate(names):
        color = COLORS[number % len(COLORS)]
        dash = f'stroke-dasharray="{DASHES[number % len(DASHES)]}"' if dashed else ""
        stroke = f'<line x1="0" x2="28" y1="6" y2="6" stroke="{color}" stroke-width="{3 if dashed else 12}" {dash}/>'
        items.append(
            f'<span class="key"><svg width="28" height="12">{stroke}</svg>{html.escape(name)}</span>'
        )
    return f'<div class="keys">{"".join(items)}</div>'


def _tops(series: Series) -> np.ndarray:
    return series.y if series.high is None else series.high


def _widened(limits: tuple[float, float]) -> tuple[float, float]:
    return limits if limits[1] > limits[0] else (limits[0], limits[0] + 1.0)


def _line(frame: Frame, one: Series, number: int) -> str:
    color, dash = COLORS[number % len(COLORS)], DASHES[number % len(DASHES)]
    valid = np.isfinite(one.x) & np.isfinite(one.y)
    at = [(frame.x(a), frame.y(b)) for a, b in zip(one.x[valid], one.y[valid], strict=True)]
    path = " ".join(f"{a:.1f},{b:.1f}" for a, b in at)
    out = (
        f'<polyline points="{path}" fill="none" stroke="{color}" stroke-width="2" stroke-dasharray="{dash}"/>'
    )
    for (column, row), a, b in zip(at, one.x[valid], one.y[valid], strict=True):
        title = f"<title>{html.escape(one.name)}: {a:.4g}, {b:.4g}</title>"
        out += f'<circle cx="{column:.1f}" cy="{row:.1f}" r="2.6" fill="{color}">{title}</circle>'
    return _band(frame, one, color) + out


def _band(frame: Frame, one: Series, color: str) -> str:
    if one.low is None or one.high is None:
        return ""
    upper = [f"{frame.x(a):.1f},{frame.y(b):.1f}" for a, b in zip(one.x, one.high, strict=True)]
    lower = [f"{frame.x(a):.1f},{frame.y(b):.1f}" for a, b in zip(one.x, one.low, strict=True)]
    return f'<polygon points="{" ".join(upper + lower[::-1])}" fill="{color}" opacity="0.18"/>'


def _svg(body: str, label: str) -> str:
    view = f'viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{html.escape(label)}"'
    return f'<svg class="chart" {view}>{body}</svg>'
