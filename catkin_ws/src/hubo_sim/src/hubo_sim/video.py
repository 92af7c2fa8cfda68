"""Pictures in a row as a video file: .mp4 by the ffmpeg program, .gif by Pillow."""

from __future__ import annotations

import contextlib
import io
import shutil
import subprocess
from pathlib import Path

import numpy as np
from PIL import Image

from fv_common.files import write_whole
from hubo_sim.errors import SimError

_LARGEST_GIF = 300  # frames; a longer run is shown in larger steps of time


class Mp4Video:
    """Frames go to ffmpeg (H.264) as they come."""

    def __init__(self, path: Path, size: tuple[int, int], rate_hz: float) -> None:
        if shutil.which("ffmpeg") is None:
            raise SimError(f"video {path}: .mp4 needs the program ffmpeg (Debian: ffmpeg); .gif does not")
        raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}", "-r", f"{rate_hz:g}"]
        out = ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-y", str(path)]
        self._ffmpeg = subprocess.Popen(
            ["ffmpeg", "-loglevel", "error", *raw, "-i", "-", *out],
            stdin=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,  # Ctrl-C is ours: ffmpeg ends with the last frame
        )

    def add(self, rgb: np.ndarray) -> None:
        """Append a frame (H, W, 3) uint8. Raises SimError when ffmpeg has given up."""
        try:
            self._ffmpeg.stdin.write(np.ascontiguousarray(rgb).data)
        except OSError as err:
            raise SimError(f"video: ffmpeg: {self._complaint() or err}") from err

    def close(self) -> None:
        """Finish the file. Raises SimError when ffmpeg could not."""
        with contextlib.suppress(OSError):  # it has ended already: its exit status tells why
            self._ffmpeg.stdin.close()
        complaint = self._complaint()
        if self._ffmpeg.wait():
            raise SimError(f"video: ffmpeg: {complaint}")

    def _complaint(self) -> str:
        return " ".join(self._ffmpeg.stderr.read().decode(errors="replace").split())


class GifVideo:
    """Frames are kept, with 256 colours each, and written at the end."""

    def __init__(self, path: Path, size: tuple[int, int], rate_hz: float) -> None:
        self._path, self._rate_hz = path, rate_hz
        self._frames: list[Image.Image] = []
        self._stride, self._count = 1, 0

    def add(self, rgb: np.ndarray) -> None:
        """Append a frame (H, W, 3) uint8."""
        if self._count % self._stride == 0:
            self._frames.append(Image.fromarray(rgb).quantize(256, Image.Quantize.FASTOCTREE))
        self._count += 1
        if len(self._frames) > _LARGEST_GIF:
            self._frames, self._stride = self._frames[::2], 2 * self._stride

    def close(self) -> None:
        """Write the file; without a frame there is none. Raises SimError when it cannot be written."""
        if not self._frames:
            return
        first, *others = self._frames
        data, period_ms = io.BytesIO(), round(1e3 / self._rate_hz)
        first.save(data, "GIF", save_all=True, append_images=others, duration=period_ms, loop=0)
        try:
            write_whole(self._path, data.getvalue())
        except OSError as err:
            raise SimError(f"video {self._path}: {err}") from err


_KINDS = {".mp4": Mp4Video, ".gif": GifVideo}


def open_video(path: str, size: tuple[int, int], rate_hz: float) -> Mp4Video | GifVideo:
    """A video file of frames of size (width, height), even numbers, shown at rate_hz.

    Raises SimError for another kind of file, a folder that is not there, or a missing program.
    """
    file = Path(path)
    if file.suffix.lower() not in _KINDS:
        raise SimError(f"video {path}: the name must end in {' or '.join(_KINDS)}")
    if not file.parent.is_dir():
        raise SimError(f"video {path}: no such folder: {file.parent}")
    return _KINDS[file.suffix.lower()](file, size, rate_hz)
