"""What native libraries print, kept off the terminal."""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
from collections.abc import Iterator

_target: list[int] = []  # of this process, as file descriptors 1 and 2 are


def send_native_output_to(descriptor: int | None) -> None:
    """Where native_output_hidden() sends what is printed: a log; before, and with None: nowhere."""
    _target[:] = [] if descriptor is None else [descriptor]


@contextlib.contextmanager
def native_output_hidden() -> Iterator[None]:
    """Keep what native code prints to stdout and stderr off the terminal, meant for chatter: errors are raised.

    It holds for the whole process, other threads too, so keep it short.
    """
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            stream.flush()
    saved = [os.dup(1), os.dup(2)]
    target = os.dup(_target[0]) if _target else os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(target, 1)
        os.dup2(target, 2)
        yield
    finally:
        ctypes.CDLL(None).fflush(None)  # what C still holds back
        for fd, copy in enumerate(saved, start=1):
            os.dup2(copy, fd)
            os.close(copy)
        os.close(target)
