"""Legends and title strips: what the colours mean, for the RViz panel and for pictures."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Set

import numpy as np
from PIL import Image as Picture
from PIL import ImageDraw, ImageFont
from sensor_msgs.msg import Image

from fv_viz.config import VizConfig
from fv_viz.drawing import colors

INK = (25, 25, 30)
PAPER = (250, 250, 250)
PARTS = {"clearance": "volume"}  # what has a line of its own and belongs to a layer
ALWAYS = {"removed"}  # comes from elsewhere: nobody here knows whether it is empty
PANEL = 420, 264  # [px] the legend's panel in RViz
SWATCH = 34  # [px] width of a colour sample


@dataclasses.dataclass(frozen=True)
class Entry:
    """One line of a legend: sample kind ("fill", "dots", "frame", "scale", "many"), colours (K, 3) 0..1, words."""

    kind: str
    rgb: np.ndarray
    words: str


def entries(config: VizConfig) -> dict[str, list[Entry]]:
    """Legend lines by name, in the order in which they are listed: one name for each layer, and those of PARTS."""

    def one(name: str, kind: str = "fill") -> Entry:
        return Entry(kind, colors.rgb(name)[None], colors.CLASSES[name][1])

    steps = np.linspace(0.0, 1.0, 24)
    roof = " (roof left out)" if config.roof_m else ""
    height = Entry("scale", colors.scale(config.height_scale, steps), f"occupied, low to high{roof}")
    utility = Entry(
        "scale", colors.scale(config.utility_scale, steps), "utility of a free voxel, low to high"
    )
    return {
        "occupied": [height],
        "free": [one("free")],
        "unknown": [one("unknown")],
        "frontier": [one("frontier")],
        "frontier_clusters": [Entry("many", colors.distinct(6), "frontier clusters, a colour each")],
        "void": [one("void", "dots")],
        "initial_ellipsoids": [one("initial_ellipsoids")],
        "ellipsoids": [one("ellipsoids")],
        "frontier_voids": [Entry("many", colors.distinct(6), "a void and its frontiers: one colour")],
        "utility": [utility],
        "views": [one("views", "frame")],
        "chosen_view": [one("chosen_view", "frame")],
        "path": [one("path", "frame"), one("start"), one("goal")],
        "volume": [one("bounds", "frame")],
        "clearance": [one("clearance")],
        "contacts": [one("contacts")],
        "removed": [one("removed", "dots")],
    }


def font(size: int) -> ImageFont.ImageFont:
    """A readable font; the plain built-in one when the system has none."""
    for name in ("DejaVuSans.ttf", "LiberationSans-Regular.ttf"):
        try:
            return ImageFont.truetype(name, size)
        except OSError:
            continue
    return ImageFont.load_default()


def draw(lines: list[Entry], width: int, columns: int, size: int = 17) -> Picture.Image:
    """The legend as a picture of the given width [px] in equal columns."""
    row = int(size * 1.55)
    rows = -(-len(lines) // columns) if lines else 0
    picture = Picture.new("RGB", (width, max(rows * row + 8, 1)), PAPER)
    pen, letters = ImageDraw.Draw(picture), font(size)
    for number, entry in enumerate(lines):
        x, y = 8 + (number % columns) * (width // columns), 4 + (number // columns) * row
        _sample(pen, entry, x, y + 3, row - 6)
        pen.text((x + SWATCH + 8, y + (row - size) // 2 - 2), entry.words, INK, letters)
    return picture


def framed(picture: Picture.Image, title: str, facts: Iterable[str], lines: list[Entry]) -> Picture.Image:
    """A picture with a title strip above and a legend below; either is left out when empty."""
    facts = [fact for fact in facts if fact]
    strip = _title(picture.width, title, facts) if title or facts else Picture.new("RGB", (picture.width, 0))
    key = (
        draw(lines, picture.width, max(picture.width // 400, 1))
        if lines
        else Picture.new("RGB", (picture.width, 0))
    )
    out = Picture.new("RGB", (picture.width, strip.height + picture.height + key.height), PAPER)
    out.paste(strip, (0, 0))
    out.paste(picture, (0, strip.height))
    out.paste(key, (0, strip.height + picture.height))
    return out


def lines(config: VizConfig, layers: Iterable[str], filled: Set[str] | None) -> list[Entry]:
    """Legend lines of the layers that are switched on and not empty; filled: see presence, None when nobody knows."""
    on = set(layers)
    on |= {part for part, layer in PARTS.items() if layer in on}
    shown = on if filled is None else on & (filled | ALWAYS)
    return [entry for name, group in entries(config).items() if name in shown for entry in group]


def image_message(config: VizConfig, layers: Iterable[str], filled: Set[str]) -> Image:
    """The legend of some layers as an image message for an RViz panel, which shows what it does not fill in black."""
    key = draw(lines(config, layers, filled), PANEL[0], 1)
    picture = Picture.new("RGB", (key.width, max(key.height, PANEL[1])), PAPER)
    picture.paste(key, (0, 0))
    return Image(
        height=picture.height,
        width=picture.width,
        encoding="rgb8",
        step=3 * picture.width,
        data=picture.tobytes(),
    )


def _title(width: int, title: str, facts: list[str]) -> Picture.Image:
    large, small = font(26), font(18)
    probe = ImageDraw.Draw(Picture.new("RGB", (1, 1)))
    words = "   ·   ".join(facts)
    two_rows = (
        bool(title and words) and probe.textlength(title, large) + probe.textlength(words, small) > width - 60
    )
    strip = Picture.new("RGB", (width, 72 if two_rows else 44), PAPER)
    pen = ImageDraw.Draw(strip)
    pen.text((12, 6), title, INK, large)
    left = 12 if two_rows or not title else width - 12 - probe.textlength(words, small)
    pen.text((left, 43 if two_rows else 12), words, (70, 70, 80), small)
    return strip


def _sample(pen: ImageDraw.ImageDraw, entry: Entry, x: int, y: int, height: int) -> None:
    tones = [tuple(int(255 * c) for c in tone) for tone in entry.rgb]
    if entry.kind == "frame":
        pen.rectangle([x, y, x + SWATCH, y + height], None, tones[0], 2)
    elif entry.kind == "dots":
        for k in range(5):
            pen.ellipse([x + 7 * k, y + 4 + 5 * (k % 2), x + 7 * k + 5, y + 9 + 5 * (k % 2)], tones[0])
    else:
        step = SWATCH / len(tones)
        for k, tone in enumerate(tones):
            pen.rectangle([x + k * step, y, x + (k + 1) * step, y + height], tone)
