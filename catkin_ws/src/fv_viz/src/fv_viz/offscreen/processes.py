"""Child processes that never outlive their parent."""

from __future__ import annotations

import ctypes
import os
import select
import signal
import subprocess
import time

_PR_SET_PDEATHSIG = 1  # linux/prctl.h
_LIBC = ctypes.CDLL(None)  # loaded here: between fork and exec another thread may hold the loader's lock


def die_with_parent() -> None:
    """Called in a child before exec: the kernel ends it when the parent's thread that started it is gone."""
    _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


def stop(process: subprocess.Popen, patience_s: float = 3.0) -> None:
    """End one process by its id: politely, then for good."""
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(patience_s)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def read_line(descriptor: int, timeout_s: float) -> bytes | None:
    """One line from a pipe; None after the time or at the end of the stream, whichever comes first."""
    deadline, line = time.monotonic() + timeout_s, b""
    while (left := deadline - time.monotonic()) > 0.0:
        if not select.select([descriptor], [], [], left)[0]:
            return None
        byte = os.read(descriptor, 1)
        if byte in (b"", b"\n"):
            return line if byte else None
        line += byte
    return None
