"""Ctrl-C, SIGTERM and a closed terminal: one KeyboardInterrupt each, and no error from writing to what is gone."""

from __future__ import annotations

import os
import signal
import sys
import time
from typing import NoReturn

SAME_S = 1.0  # what comes so soon after another is the same wish, sent to the process and to its group
OUTPUTS = (1, 2)
INTERRUPTED = 128 + signal.SIGINT  # exit code of a program that a person has ended


def interrupt_on_signals() -> None:
    """From now on SIGINT and SIGTERM raise KeyboardInterrupt in the main thread."""
    terminals = [output for output in OUTPUTS if os.isatty(output)]
    last = -SAME_S

    def on_signal(*_ignored) -> None:
        nonlocal last
        now, before = time.monotonic(), last
        last = now
        drop_closed(terminals)
        if now - before >= SAME_S:
            raise KeyboardInterrupt

    signal.signal(signal.SIGINT, on_signal)
    signal.signal(signal.SIGTERM, on_signal)


def drop_closed(terminals: list[int]) -> None:
    """Send to nowhere what would be written to terminals that have been closed."""
    for output in terminals:
        if not os.isatty(output):
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, output)
            os.close(nowhere)


def leave(text: str) -> NoReturn:
    """Say one line and end at once, without waiting for threads that wait for what has been interrupted.

    Processes that are left are ended by the supervisor.
    """
    print(text, file=sys.stderr)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(INTERRUPTED)
