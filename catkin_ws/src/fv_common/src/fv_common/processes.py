"""Child processes that never outlive their parent. Needs the standard library only."""

from __future__ import annotations

import ctypes
import os
import select
import signal
import subprocess
import time

PR_SET_PDEATHSIG = 1  # linux/prctl.h
PR_SET_CHILD_SUBREAPER = 36
_LIBC = ctypes.CDLL(
    None, use_errno=True
)  # loaded here: after a fork another thread may hold the loader's lock


def prctl(option: int, value: int) -> None:
    """Set an attribute of this process; OSError when the kernel refuses."""
    if _LIBC.prctl(option, value, 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "prctl")


def die_with_parent(how: signal.Signals = signal.SIGKILL) -> None:
    """Called in a child before exec: the kernel ends it when the parent's thread that started it is gone."""
    prctl(PR_SET_PDEATHSIG, how)


def stop(process: subprocess.Popen[bytes], patience_s: float = 3.0) -> None:
    """End one process by its id: politely, then for good."""
    if process.poll() is None:
        process.terminate()
        if code_within(process, patience_s) is None:
            process.kill()
            process.wait()


def code_within(process: subprocess.Popen[bytes], seconds: float) -> int | None:
    """The exit code, or None when the process has not ended after so long."""
    try:
        return process.wait(seconds)
    except subprocess.TimeoutExpired:
        return None


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
