"""A session of nodes: it starts, watches, and leaves nothing behind."""

import os
import signal
import socket
import subprocess
import sys
import time

import pytest

from fv_common import ros_session
from fv_common.ros_session import RosSession, SessionError


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def state_of(pid: int) -> str:
    """The letter of a process's state as ps shows it; empty when there is none."""
    return (
        subprocess.run(["ps", "-o", "stat=", "-p", str(pid)], capture_output=True, text=True)
        .stdout[:1]
        .strip()
    )


def test_two_sessions_live_side_by_side_and_leave_no_process(tmp_path):
    with RosSession(tmp_path / "a") as first, RosSession(tmp_path / "b") as second:
        assert first.port != second.port
        pids = [node.process.pid for session in (first, second) for node in session.nodes]
        assert all(alive(pid) for pid in pids)
    assert not any(alive(pid) for pid in pids)


def test_a_port_in_use_is_named(tmp_path):
    with socket.socket() as taken:
        taken.bind(("localhost", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(SessionError, match=f"port {port} is in use"), RosSession(tmp_path, port):
            pass


def test_a_node_that_dies_is_named_with_its_last_words(tmp_path):
    with RosSession(tmp_path) as session:
        session.start("mumbler", ["bash", "-c", "echo my last words; exit 3"])
        with pytest.raises(SessionError, match=r"mumbler ended with code 3(.|\n)*my last words"):
            session.wait_until(lambda: False, "nothing", 5.0)


def test_what_never_appears_is_named(tmp_path):
    with RosSession(tmp_path) as session, pytest.raises(SessionError, match="the moon did not appear"):
        session.wait_until(lambda: False, "the moon", 0.2)


def test_a_node_that_ignores_interrupts_is_ended_with_its_children(tmp_path):
    script = "trap '' INT TERM; sleep 300 & echo $! > child; wait"
    with RosSession(tmp_path) as session:
        node = session.start("stubborn", ["bash", "-c", f"cd {tmp_path}; {script}"])
        deadline = time.monotonic() + 5
        while not (tmp_path / "child").exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        time.sleep(0.1)
        child = int((tmp_path / "child").read_text())
        session.stop(node)
    time.sleep(0.2)
    assert state_of(child) in ("", "Z")


def test_a_port_that_another_master_takes_meanwhile_is_left(monkeypatch):
    with RosSession() as first:
        chosen, choose = [first.port], ros_session._bound_port
        monkeypatch.setattr(
            ros_session, "_bound_port", lambda p: chosen.pop() if p == 0 and chosen else choose(p)
        )
        with RosSession() as second:
            assert not chosen and second.port != first.port and len(second.nodes) == 1


PARENT = """
import time
from fv_common.ros_session import RosSession
with RosSession() as session:
    session.start("sleeper", ["sleep", "300"])
    print(*(node.process.pid for node in session.nodes), flush=True)
    time.sleep(300)
"""


def test_nodes_end_with_a_parent_that_is_killed():
    with subprocess.Popen([sys.executable, "-c", PARENT], stdout=subprocess.PIPE, text=True) as parent:
        pids = [int(word) for word in parent.stdout.readline().split()]
        assert len(pids) == 2 and all(alive(pid) for pid in pids)
        parent.send_signal(signal.SIGKILL)
    deadline = time.monotonic() + 30
    while any(state_of(pid) not in ("", "Z") for pid in pids):
        assert time.monotonic() < deadline
        time.sleep(0.1)
