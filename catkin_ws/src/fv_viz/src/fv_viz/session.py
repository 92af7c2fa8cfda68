"""A ROS master of our own on a free port with some nodes, all of which end together."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time

from fv_viz.offscreen import processes


class Session:
    """Use as a context; sets ROS_MASTER_URI of this process. Raises RuntimeError when the master does not come up.

    verbose: let the nodes write to standard error.
    """

    def __init__(self, verbose: bool = False) -> None:
        self._children: list[subprocess.Popen] = []
        self._output = sys.stderr if verbose else subprocess.DEVNULL

    def __enter__(self) -> Session:
        try:
            while not self._has_master(free_port()):
                pass  # another program took the port between the question and roscore's start
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_) -> None:
        for child in reversed(self._children):
            processes.stop(child)

    def _has_master(self, port: int, timeout_s: float = 120.0) -> bool:
        """Start a master and wait for it; False when it ended because the port was taken."""
        os.environ["ROS_MASTER_URI"], os.environ["ROS_HOSTNAME"] = f"http://localhost:{port}", "localhost"
        core = self.start("roscore", "-p", str(port))
        deadline = time.monotonic() + timeout_s
        while core.poll() is None:
            if is_open(port):
                return core.poll() is None
            if time.monotonic() > deadline:
                raise RuntimeError(f"no ROS master within {timeout_s:g} s")
            time.sleep(0.1)
        if not is_open(port):
            raise RuntimeError(f"roscore ended with code {core.returncode}")
        return False

    def start(self, *command: str) -> subprocess.Popen:
        """Start a program; it ends with the session at the latest."""
        child = subprocess.Popen(
            command, preexec_fn=processes.die_with_parent, stdout=self._output, stderr=self._output
        )
        self._children.append(child)
        return child

    def rosrun(self, package: str, program: str, *arguments: str) -> subprocess.Popen:
        """Start a node."""
        return self.start("rosrun", package, program, *arguments)


def is_open(port: int) -> bool:
    """Whether somebody listens on a TCP port of this machine."""
    with socket.socket() as probe:
        return probe.connect_ex(("localhost", port)) == 0


def free_port() -> int:
    """A TCP port that nobody uses now."""
    with socket.socket() as probe:
        probe.bind(("localhost", 0))
        return probe.getsockname()[1]
