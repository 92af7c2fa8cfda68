"""Panels into figures, and the check that a figure shows what it should."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
from PIL import Image as Picture
from PIL import ImageDraw

from fv_viz.drawing import colors, legend

PANEL = 640  # [px] width of one panel in a figure
MOST = 0.9  # share of a picture that no hue may exceed
# Colours 0..255 of a slice's states: unknown, free, occupied, frontier.
SLICE = np.array(
    [[255, 255, 255], [200, 200, 205], [20, 20, 20], 255 * colors.rgb("frontier")], dtype=np.uint8
)


@dataclasses.dataclass
class Figure:
    """A finished figure: panels (label, picture), one sentence on what it shows, and where its data came from."""

    panels: list[tuple[str, Picture.Image]]
    shows: str
    made_by: str
    legend: list[legend.Entry] = dataclasses.field(default_factory=list)
    expects: dict[str, float] = dataclasses.field(
        default_factory=dict
    )  # names of HUES, least share of the panels


# name -> hue interval [deg] and least saturation: what "red", "green" ... mean to the check
HUES = {
    "red": ((340.0, 20.0), 0.4),
    "orange": ((20.0, 52.0), 0.4),
    "green": ((52.0, 170.0), 0.2),
    "blue": ((185.0, 250.0), 0.2),
    "purple": ((255.0, 320.0), 0.15),
    "grey": ((0.0, 360.0), 0.0),
}


def grid(figure: Figure) -> Picture.Image:
    """The panels in one picture: one row up to three, else two or three columns; labels (a), (b), ... and legend."""
    count = len(figure.panels)
    columns = count if count <= 3 else 2 if count == 4 else 3
    width = PANEL if columns > 1 else 2 * PANEL
    tiles = [
        _tile(label, picture, number, count, width) for number, (label, picture) in enumerate(figure.panels)
    ]
    rows = -(-count // columns)
    height = max(tile.height for tile in tiles)
    sheet = Picture.new("RGB", (columns * width, rows * height), legend.PAPER)
    for number, tile in enumerate(tiles):
        sheet.paste(tile, ((number % columns) * width, (number // columns) * height))
    return legend.framed(sheet, "", [], figure.legend)


def save(figure: Figure, number: str, folder: Path, told: list[str]) -> Path:
    """Write the picture and, beside it, what it shows and more lines that tell about it."""
    path = folder / f"figure_{number.replace('.', '_')}.png"
    grid(figure).save(path)
    path.with_suffix(".txt").write_text("\n".join([f"Figure {number}: {figure.shows}", *told]) + "\n")
    return path


def figure_faults(figure: Figure) -> list[str]:
    """What is wrong with a figure: a blank panel, or hues that its panels should have and do not."""
    blank = [f"panel {label!r} is blank" for label, picture in figure.panels if faults(picture, {})]
    # Without the legend, whose samples have every hue that should be there.
    return blank or faults(grid(dataclasses.replace(figure, legend=[])), figure.expects)


def faults(picture: Picture.Image, expects: dict[str, float]) -> list[str]:
    """What is wrong with a picture: blank, too little of a hue that it should have, or nothing but one hue."""
    small = picture.convert("RGB").resize(
        (max(picture.width // 2, 1), max(picture.height // 2, 1)), Picture.NEAREST
    )
    pixels = np.asarray(small, dtype=np.float32).reshape(-1, 3) / 255.0
    if np.ptp(pixels, axis=0).max() < 0.1 or (np.abs(pixels - pixels[0]).max(axis=1) < 0.02).mean() > 0.998:
        return ["the picture is blank"]
    shares = hue_shares(pixels)
    wrong = [f"{100 * shares[name]:.2f} % {name}" for name, least in expects.items() if shares[name] < least]
    return wrong + [f"{100 * share:.0f} % {name}" for name, share in shares.items() if share > MOST]


def hue_shares(pixels: np.ndarray) -> dict[str, float]:
    """Share of pixels (N, 3) in 0..1 of each hue of HUES."""
    top, low = pixels.max(axis=1), pixels.min(axis=1)
    spread = np.maximum(top - low, 1e-6)
    r, g, b = pixels.T
    hue = (
        np.where(
            top == r, (g - b) / spread % 6, np.where(top == g, (b - r) / spread + 2, (r - g) / spread + 4)
        )
        * 60
    )
    saturation = (top - low) / np.maximum(top, 1e-6)
    out = {}
    for name, ((start, end), least) in HUES.items():
        inside = (hue >= start) & (hue <= end) if start < end else (hue >= start) | (hue <= end)
        enough = (saturation < 0.1) & (top < 0.85) if name == "grey" else inside & (saturation >= least)
        out[name] = float(enough.mean())
    return out


def slice_picture(states: np.ndarray, cell_px: int = 12) -> Picture.Image:
    """A map's slice (X, Y) of 0 unknown, 1 free, 2 occupied, 3 frontier, as in thesis figure 2.2; x to the right."""
    picture = Picture.fromarray(SLICE[states.T[::-1]])
    picture = picture.resize((picture.width * cell_px, picture.height * cell_px), Picture.NEAREST)
    pen = ImageDraw.Draw(picture)
    for k in range(0, picture.width, cell_px):
        pen.line([k, 0, k, picture.height], (225, 225, 230))
    for k in range(0, picture.height, cell_px):
        pen.line([0, k, picture.width, k], (225, 225, 230))
    return picture


def _tile(label: str, picture: Picture.Image, number: int, count: int, width: int) -> Picture.Image:
    picture = picture.convert("RGB")
    picture = picture.resize(
        (width - 8, round(picture.height * (width - 8) / picture.width)), Picture.LANCZOS
    )
    out = Picture.new("RGB", (width, picture.height + 36), legend.PAPER)
    out.paste(picture, (4, 4))
    words = f"({chr(ord('a') + number)}) {label}" if count > 1 else label
    ImageDraw.Draw(out).text((10, picture.height + 9), words, legend.INK, legend.font(17))
    return out
