"""Long computations in a process of their own, so that the simulation's thread keeps the interpreter."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any

from hubo_sim.errors import SimError

_POLL_S = 0.2
_CHILD = "import sys; from hubo_sim.background import answer; answer(int(sys.argv[1]))"


def run_apart(function: Callable[[Any], Any], argument: Any, stop: Callable[[], bool]) -> Any:
    """`function(argument)` in a fresh process, both importable and picklable; stop() true ends it.

    Raises SimError: the one that the function raised, or that it was stopped or died.
    """
    ours, theirs = Pipe()
    # Not multiprocessing: a fork would inherit threads and a GL context, and what it spawns gets our sys.path, in which
    # catkin has put source folders, without their compiled modules, before the devel space.
    command = [sys.executable, "-c", _CHILD, str(theirs.fileno())]
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, pass_fds=[theirs.fileno()])
    theirs.close()
    try:
        ours.send((function, argument))
        while not ours.poll(_POLL_S):
            if stop():
                raise SimError("stopped")
        good, value = ours.recv()
    except (EOFError, ConnectionError):
        raise SimError("the computation ended without an answer") from None
    finally:
        ours.close()
        process.terminate()
        process.wait()
    if not good:
        raise SimError(value)
    return value


def answer(descriptor: int) -> None:
    """Compute what comes in through the descriptor of a connection, and send the result back."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's
    with Connection(descriptor) as caller:
        function, argument = caller.recv()
        try:
            caller.send((True, function(argument)))
        except (SimError, ValueError, MemoryError) as err:
            caller.send((False, str(err) or type(err).__name__))
