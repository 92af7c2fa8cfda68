"""A private ROS master and the nodes around it, all ended by their ids when the session ends.

Importing it needs the standard library only.
"""

from __future__ import annotations

import contextlib
import functools
import os
import signal
import socket
import subprocess
import sys
import time
import xmlrpc.client
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from fv_common.errors import UserError
from fv_common.processes import code_within, die_with_parent

T = TypeVar("T")
START_TIMEOUT_S = 30.0
STOP_TIMEOUT_S = 8.0
MASTER = "rosmaster"


class SessionError(UserError, RuntimeError):
    """A session could not be started or a node of it died; the text is fit for a user."""


def free_port() -> int:
    """A TCP port of this machine that nothing listens on at the moment."""
    return _bound_port(0)


def _bound_port(port: int) -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.bind(("localhost", port))
        return int(probe.getsockname()[1])


@dataclass
class Node:
    """One started process."""

    name: str
    process: subprocess.Popen[bytes]
    log: Path | None

    def last_lines(self, count: int = 5) -> str:
        """The end of the node's log, for an error message; empty without a log."""
        with contextlib.suppress(OSError):
            text = self.log.read_text(errors="replace") if self.log else ""
            lines = [line for line in text.splitlines() if line.strip()]
            return "\n".join(f"    {line}" for line in lines[-count:])
        return ""


class RosSession:
    """A ROS master on a port of its own, and nodes started with rosrun; sets ROS_MASTER_URI of this process.

    Use as a context manager. Every process is the leader of its own process group and is ended with that group:
    interrupt first, then terminate, then kill. They end as well when the thread that started them is gone.

    :param log_dir: where each node's output goes, one file a node; None: nowhere.
    :param port: of the master; 0 takes a free one.
    :param verbose: without a log_dir, let the nodes write to standard error.
    """

    def __init__(self, log_dir: Path | None = None, port: int = 0, verbose: bool = False) -> None:
        self.log_dir, self.port = log_dir, port
        self.nodes: list[Node] = []
        self._may_choose = port == 0
        self._output = None if verbose else subprocess.DEVNULL
        self._environment: dict[str, str] = {}

    def __enter__(self) -> RosSession:
        if self.log_dir:
            self.log_dir.mkdir(parents=True, exist_ok=True)
        try:
            while not self._has_master():
                pass
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()

    @property
    def master_uri(self) -> str:
        """Where the master of this session listens."""
        return f"http://localhost:{self.port}"

    def rosrun(self, package: str, executable: str, *arguments: str, name: str = "") -> Node:
        """Start a node; its output goes to ``<log_dir>/<name>.log``."""
        return self.start(name or executable, ["rosrun", package, executable, *arguments])

    def start(self, name: str, command: list[str]) -> Node:
        """Start a program; it ends with the session at the latest."""
        log = self.log_dir / f"{name}.log" if self.log_dir else None
        with contextlib.ExitStack() as stack:
            output = stack.enter_context(log.open("ab")) if log else self._output
            process = subprocess.Popen(
                command,
                stdout=sys.stderr if output is None else output,
                stderr=subprocess.STDOUT,
                stdin=subprocess.DEVNULL,
                env=self._environment,
                start_new_session=True,
                preexec_fn=functools.partial(die_with_parent, signal.SIGTERM),
            )
        node = Node(name, process, log)
        self.nodes.append(node)
        return node

    def run_once(
        self, package: str, executable: str, *arguments: str, watch: Callable[[Node], None] | None = None
    ) -> None:
        """Run a command to its end; SessionError with its last words when it fails.

        :param watch: called about once a second meanwhile, with the running command.
        """
        node = self.rosrun(package, executable, *arguments)
        while (code := code_within(node.process, 1.0)) is None:
            if watch:
                watch(node)
        self.nodes.remove(node)
        if code != 0:
            raise SessionError(f"{package}/{executable} failed:\n{node.last_lines()}")

    def wait_until(self, condition: Callable[[], T], what: str, timeout_s: float = START_TIMEOUT_S) -> T:
        """Poll on the wall clock until the condition holds; SessionError when a node dies or time runs out."""
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline:
            self.require_alive()
            if result := condition():
                return result
            time.sleep(0.05)
        logs = f"; logs are in {self.log_dir}" if self.log_dir else ""
        raise SessionError(f"{what} did not appear within {timeout_s:.0f} s{logs}")

    def require_alive(self) -> None:
        """SessionError that names the first node that has ended."""
        for node in self.nodes:
            if node.process.poll() is not None:
                words = node.last_lines()
                said = f"; its last words:\n{words}" if words else ""
                raise SessionError(f"node {node.name} ended with code {node.process.returncode}{said}")

    def has_publisher(self, topic: str) -> bool:
        """True when the master knows a publisher of this topic."""
        return self._is_registered(topic, 0)

    def has_subscriber(self, topic: str) -> bool:
        """True when the master knows a subscriber of this topic."""
        return self._is_registered(topic, 1)

    def close(self) -> None:
        """End every process, the last started first, the master last."""
        for how, wait_s in ((signal.SIGINT, STOP_TIMEOUT_S), (signal.SIGTERM, 3.0), (signal.SIGKILL, 3.0)):
            _signal_and_wait([node for node in reversed(self.nodes) if node.name != MASTER], how, wait_s)
        for how in (signal.SIGINT, signal.SIGKILL):
            _signal_and_wait([node for node in self.nodes if node.name == MASTER], how, 5.0)
        self.nodes.clear()

    def stop(self, node: Node) -> None:
        """End one node."""
        for how, wait_s in ((signal.SIGINT, STOP_TIMEOUT_S), (signal.SIGKILL, 3.0)):
            _signal_and_wait([node], how, wait_s)
        if node in self.nodes:
            self.nodes.remove(node)

    def _has_master(self) -> bool:
        """Start a master and wait for it; False when another one has taken its port meanwhile."""
        try:
            self.port = _bound_port(0 if self._may_choose else self.port)
        except OSError as error:
            raise SessionError(
                f"port {self.port} is in use; leave --port out and a free one is taken"
            ) from error
        self._enter_environment()
        # roscore itself would start this in a process group of its own, out of reach of our signals.
        master = self.start(MASTER, [MASTER, "--core", "-p", str(self.port)])
        if self.wait_until(_master_pid, "the ROS master") == master.process.pid:
            return True
        self.stop(master)
        return False

    def _enter_environment(self) -> None:
        own = {"ROS_MASTER_URI": self.master_uri, "ROS_HOSTNAME": "localhost"}
        if self.log_dir:
            own |= {"ROS_HOME": str(self.log_dir / "ros_home"), "ROS_LOG_DIR": str(self.log_dir / "ros")}
        os.environ.update(own)
        self._environment = dict(os.environ, PYTHONUNBUFFERED="1")

    def _is_registered(self, topic: str, kind: int) -> bool:
        master: Any = xmlrpc.client.ServerProxy(self.master_uri)
        return any(topic == known for known, _ in master.getSystemState("/session")[2][kind])


def _master_pid() -> int:
    from fv_common.ros_master import master_pid  # here: not in the standard library

    return master_pid()


def _signal_and_wait(nodes: list[Node], how: signal.Signals, wait_s: float) -> None:
    running = [node for node in nodes if node.process.poll() is None]
    for node in running:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(node.process.pid, how)
    deadline = time.monotonic() + wait_s
    for node in running:
        code_within(node.process, max(0.0, deadline - time.monotonic()))
