"""The last resort of every command and node: however it ends, it ends in one line and an exit code.

What a user can cause, a command says itself: it raises a UserError, or prints one line and returns 1. Whatever else
happens ends in one line as well; the traceback goes into a log that the line names. Needs the standard library only.
"""

from __future__ import annotations

import argparse
import atexit
import contextlib
import errno
import importlib
import os
import select
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Callable
from typing import NoReturn

from fv_common.error_log import ErrorLog
from fv_common.errors import Notice, UserError
from fv_common.native_output import send_native_output_to
from fv_common.one_line import OneLine, one_line

FAILED = 1
MISUSED = 2  # the command line is wrong
INTERNAL = 70  # sysexits.h: EX_SOFTWARE
INTERRUPTED = 128 + signal.SIGINT
CUT_OFF = 128 + signal.SIGPIPE  # nobody reads the output any more

Entry = str | Callable[[], int | None]


class Parser(argparse.ArgumentParser):
    """A command line whose errors are one line, without the usage that --help prints."""

    def error(self, message: str) -> NoReturn:
        self.exit(MISUSED, f"{self.prog}: {one_line(message)}; --help lists what is valid\n")


def run(entry: Entry, program: str = "") -> NoReturn:
    """Call a command or node; the process ends with the exit code that it returns (None is 0).

    :param entry: a function without arguments, or ``package.module:function``. Name it where imports take long: these
        belong to what is watched over, and Ctrl-C during them ends the process at once.
    :param program: name in messages; default: that of the script.
    """
    program = program or os.path.basename(sys.argv[0])
    _open_standard_files()
    log = ErrorLog(program)
    atexit.register(log.close)
    _watch_over_the_rest(program, log)

    def leave_at_once(*_ignored: object) -> NoReturn:
        log.close()
        os._exit(INTERRUPTED)

    signal.signal(signal.SIGINT, leave_at_once)
    code = _outcome(entry, program, log)
    signal.signal(signal.SIGINT, leave_at_once)  # the interpreter's own end may take long, too
    sys.exit(_flushed(code, program, log))


def _outcome(entry: Entry, program: str, log: ErrorLog) -> int:
    try:
        function = _imported(entry) if isinstance(entry, str) else entry
        signal.signal(signal.SIGINT, signal.default_int_handler)
        code = function()
        return 0 if code is None else int(code)
    except SystemExit as leaving:
        if isinstance(leaving.code, int | None):
            return leaving.code or 0
        _say(str(leaving.code))
        return FAILED
    except BaseException as error:
        return _told(error, program, log)


def _imported(name: str) -> Callable[[], int | None]:
    module, _, function = name.partition(":")
    return getattr(importlib.import_module(module), function)


def _flushed(code: int, program: str, log: ErrorLog) -> int:
    """Write what standard output still holds back; the exit code, which is no success when that fails."""
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except (OSError, ValueError) as error:
        _to_nowhere(1)
        return code or _told(error, program, log)
    return code


def _told(error: BaseException, program: str, log: ErrorLog) -> int:
    """Say in one line how it ended; the exit code."""
    if _is_quiet(error):
        return INTERRUPTED
    if isinstance(error, KeyboardInterrupt):
        _say(f"{program}: interrupted")
        return INTERRUPTED
    if isinstance(error, BrokenPipeError) and _is_cut(1):
        _to_nowhere(1)
        return CUT_OFF
    expected = _words_for(error)
    if expected:
        _say(f"{program}: {expected}")
        return FAILED
    where = log.add("".join(traceback.format_exception(error)))
    _say(f"{program}: {_unforeseen(error)} ({where})")
    return INTERNAL


def _is_quiet(error: BaseException) -> bool:
    """Whether ROS was shut down meanwhile: who did that knows."""
    rospy = sys.modules.get("rospy")
    if rospy is None or not isinstance(error, rospy.ROSException):
        return False
    return isinstance(error, rospy.ROSInterruptException) or "interrupted" in str(error)


def _words_for(error: BaseException) -> str:
    """What to tell the user of an error that users cause; empty for any other."""
    if isinstance(error, UserError):
        return str(error)
    if isinstance(error, MemoryError):
        return "out of memory"
    if not isinstance(error, OSError):
        return ""
    names = [os.fsdecode(name) for name in (error.filename, error.filename2) if isinstance(name, str | bytes)]
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return ": ".join(["the disk is full", *names])
    return f"{' -> '.join(names)}: {error.strerror}" if names and error.strerror else ""


def _unforeseen(error: BaseException) -> str:
    text = one_line(str(error))
    return f"unexpected {type(error).__name__}: {text}" if text else f"unexpected {type(error).__name__}"


def _say(text: str) -> None:
    with contextlib.suppress(OSError, ValueError, AttributeError):  # closed, or none
        if sys.stdout is not None:
            sys.stdout.flush()
    with contextlib.suppress(OSError, ValueError, AttributeError):
        sys.stderr.write(one_line(text) + "\n")
        sys.stderr.flush()


def _is_cut(descriptor: int) -> bool:
    """Whether nobody reads from the other end of a pipe any more."""
    poll = select.poll()
    poll.register(descriptor, select.POLLOUT)
    return any(event & (select.POLLERR | select.POLLHUP) for _, event in poll.poll(0))


def _to_nowhere(descriptor: int) -> None:
    with contextlib.suppress(OSError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, descriptor)
        os.close(nowhere)


def _open_standard_files() -> None:
    """Let no file get the number of a closed standard output, and let no name be unprintable."""
    with contextlib.suppress(OSError):
        while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:
            pass
        os.close(descriptor)
    with contextlib.suppress(AttributeError, ValueError):
        sys.stdout.reconfigure(errors="backslashreplace")


def _watch_over_the_rest(program: str, log: ErrorLog) -> None:
    """Threads, callbacks of rospy, destructors, warnings, native libraries."""

    def in_thread(args: threading.ExceptHookArgs) -> None:
        error = args.exc_value
        if error is None or isinstance(error, SystemExit) or _is_quiet(error):
            return
        where = log.add("".join(traceback.format_exception(error)))
        name = args.thread.name if args.thread else "?"
        _say(f"{program}: a thread ended ({name}): {_unforeseen(error)} ({where})")

    def in_destructor(args: sys.UnraisableHookArgs) -> None:
        what = f"{args.err_msg or 'Exception ignored in'}: {args.object!r}\n"
        log.note(
            what + "".join(traceback.format_exception(args.exc_type, args.exc_value, args.exc_traceback))
        )

    def warned(message, category, filename, lineno, file=None, line=None) -> None:
        if issubclass(category, Notice):
            _say(f"{program}: warning: {message}")
        log.note(warnings.formatwarning(message, category, filename, lineno, line))

    threading.excepthook = in_thread
    sys.unraisablehook = in_destructor
    sys.excepthook = lambda _type, error, _traceback: _told(error, program, log)
    warnings.showwarning = warned
    OneLine.install(log.add)
    send_native_output_to(log.descriptor)
