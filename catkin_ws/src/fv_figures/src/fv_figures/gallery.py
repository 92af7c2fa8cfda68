"""One page that shows all figures of a folder with what is said about each."""

from __future__ import annotations

import html
from pathlib import Path

from fv_common.files import write_whole
from fv_viz.report.markup import page


def write(folder: Path) -> Path:
    """Write index.html for the figures that lie in a folder; they are linked, not embedded."""
    parts = ["<h1>The thesis's figures from data of our own</h1>"]
    for picture in sorted(folder.glob("figure_*.png")):
        text = picture.with_suffix(".txt")
        title, *lines = text.read_text().splitlines() if text.is_file() else [picture.stem]
        said = "".join(f"<li>{html.escape(line)}</li>" for line in lines)
        parts.append(
            f'<h2>{html.escape(title)}</h2><img src="{html.escape(picture.name)}" alt="{html.escape(title)}" '
            f'style="max-width: 100%"><ul class="soft">{said}</ul>'
        )
    path = folder / "index.html"
    write_whole(path, page("The thesis's figures", parts))
    return path
