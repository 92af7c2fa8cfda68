"""The log of one process: tracebacks, crashes, and the chatter of native libraries, away from the terminal."""

from __future__ import annotations

import contextlib
import datetime
import faulthandler
import os
import re
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path


def log_folders() -> Iterator[Path]:
    """Where logs may go, best first: as ROS does it, then the system's folder for temporary files."""
    if os.environ.get("ROS_LOG_DIR"):
        yield Path(os.environ["ROS_LOG_DIR"])
    if os.environ.get("ROS_HOME"):
        yield Path(os.environ["ROS_HOME"]) / "log"
    with contextlib.suppress(RuntimeError):  # nobody's home
        yield Path.home() / ".ros" / "log"
    with contextlib.suppress(OSError):
        yield Path(tempfile.gettempdir())


class ErrorLog:
    """A file ``<program>-<process>-...-errors.log`` that stays only when something is wrong; never fails itself.

    From its construction on it also holds where each thread stands when a signal such as SIGSEGV ends the process.
    """

    def __init__(self, program: str) -> None:
        self._owner = os.getpid()
        self._keep = False
        self.path, self._file = _new_file(re.sub(r"[^\w.-]", "_", program)[:80])
        if self._file is not None:
            faulthandler.enable(self._file)

    @property
    def descriptor(self) -> int | None:
        """For native output; None when no log could be made."""
        return None if self._file is None else self._file

    def add(self, text: str) -> str:
        """Append a traceback; returns what a user is to be told of where it is."""
        if self._file is None:
            return "no log of it: no folder for logs can be written"
        self._keep = True
        stamp = datetime.datetime.now().isoformat(timespec="seconds")
        head = f"\n== {stamp}, process {os.getpid()}: {' '.join(sys.argv)}\n"
        try:
            os.write(self._file, (head + text.rstrip() + "\n").encode(errors="backslashreplace"))
        except OSError as error:
            return f"no log of it: {error.strerror}"
        return f"log: {self.path}"

    def note(self, text: str) -> None:
        """Append what is worth keeping only if something else goes wrong."""
        if self._file is not None:
            with contextlib.suppress(OSError):
                os.write(self._file, (text.rstrip() + "\n").encode(errors="backslashreplace"))

    def close(self) -> None:
        """At the end of the process: take the file away when nothing went wrong. A forked child leaves it alone."""
        if self._file is not None and os.getpid() == self._owner and not self._keep:
            with contextlib.suppress(OSError):
                os.unlink(self.path)


def _new_file(program: str) -> tuple[str, int | None]:
    for folder in log_folders():
        try:
            folder.mkdir(parents=True, exist_ok=True)
            file, path = tempfile.mkstemp("-errors.log", f"{program}-{os.getpid()}-", folder)
        except OSError:
            continue
        return path, file
    return "", None
