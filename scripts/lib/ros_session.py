"""A private ROS master and the nodes around it, all ended by their ids when the session ends."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import time
import xmlrpc.client
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

START_TIMEOUT_S = 30.0
STOP_TIMEOUT_S = 8.0
MASTER = "rosmaster"


class SessionError(RuntimeError):
    """A session could not be started or a node of it died; the text is fit for a user."""


def free_port() -> int:
    """A TCP port of this machine that nothing listens on at the moment."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.bind(("localhost", 0))
        return probe.getsockname()[1]


def require_free(port: int) -> int:
    """The port itself; SessionError when something listens there."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        try:
            probe.bind(("localhost", port))
        except OSError as error:
            raise SessionError(f"port {port} is in use; leave --port out and a free one is taken") from error
    return port


def _code_within(process: subprocess.Popen, seconds: float) -> int | None:
    """The exit code, or None when the process has not ended after so long."""
    try:
        return process.wait(seconds)
    except subprocess.TimeoutExpired:
        return None


@dataclass
class Node:
    """One started process."""

    name: str
    process: subprocess.Popen
    log: Path

    def last_lines(self, count: int = 5) -> str:
        """The end of the node's log, for an error message."""
        with contextlib.suppress(OSError):
            lines = [line for line in self.log.read_text(errors="replace").splitlines() if line.strip()]
            return "\n".join(f"    {line}" for line in lines[-count:])
        return ""


@dataclass
class RosSession:
    """A ROS master on a port of its own, and nodes started with rosrun.

    Use as a context manager. Every process is the leader of its own process group and is ended with that group:
    interrupt first, then terminate, then kill.

    :param log_dir: where each node's output goes, one file a node.
    :param port: of the master; 0 takes a free one.
    """

    log_dir: Path
    port: int = 0
    nodes: list[Node] = field(default_factory=list)
    environment: dict[str, str] = field(default_factory=dict)

    def __enter__(self) -> RosSession:
        self.log_dir.mkdir(parents=True, exist_ok=True)
        self.port = require_free(self.port) if self.port else free_port()
        self.environment = dict(
            os.environ,
            ROS_MASTER_URI=self.master_uri,
            ROS_HOSTNAME="localhost",
            ROS_HOME=str(self.log_dir / "ros_home"),
            ROS_LOG_DIR=str(self.log_dir / "ros"),
            PYTHONUNBUFFERED="1",
        )
        os.environ.update({key: self.environment[key] for key in self.environment if key.startswith("ROS_")})
        # roscore itself would start this in a process group of its own, out of reach of our signals.
        self._start(MASTER, ["rosmaster", "--core", "-p", str(self.port)])
        try:
            self.wait_until(self._master_answers, "the ROS master")
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_exception) -> None:
        self.close()

    @property
    def master_uri(self) -> str:
        return f"http://localhost:{self.port}"

    def rosrun(self, package: str, executable: str, *arguments: str, name: str = "") -> Node:
        """Start a node; its output goes to ``<log_dir>/<name>.log``."""
        return self._start(name or executable, ["rosrun", package, executable, *arguments])

    def run_once(
        self, package: str, executable: str, *arguments: str, watch: Callable[[Node], None] | None = None
    ) -> None:
        """Run a command to its end; SessionError with its last words when it fails.

        :param watch: called about once a second meanwhile, with the running command.
        """
        node = self.rosrun(package, executable, *arguments)
        while (code := _code_within(node.process, 1.0)) is None:
            if watch:
                watch(node)
        self.nodes.remove(node)
        if code != 0:
            raise SessionError(f"{package}/{executable} failed:\n{node.last_lines()}")

    def wait_until(self, condition, what: str, timeout_s: float = START_TIMEOUT_S):
        """Poll on the wall clock until the condition holds; SessionError when a node dies or time runs out."""
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline:
            self.require_alive()
            result = condition()
            if result:
                return result
            time.sleep(0.05)
        raise SessionError(f"{what} did not appear within {timeout_s:.0f} s; logs are in {self.log_dir}")

    def require_alive(self) -> None:
        """SessionError that names the first node that has ended."""
        for node in self.nodes:
            if node.process.poll() is not None:
                raise SessionError(
                    f"node {node.name} ended with code {node.process.returncode}; its last words:\n{node.last_lines()}"
                )

    def has_service(self, name: str) -> bool:
        """True when the master knows a provider of this service."""
        return any(name == service for service, _ in self._system_state()[2])

    def has_publisher(self, topic: str) -> bool:
        """True when the master knows a publisher of this topic."""
        return any(topic == published for published, _ in self._system_state()[0])

    def close(self) -> None:
        """End every process, the last started first."""
        for how, wait_s in ((signal.SIGINT, STOP_TIMEOUT_S), (signal.SIGTERM, 3.0), (signal.SIGKILL, 3.0)):
            master_last = [node for node in reversed(self.nodes) if node.name != MASTER]
            self._signal_and_wait(master_last, how, wait_s)
        for how in (signal.SIGINT, signal.SIGKILL):
            self._signal_and_wait([node for node in self.nodes if node.name == MASTER], how, 5.0)
        self.nodes.clear()

    def stop(self, node: Node) -> None:
        """End one node."""
        for how, wait_s in ((signal.SIGINT, STOP_TIMEOUT_S), (signal.SIGKILL, 3.0)):
            self._signal_and_wait([node], how, wait_s)
        if node in self.nodes:
            self.nodes.remove(node)

    def _start(self, name: str, command: list[str]) -> Node:
        log = self.log_dir / f"{name}.log"
        with log.open("ab") as output:
            process = subprocess.Popen(
                command,
                stdout=output,
                stderr=subprocess.STDOUT,
                stdin=subprocess.DEVNULL,
                env=self.environment,
                start_new_session=True,
            )
        node = Node(name, process, log)
        self.nodes.append(node)
        return node

    @staticmethod
    def _signal_and_wait(nodes: list[Node], how: signal.Signals, wait_s: float) -> None:
        running = [node for node in nodes if node.process.poll() is None]
        for node in running:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(node.process.pid, how)
        deadline = time.monotonic() + wait_s
        for node in running:
            with contextlib.suppress(subprocess.TimeoutExpired):
                node.process.wait(max(0.0, deadline - time.monotonic()))

    def _master_answers(self) -> bool:
        with contextlib.suppress(OSError, xmlrpc.client.Error):
            return xmlrpc.client.ServerProxy(self.master_uri).getPid("/session")[0] == 1
        return False

    def _system_state(self):
        return xmlrpc.client.ServerProxy(self.master_uri).getSystemState("/session")[2]
