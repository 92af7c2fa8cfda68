"""Runs a command, and ends with it all that it has started, however this script itself is ended.

    supervise.py COMMAND [WORD...]

Nodes are leaders of their own sessions, so neither a closed terminal nor a killed script would reach them. Hence three
processes, any one of which may be killed: the one that was called, a keeper below it, and the command below that. Each
is told by the kernel when the one above it dies (PR_SET_PDEATHSIG), and the upper two adopt every orphan
(PR_SET_CHILD_SUBREAPER) and end what is left when the one below them has ended. See prctl(2).
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import time
from pathlib import Path

import last_resort  # noqa: F401  finds fv_common, even beside an older build

from fv_common.processes import PR_SET_CHILD_SUBREAPER, die_with_parent, prctl

PASSED_ON = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
HEARD = PASSED_ON | {signal.SIGCHLD}
ORDERLY_END_S = 120.0  # after it was asked to end, for results to be written
TERMINATE_S = 3.0
KEEPERS = 2


def descendants() -> list[int]:
    """Ids of every process below this one, nearest first."""
    children: dict[int, list[int]] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            after_name = stat.read_text().rpartition(")")[2].split()  # the name may hold anything
            children.setdefault(int(after_name[1]), []).append(int(stat.parent.name))
    found = list(children.get(os.getpid(), []))
    for pid in found:
        found += children.get(pid, [])  # the list grows while it is walked
    return found


def reap() -> dict[int, int]:
    """Ids and exit codes (128 and more: the signal that ended it) of the children that have ended."""
    ended: dict[int, int] = {}
    with contextlib.suppress(ChildProcessError):
        while (found := os.waitpid(-1, os.WNOHANG))[0] != 0:
            code = os.waitstatus_to_exitcode(found[1])
            ended[found[0]] = code if code >= 0 else 128 - code
    return ended


def end_all(how: signal.Signals) -> None:
    """Send a signal to every process below this one."""
    for pid in descendants():
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.kill(pid, how)


def sweep() -> None:
    """End what is left below this process: terminate, then kill."""
    start = time.monotonic()
    while reap() or descendants():
        patient = time.monotonic() - start < TERMINATE_S
        end_all(signal.SIGTERM if patient else signal.SIGKILL)
        signal.sigtimedwait(HEARD, 0.2)


def keep(child: int) -> int:
    """Pass signals on to the child until it has ended, then end what it left; its exit code."""
    deadline = float("inf")
    while True:
        ended = reap()
        if child in ended:
            sweep()
            return ended[child]
        if time.monotonic() > deadline:
            end_all(signal.SIGKILL)
        heard = signal.sigtimedwait(HEARD, 1.0)
        if heard is None or heard.si_signo == signal.SIGCHLD:
            continue
        from_terminal = heard.si_code > 0
        if heard.si_signo == signal.SIGINT and from_terminal:
            continue  # it has reached the child as well
        deadline = min(deadline, time.monotonic() + ORDERLY_END_S)
        with contextlib.suppress(ProcessLookupError):
            os.kill(child, signal.SIGINT if heard.si_signo == signal.SIGINT else signal.SIGTERM)


def fork_below() -> int:
    """Fork; the child's id, or 0 in the child, which is told to end when its parent dies."""
    parent = os.getpid()
    child = os.fork()
    if child == 0:
        die_with_parent(signal.SIGTERM)
        if os.getppid() != parent:
            sys.exit(128 + signal.SIGKILL)  # it died before the line above
    return child


def execute(command: list[str]) -> None:
    """Become the command."""
    signal.signal(signal.SIGHUP, signal.SIG_IGN)  # a keeper turns it into SIGTERM
    signal.pthread_sigmask(signal.SIG_UNBLOCK, HEARD)
    try:
        os.execvp(command[0], command)
    except OSError as error:
        print(f"{command[0]}: {error.strerror}", file=sys.stderr)
        sys.exit(127)


def main() -> int:
    signal.pthread_sigmask(signal.SIG_BLOCK, HEARD)
    for _ in range(KEEPERS):
        prctl(PR_SET_CHILD_SUBREAPER, 1)
        child = fork_below()
        if child != 0:
            return keep(child)
    execute(sys.argv[1:])
    return 127


if __name__ == "__main__":
    sys.exit(main())
