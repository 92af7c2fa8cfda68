"""Closed doors: nothing of a run is reached from elsewhere, and where the system does not allow that, it is said."""

import contextlib
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import explore
import own_network
import pytest
from supervise import descendants

LIB = Path(__file__).parents[1]
SHORT = ["--robot", "free_camera", "--world", "empty", "--views", "1", "--no-screenshots", "--no-truth"]
LISTENS = "0A"
EVERYWHERE = {"00000000", "0" * 32}
NOBODY = 65534
REFUSE = """
import errno, os, sys
import own_network
def refuse(flags): raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))
own_network._call = refuse
"""


def python(script: str, *words: str) -> subprocess.CompletedProcess:
    """Run a script with the library on its path."""
    environment = {**os.environ, "PYTHONPATH": f"{LIB}:{os.environ.get('PYTHONPATH', '')}"}
    command = [sys.executable, "-c", script, *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=240, env=environment)


def allowed(*before: str) -> bool:
    script = (LIB / "own_network.py").read_text().rpartition("if __name__")[0] + "\nsys.exit(enter() != '')"
    return subprocess.run([*before, sys.executable, "-c", script], stderr=subprocess.DEVNULL).returncode == 0


needs_namespaces = pytest.mark.skipif(not allowed(), reason="the system allows no network namespace")


def listening(pid: int | str) -> dict[str, str]:
    """Inode and local address (hexadecimal) of every socket that listens in the network of a process."""
    found = {}
    for family in ("tcp", "tcp6"):
        for line in Path(f"/proc/{pid}/net/{family}").read_text().splitlines()[1:]:
            words = line.split()
            if words[3] == LISTENS:
                found[words[9]] = words[1].rpartition(":")[0]
    return found


def sockets_of(pid: int) -> set[str]:
    """Inodes of the sockets that a process holds."""
    found = set()
    for handle in Path(f"/proc/{pid}/fd").iterdir():
        with contextlib.suppress(OSError):
            found.add(os.readlink(handle).removeprefix("socket:[").removesuffix("]"))
    return found


def node_of(name: str, pids: list[int]) -> int | None:
    """The process whose program has this name."""
    for pid in pids:
        with contextlib.suppress(OSError):
            if Path(Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")[0].decode()).name == name:
                return pid
    return None


def open_planner(pids: list[int]) -> int | None:
    """The planner, once it listens on every interface: roscpp's XML-RPC server does, the reason for all this."""
    planner = node_of("planner_node", pids)
    with contextlib.suppress(OSError):
        if planner and EVERYWHERE & {listening(planner).get(inode) for inode in sockets_of(planner)}:
            return planner
    return None


@needs_namespaces
def test_what_a_run_listens_on_is_out_of_reach(tmp_path):
    command = [sys.executable, str(LIB / "explore.py"), *SHORT, "--out", str(tmp_path / "run")]
    run = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    try:
        deadline = time.monotonic() + 120
        while (planner := open_planner(descendants())) is None:
            assert run.poll() is None, run.stderr.read()
            assert time.monotonic() < deadline
            time.sleep(0.1)
        interfaces = Path(f"/proc/{planner}/net/dev").read_text().splitlines()[2:]
        assert [line.split(":")[0].strip() for line in interfaces] == ["lo"]
        ours = set().union(*map(sockets_of, descendants()))
        assert len(ours & set(listening(planner))) > 5
        assert ours & set(listening("self")) == set()
    finally:
        run.send_signal(signal.SIGINT)
        said = run.communicate(timeout=120)[1]
    assert said.startswith("explore: interrupted") or said == ""
    assert len(said.splitlines()) <= 1


def test_where_it_is_refused_the_run_goes_on_and_says_so(tmp_path):
    out = tmp_path / "run"
    script = REFUSE + "import explore\nsys.exit(explore.main())"
    done = python(script, *SHORT, "--out", str(out))
    assert done.returncode == 0, done.stderr
    said = [line for line in done.stdout.splitlines() if "docs/security.md" in line]
    assert len(said) == 2  # when it happens, and among the run's warnings at its end
    assert all("Operation not permitted" in line and "all network interfaces" in line for line in said)
    warnings = json.loads((out / "run.json").read_text())["warnings"]
    assert [text in said[0] for text in warnings if "security.md" in text] == [True]


def test_a_shared_network_is_the_one_that_we_are_in():
    here = os.readlink("/proc/self/ns/net")
    assert explore.close_doors(explore.parse_arguments(["--shared-network"])) == ""
    assert os.readlink("/proc/self/ns/net") == here


def test_rviz_on_a_display_that_only_a_network_reaches_leaves_the_network_shared(monkeypatch):
    monkeypatch.setenv("DISPLAY", "localhost:10.0")
    text = explore.close_doors(explore.parse_arguments(["--rviz"]))
    assert "DISPLAY=localhost:10.0" in text
    assert "docs/security.md" in text


@pytest.mark.parametrize(
    ("display", "reached"),
    [
        *((text, True) for text in (":3", ":3.0", "unix:3")),
        *((text, False) for text in (":4", "", "host:3", ":x")),
    ],
)
def test_displays_with_a_socket_in_the_file_system_are_reached(display, reached, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(own_network, "X_SOCKETS", tmp_path)
    with socket.socket(socket.AF_UNIX) as server:
        server.bind("X3")  # relative: such names are short
        assert own_network.reaches_display(display) is reached


@needs_namespaces
def test_a_command_runs_there_and_its_exit_code_counts(tmp_path):
    script = (
        "import os, socket, sys\n"
        "server = socket.create_server(('localhost', 0)); socket.create_connection(server.getsockname())\n"
        "print(os.readlink('/proc/self/ns/net'), os.environ.get('DISPLAY')); sys.exit(7)"
    )
    command = [sys.executable, str(LIB / "own_network.py"), sys.executable, "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "DISPLAY": "host:1"})
    assert done.returncode == 7, done.stderr
    network, display = done.stdout.split()
    assert network != os.readlink("/proc/self/ns/net")
    assert display == "None"  # nothing there reaches it


def test_a_command_that_does_not_exist_is_named():
    command = [sys.executable, str(LIB / "own_network.py")]
    done = subprocess.run([*command, "no-such-command"], capture_output=True, text=True)
    assert done.returncode == 127
    assert done.stderr.splitlines()[-1] == "no-such-command: No such file or directory"
    assert subprocess.run(command, capture_output=True).returncode == 2


def test_it_is_too_late_when_there_are_threads():
    waiting = threading.Event()
    thread = threading.Thread(target=waiting.wait)
    thread.start()
    try:
        with pytest.raises(RuntimeError, match="before there are threads"):
            own_network.enter()
    finally:
        waiting.set()
        thread.join()


def test_a_refusal_changes_nothing():
    script = REFUSE + "print(own_network.enter(), '|', os.readlink('/proc/self/ns/net'))"
    said, network = python(script).stdout.split("|")
    assert "Operation not permitted" in said
    assert network.strip() == os.readlink("/proc/self/ns/net")


@pytest.mark.skipif(os.getuid() != 0, reason="only root can become another user")
def test_without_root_files_stay_the_users_own():
    someone = ("setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups")
    if not allowed(*someone):
        pytest.skip("the system allows users no network namespace")
    with tempfile.TemporaryDirectory() as name:  # tmp_path is closed to others
        folder = Path(name)
        shutil.copy(LIB / "own_network.py", folder)
        os.chown(folder, NOBODY, NOBODY)
        command = [*someone, sys.executable, str(folder / "own_network.py")]
        script = "id -u; echo >mine; readlink /proc/self/ns/net"
        done = subprocess.run([*command, "sh", "-c", script], capture_output=True, text=True, cwd=folder)
        user, network = done.stdout.split()
        assert user == str(NOBODY)
        assert (folder / "mine").stat().st_uid == NOBODY
        assert network != os.readlink("/proc/self/ns/net")
