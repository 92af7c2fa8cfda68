"""A supervised command: whatever is killed, and however, nothing of it remains."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

SUPERVISE = Path(__file__).parents[1] / "supervise.py"
OWN_NETWORK = SUPERVISE.with_name("own_network.py")
# The command starts a process in a session of its own, as a node is, which starts another one.
COMMAND = """
import os, subprocess, sys, time
node = "sleep 300 & echo $! >leaf; wait"
child = subprocess.Popen(["bash", "-c", node], start_new_session=True)
while not (os.path.exists("leaf") and open("leaf").read().strip()):
    time.sleep(0.02)
with open("pids.new", "w") as file:
    print(os.getppid(), os.getpid(), child.pid, open("leaf").read(), file=file)
os.rename("pids.new", "pids")
time.sleep(300)
"""


def supervise(*command: str, cwd: Path) -> subprocess.Popen:
    return subprocess.Popen([sys.executable, str(SUPERVISE), *command], cwd=cwd, start_new_session=True)


def code_of(*command: str, cwd: Path) -> int:
    """The exit code of a supervised command that ends soon."""
    top = supervise(*command, cwd=cwd)
    try:
        return top.wait(30)
    finally:
        top.kill()


def runs(pid: int) -> bool:
    """True for a process that is neither gone nor a zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def wait_until(condition, seconds: float = 30.0) -> bool:
    deadline = time.monotonic() + seconds
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.05)
    return condition()


@pytest.fixture(params=[[], [sys.executable, str(OWN_NETWORK)]], ids=["plain", "own network"])
def family(request, tmp_path):
    """The process that was called, and the ids below it: keeper, command, node, the node's child."""
    top = supervise(*request.param, sys.executable, "-c", COMMAND, cwd=tmp_path)
    assert wait_until((tmp_path / "pids").exists)
    pids = [int(word) for word in (tmp_path / "pids").read_text().split()]
    assert all(map(runs, pids))
    yield top, pids
    for pid in (top.pid, *pids):
        if runs(pid):
            os.kill(pid, signal.SIGKILL)
    top.wait()


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL])
def test_a_signal_to_the_one_that_was_called_ends_all(family, how):
    top, pids = family
    top.send_signal(how)
    assert wait_until(lambda: not any(map(runs, pids)))
    top.wait(10)


@pytest.mark.parametrize("victim", [0, 1], ids=["keeper", "command"])
def test_a_killed_process_in_the_middle_ends_all(family, victim):
    top, pids = family
    os.kill(pids[victim], signal.SIGKILL)
    assert top.wait(30) == 128 + signal.SIGKILL
    assert not any(map(runs, pids))


def test_a_closed_terminal_reaches_a_whole_group_and_ends_all(family):
    top, pids = family
    os.killpg(top.pid, signal.SIGHUP)
    assert top.wait(30) == 128 + signal.SIGTERM
    assert not any(map(runs, pids))


@pytest.mark.parametrize("code", [0, 3])
def test_the_exit_code_is_that_of_the_command(code, tmp_path):
    assert code_of("sh", "-c", f"exit {code}", cwd=tmp_path) == code


def test_what_a_finished_command_left_behind_is_ended(tmp_path):
    assert code_of("sh", "-c", "setsid sleep 300 & echo $! >left", cwd=tmp_path) == 0
    assert not runs(int((tmp_path / "left").read_text()))


def test_one_ctrl_c_is_one_interrupt(tmp_path):
    command = (
        "import signal, sys\n"
        "signal.signal(signal.SIGINT, lambda *_: print('once', flush=True))\n"
        "print('ready', flush=True)\n"
        "while True: signal.pause()"
    )
    top = subprocess.Popen(
        [sys.executable, str(SUPERVISE), sys.executable, "-c", command], stdout=subprocess.PIPE, text=True
    )
    assert top.stdout.readline() == "ready\n"
    top.send_signal(signal.SIGINT)
    assert top.stdout.readline() == "once\n"
    top.kill()
    assert top.stdout.read() == ""  # to the end: everyone that could write has gone
    top.wait()


def test_what_ignores_being_terminated_is_killed(tmp_path):
    stubborn = "trap '' TERM; echo $$ >left; sleep 300"
    command = f'setsid bash -c "{stubborn}" & until [ -s left ]; do sleep 0.02; done'.replace("$$", r"\$\$")
    assert code_of("bash", "-c", command, cwd=tmp_path) == 0
    assert not runs(int((tmp_path / "left").read_text()))
