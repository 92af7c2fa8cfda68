"""Runs what documents say, in a folder and on a ROS master of its own, and ends what was started."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import time
import xmlrpc.client
from dataclasses import dataclass
from pathlib import Path

from documents import ROOT

from fv_common.ros_session import free_port

READY_S = 60.0
END_S = 30.0
OUTPUT_LINES = 15
ENDED_BY_US = {0, -signal.SIGINT, 128 + signal.SIGINT}


@dataclass
class Running:
    """A command that goes on while the next ones are run."""

    text: str
    process: subprocess.Popen
    log: Path


class Shell:
    """One shell a command, as a reader has who opens another window for each node.

    :param folder: where commands are run; names that begin with ``scripts/`` or ``catkin_ws/`` are the checkout's.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._logs = folder / "shell_logs"
        self._logs.mkdir()
        self._running: list[Running] = []
        kept = {name: value for name, value in os.environ.items() if not name.startswith("ROS_")}
        self.environment = {
            **kept,
            "FV_DATA": str(folder / "data"),
            "ROS_MASTER_URI": f"http://localhost:{free_port()}",
            "ROS_HOME": str(folder / "ros_home"),
            "PYTHONUNBUFFERED": "1",
        }
        self._master = xmlrpc.client.ServerProxy(self.environment["ROS_MASTER_URI"])

    @property
    def port(self) -> str:
        """Of the ROS master that the commands find."""
        return self.environment["ROS_MASTER_URI"].rpartition(":")[2]

    def run(self, text: str, timeout_s: float) -> str:
        """Run a command to its end; its output. AssertionError with the last lines when it fails."""
        log = self._new_log()
        process = self._start(text, log)
        try:
            code = process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            code = f"none after {timeout_s:g} s"
        finally:
            _end(process)
        output = log.read_text(errors="replace")
        assert code == 0, f"ended with code {code}:\n{_last_lines(output)}"
        assert "Traceback (most recent call last)" not in output, _last_lines(output)
        return output

    def start(self, text: str, ready: str) -> None:
        """Start a command that goes on, and wait until it is there.

        :param ready: a topic or service (with a slash) that a node which was not there before offers or reads; else a
            text that the command says; empty: the ROS master answers.
        """
        before = self.registered(ready)
        log = self._new_log()
        running = Running(text, self._start(text, log), log)
        self._running.append(running)
        deadline = time.monotonic() + READY_S
        while not self._is_there(running, ready, before):
            code = running.process.poll()
            assert code is None, f"ended with code {code}:\n{_tail(log)}"
            assert time.monotonic() < deadline, f"no {ready or 'master'} after {READY_S:g} s:\n{_tail(log)}"
            time.sleep(0.1)

    def _is_there(self, running: Running, ready: str, before: set[str]) -> bool:
        if not ready:
            return self.has_master()
        if ready.startswith("/"):
            return bool(self.registered(ready) - before)
        return ready in running.log.read_text(errors="replace")

    def output_of(self, text: str) -> str:
        """What a command that goes on has said so far."""
        return "\n".join(each.log.read_text(errors="replace") for each in self._running if each.text == text)

    def has_master(self) -> bool:
        """True when the ROS master answers."""
        with contextlib.suppress(OSError, xmlrpc.client.Error):
            return self._master.getPid("/documents")[0] == 1
        return False

    def registered(self, name: str) -> set[str]:
        """Nodes that publish, read or serve this name; none without a master."""
        if not self.has_master():
            return set()
        state = self._master.getSystemState("/documents")[2]
        return {node for kind in state for offered, nodes in kind if offered == name for node in nodes}

    def end(self) -> None:
        """End all that goes on, the last first; AssertionError when something had failed, or does not end in order."""
        failed = []
        while self._running:
            running = self._running.pop()
            code = running.process.poll()
            early = code is not None and code != 0
            if code is None:
                os.killpg(running.process.pid, signal.SIGINT)
                with contextlib.suppress(subprocess.TimeoutExpired):
                    code = running.process.wait(END_S)
            _end(running.process)
            if early or code not in ENDED_BY_US:
                failed.append(f"'{running.text}' ended with code {code}:\n{_tail(running.log)}")
        assert not failed, "\n".join(failed)

    def _start(self, text: str, log: Path) -> subprocess.Popen:
        here = re.sub(r"(?<![\w/.$])(?=(scripts|catkin_ws)/)", f"{ROOT}/", text)
        with log.open("wb") as output:
            return subprocess.Popen(
                ["bash", "-c", f". {ROOT}/scripts/env\n{here}"],
                cwd=self.folder,
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def _new_log(self) -> Path:
        return self._logs / f"{len(list(self._logs.iterdir())):03d}.log"


def _end(process: subprocess.Popen) -> None:
    """End what is left of a command's process group."""
    for how in (signal.SIGTERM, signal.SIGKILL):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, how)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(3.0)


def _tail(log: Path) -> str:
    return _last_lines(log.read_text(errors="replace"))


def _last_lines(output: str) -> str:
    return "\n".join(output.splitlines()[-OUTPUT_LINES:])
