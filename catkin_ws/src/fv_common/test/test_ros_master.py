"""A master that answers, one that is not there, and what only listens."""

from __future__ import annotations

import socket
import threading
import time
from xmlrpc.server import SimpleXMLRPCServer

import pytest

from fv_common import ros_master
from fv_common.errors import UserError


class Master:
    """The one method of a ROS master that is asked."""

    def __init__(self, port: int = 0) -> None:
        self.server = SimpleXMLRPCServer(("127.0.0.1", port), logRequests=False)
        self.server.register_function(lambda _caller: (1, "", 42), "getPid")
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def __enter__(self) -> str:
        return f"http://localhost:{self.server.server_address[1]}"

    def __exit__(self, *_) -> None:
        self.server.shutdown()
        self.server.server_close()


def closed_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def test_a_master_that_answers_is_enough(monkeypatch, capsys):
    with Master() as uri:
        monkeypatch.setenv("ROS_MASTER_URI", uri)
        ros_master.require_master()
        ros_master.wait_for_master("tool")
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    "uri", ["", "localhost", "http://", "http://:1", "ftp://a:1", "http://a:99999", "http://[:1", "x y"]
)
def test_what_is_no_address_is_named(monkeypatch, uri):
    monkeypatch.setattr(ros_master.rosgraph, "get_master_uri", lambda: uri)
    with pytest.raises(UserError, match=r"ROS_MASTER_URI is .*; valid: http://HOST:PORT"):
        ros_master.require_master()


@pytest.mark.parametrize("host", ["localhost", "no-such-host.invalid"])
def test_where_nobody_listens_there_is_no_master(monkeypatch, host):
    monkeypatch.setenv("ROS_MASTER_URI", f"http://{host}:{closed_port()}")
    with pytest.raises(UserError, match=rf"no ROS master answers at http://{host}:\d+; start roscore"):
        ros_master.require_master()


def test_what_listens_and_never_answers_is_no_master(monkeypatch):
    monkeypatch.setattr(ros_master, "ANSWER_S", 0.3)
    with socket.socket() as mute:
        mute.bind(("127.0.0.1", 0))
        mute.listen()
        monkeypatch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{mute.getsockname()[1]}")
        assert not ros_master.master_answers()


def test_another_web_server_is_no_master(monkeypatch):
    with SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        monkeypatch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{server.server_address[1]}")
        assert not ros_master.master_answers()
        server.shutdown()


def test_a_node_says_once_that_it_waits(monkeypatch, capsys):
    monkeypatch.setattr(ros_master, "POLL_S", 0.02)
    port = closed_port()
    monkeypatch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{port}")
    waiting = threading.Thread(target=ros_master.wait_for_master, args=("tool",))
    waiting.start()
    time.sleep(0.3)
    assert waiting.is_alive()
    with Master(port):
        waiting.join(30)
    assert not waiting.is_alive()
    assert capsys.readouterr().err == (
        f"tool: no ROS master answers at http://127.0.0.1:{port}; waiting for one (roscore starts it)\n"
    )
