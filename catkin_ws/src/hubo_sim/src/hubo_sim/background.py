"""Long computations in a process of their own, so that the simulation's thread keeps the interpreter."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

from hubo_sim.errors import SimError

_POLL_S = 0.2


def run_apart(function: Callable[[Any], Any], argument: Any, stop: Callable[[], bool]) -> Any:
    """`function(argument)` in a fresh process, both importable and picklable; stop() true ends it.

    Raises SimError: the one that the function raised, or that it was stopped or died.
    """
    context = multiprocessing.get_context("spawn")  # a fork would inherit threads and a GL context
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_work, args=(sender, function, argument), daemon=True)
    process.start()
    sender.close()
    try:
        while not receiver.poll(_POLL_S):
            if stop():
                raise SimError("stopped")
        good, value = receiver.recv()
    except EOFError:
        raise SimError("the computation ended without an answer") from None
    finally:
        process.terminate()
        process.join()
    if not good:
        raise SimError(value)
    return value


def _work(sender: Connection, function: Callable[[Any], Any], argument: Any) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's
    try:
        sender.send((True, function(argument)))
    except (SimError, ValueError, MemoryError) as err:
        sender.send((False, str(err) or type(err).__name__))
