"""A session of nodes: it starts, watches, and leaves nothing behind."""

import os
import socket
import subprocess
import time

import pytest
from ros_session import RosSession, SessionError


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


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
        session._start("mumbler", ["bash", "-c", "echo my last words; exit 3"])
        with pytest.raises(SessionError, match=r"mumbler ended with code 3(.|\n)*my last words"):
            session.wait_until(lambda: False, "nothing", 5.0)


def test_what_never_appears_is_named(tmp_path):
    with RosSession(tmp_path) as session, pytest.raises(SessionError, match="the moon did not appear"):
        session.wait_until(lambda: False, "the moon", 0.2)


def test_a_node_that_ignores_interrupts_is_ended_with_its_children(tmp_path):
    script = "trap '' INT TERM; sleep 300 & echo $! > child; wait"
    with RosSession(tmp_path) as session:
        node = session._start("stubborn", ["bash", "-c", f"cd {tmp_path}; {script}"])
        deadline = time.monotonic() + 5
        while not (tmp_path / "child").exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        time.sleep(0.1)
        child = int((tmp_path / "child").read_text())
        session.stop(node)
    time.sleep(0.2)
    state = subprocess.run(["ps", "-o", "stat=", "-p", str(child)], capture_output=True, text=True).stdout
    assert state.strip() == "" or state.startswith("Z")
