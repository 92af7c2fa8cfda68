"""scripts/explore with input that cannot work: one clear line, non-zero exit, nothing left behind."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).parents[2]
EXPLORE = SCRIPTS / "lib" / "explore.py"


def explore(*words: str, **environment: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, str(EXPLORE), *words],
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ, **environment},
    )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--world", "atlantis"], "shelf"),
        (["--robot", "r2d2"], "hubo"),
        (["--resolution", "7"], "0.005 to 0.5"),
        (["--views", "-1"], "--views is -1"),
        (["--config", "/nowhere.yaml"], "/nowhere.yaml"),
        (["--out", "/proc/run"], "/proc/run"),
        (["--port", "70000"], "--port is 70000"),
        (["--policy", "greedy"], "policy is 'greedy'; valid: frontier_void, or package.module:Class"),
        (["--policy", "no_lab.views:Best"], "No module named 'no_lab'"),
    ],
)
def test_bad_input_is_one_line_that_says_what_would_be_valid(words, said, tmp_path):
    out = [] if "--out" in words else ["--out", str(tmp_path / "run")]
    done = explore(*words, *out)
    assert done.returncode == 1
    assert said in done.stderr
    assert done.stderr.startswith("explore: ")
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "run").exists()


def test_an_unknown_parameter_is_named(tmp_path):
    config = tmp_path / "mine.yaml"
    config.write_text("map: {resolution: 0.05}\n")
    done = explore("--config", str(config), "--out", str(tmp_path / "run"))
    assert done.returncode == 1
    assert "map: unknown key 'resolution'" in done.stderr
    assert "resolution_m" in done.stderr


def test_parameters_of_a_policy_are_its_own(tmp_path):
    (tmp_path / "lab.py").write_text(
        "import dataclasses\n@dataclasses.dataclass\n"
        "class Best:\n    drawn: int = 3\n    def choose(self, situation): ...\n"
    )
    config = tmp_path / "mine.yaml"
    config.write_text("policy: lab:Best\npolicy_parameters: {dawn: 5}\n")
    done = explore("--config", str(config), "--out", str(tmp_path / "run"), PYTHONPATH=own_path(tmp_path))
    assert done.returncode == 1
    assert "policy_parameters of lab:Best: unknown key 'dawn' (did you mean 'drawn'?)" in done.stderr


def own_path(folder: Path) -> str:
    """The Python path with a folder of somebody's own modules before it."""
    return os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH")])])


@pytest.mark.parametrize(
    ("text", "said"), [("hello", "a mapping"), ("a: [1", "no valid YAML"), ("stop: 3", "stop")]
)
def test_a_broken_file_of_parameters_is_one_line(text, said, tmp_path):
    config = tmp_path / "mine.yaml"
    config.write_text(text)
    done = explore("--config", str(config), "--out", str(tmp_path / "run"))
    assert done.returncode == 1
    assert said in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize("command", ["explore", "test", "bench", "figures"])
def test_help_of_the_scripts_themselves(command):
    done = subprocess.run([str(SCRIPTS / command), "--help"], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0
    assert done.stdout.startswith("usage: ")


@pytest.mark.parametrize("command", ["explore", "test", "bench", "figures"])
def test_help_needs_no_set_up(command, tmp_path):
    common = Path("catkin_ws") / "src" / "fv_common"  # of the sources the only one that help needs
    shutil.copytree(SCRIPTS, tmp_path / "scripts")
    shutil.copytree(SCRIPTS.parent / common, tmp_path / common)
    done = subprocess.run(
        [str(tmp_path / "scripts" / command), "--help"],
        capture_output=True,
        text=True,
        timeout=120,
        env={"PATH": "/usr/bin:/bin"},
    )
    assert done.returncode == 0
    assert "options" in done.stdout
    assert {path.name for path in tmp_path.iterdir()} == {"scripts", "catkin_ws"}
    assert [path.name for path in (tmp_path / "catkin_ws").iterdir()] == ["src"]


def test_rviz_without_a_display_is_refused():
    done = explore("--rviz", DISPLAY="")
    assert done.returncode == 1
    assert "display" in done.stderr


def test_a_folder_with_results_in_it_is_not_touched(tmp_path):
    (tmp_path / "precious").write_text("results")
    done = explore("--out", str(tmp_path))
    assert done.returncode == 1
    assert "not empty" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["precious"]
