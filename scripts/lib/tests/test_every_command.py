"""Every command and node of the workspace with what a stranger may do to it: one line, and an exit code.

They are found by their files: a new one is tested here without being named.
"""

from __future__ import annotations

import ast
import contextlib
import os
import re
import signal
import socket
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
SOURCES = ROOT / "catkin_ws" / "src"
DEVEL = ROOT / "catkin_ws" / "devel" / "lib"
LIMIT_S = 120.0  # for a machine that has other work
NODES = {"capability_node", "explore_node", "screenshot_node", "sim_node", "viz_node", "planner_node"}
"""They take no arguments and wait for a master; everything else is a command."""


SCRIPTS = sorted(path for path in SOURCES.glob("*/nodes/*") if path.is_file())


def programs() -> list[str]:
    """package/name of all that rosrun finds: our own scripts, and what CMake builds beside them."""
    names = {f"{path.parents[1].name}/{path.name}" for path in SCRIPTS}
    packages = {path.parent.name for path in SOURCES.glob("*/package.xml")}
    for path in DEVEL.glob("*/*"):
        own = path.parent.name in packages and path.is_file() and os.access(path, os.X_OK)
        if own and not path.name.endswith("_test") and not path.suffix:
            names.add(f"{path.parent.name}/{path.name}")
    return sorted(names)


COMMANDS = [name for name in programs() if name.split("/")[1] not in NODES]
NODE_PROGRAMS = [name for name in programs() if name.split("/")[1] in NODES]


def closed_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def environment(tmp_path) -> dict[str, str]:
    """No ROS master, and logs of their own."""
    master = f"http://localhost:{closed_port()}"
    return {**os.environ, "ROS_MASTER_URI": master, "ROS_LOG_DIR": str(tmp_path / "logs")}


def start(name: str, *words: str | Path, **options) -> subprocess.Popen:
    pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.Popen([DEVEL / name, *words], start_new_session=True, **pipes, **options)


def end(process: subprocess.Popen) -> tuple[int, str, list[str]]:
    """Exit code, output, and lines of errors without rospy's colours; what is left of the process ends with it."""
    try:
        out, err = (text.decode(errors="replace") for text in process.communicate(timeout=LIMIT_S))
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    lines = re.sub(r"\x1b\[[0-9;]*m", "", err).splitlines()
    assert "Traceback" not in out + err
    return process.returncode, out, [line for line in lines if line.strip()]


def test_all_are_found():
    assert len(COMMANDS) > 15
    assert {name.split("/")[1] for name in NODE_PROGRAMS} == NODES


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.name)
def test_every_script_starts_by_the_last_resort(path):
    """What runs before it may end in a traceback: only its import does."""
    code = ast.parse(path.read_text()).body
    code = code[1:] if ast.get_docstring(ast.parse(path.read_text())) else code
    assert [ast.unparse(line) for line in code[:1]] == ["from fv_common.command import run"]
    assert re.fullmatch(r"if __name__ == '__main__':\n    run\('[\w.]+:\w+'\)", ast.unparse(code[1]))
    assert len(code) == 2


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_tells_in_a_line_what_it_cannot_use(name, environment, tmp_path):
    """A word that is no option, a folder, and a file of garbage whose name is no text; and it has --help."""
    folder, garbage = tmp_path / "folder", Path(os.fsdecode(os.fsencode(tmp_path) + b"/no\xfftext"))
    folder.mkdir()
    garbage.write_bytes(bytes(range(256)) * 16)
    more = [tmp_path / "out"] if name == "fv_viz/to_mcap" else []
    tries = {word: [word, *more] for word in ("--no-such-option", folder, garbage, "--help")}
    running = {word: start(name, *words, cwd=tmp_path, env=environment) for word, words in tries.items()}
    done = {word: end(process) for word, process in running.items()}
    assert done["--help"][0] == 0 and done["--help"][2] == []
    assert "usage: " in done.pop("--help")[1]
    for word, (code, _out, lines) in done.items():
        assert code in (1, 2), (word, lines)  # neither a success, nor a signal, nor something unforeseen
        assert 1 <= len(lines) <= 2, (word, lines)  # two: what is wrong with the file, and that none is left
    assert not list(tmp_path.glob("logs/*-errors.log"))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", NODE_PROGRAMS)
def test_a_node_without_a_master_says_so_once_and_ctrl_c_ends_it(name, environment, tmp_path):
    process = start(name, cwd=tmp_path, env=environment)
    said = os.read(process.stderr.fileno(), 10_000).decode()  # the suite's time limit bounds the wait
    process.send_signal(signal.SIGINT)
    code, _out, lines = end(process)
    assert said.count("\n") == 1 and environment["ROS_MASTER_URI"] in said
    assert code in (0, 130), lines
    assert [line for line in lines if "interrupted" not in line] == []


@pytest.mark.parametrize("name", [name for name in NODE_PROGRAMS if not name.endswith("planner_node")])
def test_a_node_names_an_address_that_is_none(name, environment, tmp_path):
    code, _out, lines = end(start(name, cwd=tmp_path, env={**environment, "ROS_MASTER_URI": "somewhere"}))
    assert code == 1
    assert len(lines) == 1 and "ROS_MASTER_URI is 'somewhere'; valid: http://HOST:PORT" in lines[0]
