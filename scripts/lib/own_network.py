"""A network of its own, for this process and all that it starts: a loopback and nothing else.

    own_network.py COMMAND [WORD...]     becomes the command, in there

roscpp's XML-RPC servers listen on every interface, whatever ROS_HOSTNAME says, and nothing in ROS 1 asks who calls. In
a network namespace of its own a run has no interface but the loopback. See network_namespaces(7), user_namespaces(7).
"""

from __future__ import annotations

import ctypes
import errno
import fcntl
import os
import re
import socket
import struct
import sys
from pathlib import Path

CLONE_NEWUSER = 0x10000000
CLONE_NEWNET = 0x40000000
SIOCSIFFLAGS = 0x8914
IFF_UP = 1
OPEN_DOORS = "{}, so ROS nodes listen on all network interfaces; docs/security.md says what to do"
X_SOCKETS = Path("/tmp/.X11-unix")


def enter() -> str:
    """Move this process into a network of its own; empty, or why the system does not allow it (then nothing changed).

    DISPLAY goes where it names a display that cannot be reached from there.

    :raises RuntimeError: when this process has threads already; the kernel would leave them behind.
    """
    if len(os.listdir("/proc/self/task")) > 1:
        raise RuntimeError("a network of its own must be entered before there are threads")
    refused = refusal()
    if refused:
        return refused
    _unshare()
    if not reaches_display(os.environ.get("DISPLAY", "")):
        os.environ.pop("DISPLAY", None)
    return ""


def enter_or_say(program: str) -> None:
    """Move into a network of its own; one line of the program where the system does not allow it."""
    refused = enter()
    if refused:
        print(f"{program}: {OPEN_DOORS.format(refused)}", file=sys.stderr, flush=True)


def is_own() -> bool:
    """True where the loopback is the only network interface."""
    return {name for _, name in socket.if_nameindex()} <= {"lo"}


def reaches_display(display: str) -> bool:
    """True for an X display with a socket in the file system; TCP and abstract sockets end at the namespace."""
    local = re.fullmatch(r"(?:unix)?:(\d+)(?:\.\d+)?", display)
    return local is not None and (X_SOCKETS / f"X{local[1]}").is_socket()


def refusal() -> str:
    """Why the system does not allow a network of its own, found out in a child; empty when it does."""
    child = os.fork()
    if child == 0:
        try:
            _unshare()
            os._exit(0)
        except OSError as error:
            os._exit(error.errno or errno.EPERM)
        finally:
            os._exit(errno.EPERM)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    return f"the system allows no network namespace ({os.strerror(abs(code))})" if code else ""


def _unshare() -> None:
    """Leave the network; OSError when the system refuses."""
    user, group = os.geteuid(), os.getegid()
    try:
        _call(CLONE_NEWNET)  # root needs no user namespace, where the files of others would be closed to it
    except PermissionError:
        _call(CLONE_NEWUSER | CLONE_NEWNET)
        Path("/proc/self/setgroups").write_text("deny")
        Path("/proc/self/uid_map").write_text(f"{user} {user} 1")  # so that files stay the user's own
        Path("/proc/self/gid_map").write_text(f"{group} {group} 1")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        fcntl.ioctl(any_socket, SIOCSIFFLAGS, struct.pack("16sh22x", b"lo", IFF_UP))


def _call(flags: int) -> None:
    if ctypes.CDLL(None, use_errno=True).unshare(flags) != 0:
        raise OSError(ctypes.get_errno(), "unshare")


def main() -> int:
    command = sys.argv[1:]
    if not command:
        print("own_network: no command; usage: own_network.py COMMAND [WORD...]", file=sys.stderr)
        return 2
    enter_or_say(Path(command[0]).name)
    try:
        os.execvp(command[0], command)
    except OSError as error:
        print(f"{command[0]}: {error.strerror}", file=sys.stderr)
    return 127


if __name__ == "__main__":
    sys.exit(main())
