"""Pictures and the video of a run, made small and embedded."""

from __future__ import annotations

import base64
import html
import io
from pathlib import Path

from PIL import Image as Picture

from fv_viz.report.run_data import RunData

MAX_PICTURES_BYTES = 4_500_000  # of all pictures of a report together, before base64
MAX_VIDEO_BYTES = 2_500_000
MAX_FRAMES = 120  # of a video that is made smaller
VIDEOS = {".mp4": "video/mp4", ".webm": "video/webm", ".gif": "image/gif"}
ON_PAPER = 12  # pictures of the strip that are printed
ENLARGE = """
const large = document.getElementById("large");
for (const image of document.querySelectorAll(".strip img")) {
  image.addEventListener("click", () => { large.firstElementChild.src = image.src; large.showModal(); });
}
large.addEventListener("click", () => large.close());
"""


def scene(data: RunData) -> str:
    """The simulated world and the robot in it: a video when there is a small one, else the picture; as HTML."""
    video = next((path for path in data.scene if path.suffix in VIDEOS), None)
    still = next((path for path in data.scene if path.suffix not in VIDEOS), None)
    if video is not None:
        shown, words = _video(video, still), "the simulated scene, as the robot never sees it"
    elif still is not None:
        shown, words = _picture(still, 400_000), "the simulated scene, as the robot never sees it"
    else:
        return ""
    return f'<h2>The scene</h2><figure id="true-scene">{shown}<figcaption>{words}</figcaption></figure>'


def strip(data: RunData) -> str:
    """All pictures side by side, enlarged by a click, as HTML; on paper only some of them."""
    if not data.pictures:
        return ""
    budget, items = MAX_PICTURES_BYTES // len(data.pictures), []
    every = -(-len(data.pictures) // ON_PAPER)
    for number, path in enumerate(data.pictures):
        kept = number % every == 0 or number == len(data.pictures) - 1
        name = html.escape(path.stem.replace("_", " "))
        figure = '<figure class="screen">' if not kept else "<figure>"
        items.append(f"{figure}{_picture(path, budget)}<figcaption>{name}</figcaption></figure>")
    dialog = f'<dialog id="large"><img alt="enlarged picture"></dialog><script>{ENLARGE}</script>'
    return f'<h2>From view to view</h2><div class="strip">{"".join(items)}</div>{dialog}'


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
        return f"{_picture(still, 400_000) if still else ''}<p>{words}</p>"
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
