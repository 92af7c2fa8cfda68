"""Pictures and the video of a run, made small and embedded."""

from __future__ import annotations

import base64
import html
import io
from pathlib import Path

from PIL import Image as Picture

from fv_viz.report.run_data import FINISHED, RunData

MAX_PICTURES_BYTES = 4_500_000  # of all pictures of a report together, before base64
MAX_STILL_BYTES = 400_000
MAX_VIDEO_BYTES = 2_500_000
MAX_FRAMES = 120  # of a video that is made smaller
VIDEOS = {".mp4": "video/mp4", ".webm": "video/webm", ".gif": "image/gif"}
ON_PAPER = 12  # pictures of the strip that are printed
HINT = '<p class="soft noprint">A click enlarges a picture, the arrow keys go on to the next.</p>'
ENLARGE = """
const large = document.getElementById("large"), pictures = [...document.querySelectorAll(".strip img")];
let shown = 0;
const enlarge = (number) => {
  shown = Math.max(0, Math.min(pictures.length - 1, number));
  large.firstElementChild.src = pictures[shown].src;
};
pictures.forEach((image, number) => image.addEventListener("click", () => { enlarge(number); large.showModal(); }));
large.addEventListener("click", () => large.close());
large.addEventListener("keydown", (event) => {
  const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
  if (step) { enlarge(shown + step); event.preventDefault(); }
});
"""


def scene(data: RunData) -> str:
    """The simulated world and the robot in it, a video when there is a small one, beside the finished map; as HTML."""
    video = next((path for path in data.scene if path.suffix in VIDEOS), None)
    still = next((path for path in data.scene if path.suffix not in VIDEOS), None)
    if video is None and still is None:
        return ""
    world = _video(video, still) if video is not None else _picture(still, MAX_STILL_BYTES)
    halves = [_half("the simulated scene, as the robot never sees it", world)]
    if data.pictures and data.pictures[-1].stem == FINISHED:
        halves.append(_half("the map that came of it", _picture(data.pictures[-1], MAX_STILL_BYTES)))
    return f'<h2>The scene and the map</h2><div id="true-scene">{"".join(halves)}</div>'


def _half(words: str, content: str) -> str:
    return f'<figure>{content}<figcaption class="below">{words}</figcaption></figure>'


def strip(data: RunData) -> str:
    """All pictures side by side, enlarged by a click, as HTML; on paper only some of them."""
    if not data.pictures:
        return ""
    budget, items = MAX_PICTURES_BYTES // len(data.pictures), []
    every = -(-len(data.pictures) // ON_PAPER)
    for number, path in enumerate(data.pictures):
        kept = number % every == 0 or number == len(data.pictures) - 1
        figure = '<figure class="screen">' if not kept else "<figure>"
        items.append(
            f"{figure}{_picture(path, budget)}<figcaption>{_caption(path.stem)}</figcaption></figure>"
        )
    dialog = f'<dialog id="large"><img alt="enlarged picture"></dialog><script>{ENLARGE}</script>'
    return f'<h2>From view to view</h2>{HINT}<div class="strip">{"".join(items)}</div>{dialog}'


def _caption(stem: str) -> str:
    """What a picture of the strip shows: that of view N is taken before it, when it has just been chosen."""
    kind, _, number = stem.partition("_")
    if kind != "view" or not number.isdigit():
        return html.escape(stem.replace("_", " "))
    return "after the first scan" if int(number) <= 1 else f"after view {int(number) - 1}"


def _picture(path: Path, budget: int) -> str:
    """A picture as a JPEG of at most about so many bytes; what cannot be read is said."""
    try:
        with Picture.open(path) as picture:
            picture = picture.convert("RGB")
    except OSError:
        return f"<p>{html.escape(path.name)} cannot be read</p>"
    for width, quality in ((1280, 85), (1100, 75), (900, 65), (640, 55), (400, 45)):
        small = picture.copy()
        small.thumbnail((width, width))
        stream = io.BytesIO()
        small.save(stream, "JPEG", quality=quality)
        if stream.tell() <= budget:
            break
    return f'<img src="{_address("image/jpeg", stream.getvalue())}" alt="{html.escape(path.stem)}" decoding="async">'


def _video(path: Path, still: Path | None) -> str:
    """A video in the page; the picture and the video's name when it is too large or cannot be read."""
    name, size = html.escape(path.name), path.stat().st_size
    if path.suffix == ".gif":
        content = path.read_bytes() if 0 < size <= MAX_VIDEO_BYTES else _shrunk(path)
        kind = "image/gif" if len(content) == size else "image/webp"
    else:
        content, kind = path.read_bytes() if size <= MAX_VIDEO_BYTES else b"", VIDEOS[path.suffix]
    if not 0 < len(content) <= MAX_VIDEO_BYTES:
        words = f"{name} in the run folder ({size / 1e6:.1f} MB) does not fit into this page"
        return f"{_picture(still, MAX_STILL_BYTES) if still else ''}<p>{words}</p>"
    if path.suffix == ".gif":
        return f'<img src="{_address(kind, content)}" alt="{name}">'
    return f'<video src="{_address(kind, content)}" controls loop muted autoplay playsinline></video>'


def _shrunk(path: Path) -> bytes:
    """A GIF as a small animated WebP of as many seconds; empty when it cannot be read or Pillow cannot write that."""
    stream = io.BytesIO()
    try:
        with Picture.open(path) as video:
            step = -(-video.n_frames // MAX_FRAMES)
            pace_ms = float(video.info.get("duration") or 100.0)
            frames = []
            for number in range(0, video.n_frames, step):
                video.seek(number)
                frames.append(video.convert("RGB"))
                frames[-1].thumbnail((480, 480))
        options = {"save_all": True, "append_images": frames[1:], "quality": 40, "method": 2, "loop": 0}
        frames[0].save(stream, "WEBP", duration=round(pace_ms * step), **options)
    except (OSError, KeyError, EOFError):
        return b""
    return stream.getvalue()


def _address(kind: str, content: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"
