"""Files that are there whole or not at all. Needs the standard library only."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path


def write_replacing(path: str | Path, write: Callable[[Path], object]) -> None:
    """Let ``write`` fill a file beside ``path``, of the same ending, and rename it when it is complete.

    So nobody reads half a file, and a full disk leaves what was there. Raises OSError; then nothing is left behind.
    """
    path = Path(path)
    beside = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        write(beside)
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


def write_whole(path: str | Path, content: bytes | str) -> None:
    """Write bytes, or a text as UTF-8. Otherwise as write_replacing."""
    data = content.encode() if isinstance(content, str) else content
    write_replacing(path, lambda beside: beside.write_bytes(data))
