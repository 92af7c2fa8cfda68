"""The fuzzer's own behaviour, on toy targets: what is found is told with its input, and what hangs ends."""

from __future__ import annotations

import shlex
import subprocess
import sys
from pathlib import Path

import fuzzing
import pytest

CRASH = "def one_input(data):\n    if data[:1] == b'!':\n        raise ValueError('a finding')\n"
SOUND = "def one_input(data):\n    bytes(data)\n"
GREEDY = "def one_input(data):\n    bytearray(1 << 40)\n"


@pytest.fixture
def target(tmp_path, monkeypatch):
    """Makes a target of a text."""
    if not fuzzing.is_python_ready():
        pytest.skip("atheris is not installed: scripts/test --fuzz 1 does it")
    monkeypatch.setattr(fuzzing, "STATE", tmp_path / "state")

    def make(text: str, *seeds: bytes) -> fuzzing.Target:
        folder = tmp_path / "toys" / "fuzz"
        (folder / "corpus" / "toy").mkdir(parents=True)
        (folder / "toy.py").write_text(text)
        for i, seed in enumerate(seeds):
            (folder / "corpus" / "toy" / str(i)).write_bytes(seed)
        (found,) = fuzzing.find_targets(["toys"], tmp_path)
        return found

    return make


def test_a_finding_is_told_with_the_input_that_shows_it_again(target, tmp_path):
    (outcome,) = fuzzing.fuzz([target(CRASH, b"?1", b"!2")], 2.0, tmp_path, lasting=False)
    assert "ValueError: a finding" in outcome.problem
    again = outcome.problem.splitlines()[-1].strip()
    assert again.startswith("again: . scripts/env; ")
    *_, driver, file, finding = shlex.split(again)
    assert Path(finding).read_bytes()[:1] == b"!"
    done = subprocess.run(
        [sys.executable, driver, file, finding],
        capture_output=True,
        text=True,
        check=False,
        env={"PYTHONPATH": str(fuzzing.PYTHON)},
    )
    assert done.returncode != 0 and "a finding" in done.stdout + done.stderr


def test_a_sound_target_runs_its_share_and_tells_its_figures(target, tmp_path):
    (outcome,) = fuzzing.fuzz([target(SOUND, b"seed")], 2.0, tmp_path, lasting=True)
    assert outcome.problem == ""
    assert outcome.runs > 10 and outcome.cpu_s > 0.0


def test_memory_that_a_header_promises_is_not_there(target, tmp_path):
    (outcome,) = fuzzing.fuzz([target(GREEDY)], 2.0, tmp_path, lasting=False)
    assert "MemoryError" in outcome.problem


def test_a_target_that_hangs_ends(target, tmp_path, monkeypatch):
    monkeypatch.setattr(fuzzing, "GRACE_S", 0.0)
    (outcome,) = fuzzing.fuzz([target("import time\ntime.sleep(1000)\n")], 1.0, tmp_path, lasting=False)
    assert "did not end by itself" in outcome.problem


def test_every_target_of_the_workspace_has_seeds():
    packages = [path.parent.name for path in fuzzing.SOURCES.glob("*/package.xml")]
    targets = fuzzing.find_targets(packages)
    assert len(targets) >= 14
    assert [t.title for t in targets if not any(t.seeds.glob("*"))] == []


def test_without_a_compiler_targets_are_skipped_by_name(monkeypatch):
    monkeypatch.setattr(fuzzing.shutil, "which", lambda _name: None)
    lacks = {t.name: t.lacks for t in fuzzing.find_targets(["fv_robot_model"])}
    assert lacks == dict.fromkeys(("mesh", "robot_xml"), "clang++ is not installed (requirements/apt.txt)")
