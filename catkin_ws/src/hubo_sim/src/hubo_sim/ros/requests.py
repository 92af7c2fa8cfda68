"""Calls from other threads into the one thread that owns pybullet."""

from __future__ import annotations

import logging
import queue
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeout
from typing import Any

from hubo_sim.errors import SimError

_log = logging.getLogger(__name__)


class RequestQueue:
    """Functions that other threads put in and the owner's thread runs, first in first out."""

    def __init__(self) -> None:
        # Not SimpleQueue: interrupted by a signal, its get() with a timeout can wait for ever (Python 3.11).
        self._queue: queue.Queue[tuple[Callable[[], Any], Future | None]] = queue.Queue()

    def post(self, function: Callable[[], Any]) -> None:
        """Run `function` in the owner's thread, some time soon. An error it raises is logged; the loop goes on."""
        self._queue.put((function, None))

    def ask(self, function: Callable[[], Any], timeout_s: float = 30.0) -> Any:
        """Run `function` in the owner's thread and wait for its value or its exception.

        Raises SimError when it was not begun within timeout_s; it will not be run then.
        """
        future: Future = Future()
        self._queue.put((function, future))
        return wait_for(future, timeout_s)

    def serve(self, wait_s: float) -> None:
        """Run what is there; with nothing there, wait up to wait_s for one."""
        try:
            item = self._queue.get(timeout=wait_s) if wait_s > 0.0 else self._queue.get_nowait()
            while True:
                _run(*item)
                item = self._queue.get_nowait()
        except queue.Empty:
            return


def wait_for(future: Future, timeout_s: float) -> Any:
    """A future's value. Raises its exception, or SimError when it was not begun in time and is cancelled."""
    try:
        return future.result(timeout_s)
    except FutureTimeout:
        if future.cancel():
            raise SimError(f"the simulator gave no answer within {timeout_s:.0f} s: not done") from None
        return future.result()  # it has begun: its own answer is the true one


def _run(function: Callable[[], Any], future: Future | None) -> None:
    if future is None:
        try:
            function()
        except Exception:  # a bad message must not end the simulation
            _log.exception("a request failed")
    elif future.set_running_or_notify_cancel():
        try:
            future.set_result(function())
        except Exception as err:  # the asker's error, not the loop's
            future.set_exception(err)
