"""The C++ reader of map files, through its command `query`: the answers of Python, and no crash on any file."""

from __future__ import annotations

import contextlib
import os
import resource
import signal
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from test_store import sign

from capability_map import CapabilityMap, CapabilityMapError, _core, check

QUERY = Path(_core.__file__).parents[3] / "capability_map" / "query"


def ask(path, views: str = "", *options: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        [QUERY, path, *options], input=views, capture_output=True, text=True, check=False, timeout=300
    )


@pytest.mark.parametrize("interpolate", [True, False])
def test_cpp_and_python_answer_alike(cap, map_path, interpolate):
    positions, directions = check.random_views(cap, 1000, 8)
    views = "\n".join(" ".join(map(repr, row)) for row in np.hstack([positions, directions]).tolist())
    done = ask(map_path, views, *([] if interpolate else ["--nearest"]))
    assert done.returncode == 0, done.stderr
    lines = [line.split() for line in done.stdout.splitlines()]
    answers = cap.query(positions, directions, interpolate)
    assert np.allclose([float(words[0]) for words in lines], answers, atol=1e-7)
    assert [words[1] == "yes" for words in lines] == (answers >= cap.threshold).tolist()
    covered = cap.covered(positions, directions)
    assert (
        np.mean([(words[2] == "yes") == answer for words, answer in zip(lines, covered, strict=True)]) > 0.998
    )
    seeds, _ = cap.seeds(positions, directions)
    for words, seed in zip(lines, seeds, strict=True):
        joints = [float(word) for word in words[3:]]
        assert np.isnan(seed).all() if not joints else np.allclose(joints, seed, atol=1e-6)
    assert any(len(words) > 3 for words in lines)


def test_damaged_files_are_refused_in_plain_words(map_path, tmp_path):
    content = map_path.read_bytes()
    random = np.random.default_rng(2)
    path = tmp_path / "damaged.h5"
    for i in range(120):
        damaged = bytearray(content)
        if i % 4 == 0:
            damaged = damaged[: random.integers(0, len(damaged))]
        else:
            damaged[random.integers(512, len(damaged))] ^= int(random.integers(1, 256))
        path.write_bytes(damaged)
        done = ask(path)
        assert done.returncode == 1
        assert "damaged" in done.stderr or "not a capability map" in done.stderr
    assert "cannot read" in ask(tmp_path / "nothing.h5").stderr
    assert ask(tmp_path).returncode == 1


def test_a_wrong_content_under_a_right_checksum_never_crashes(map_path, tmp_path):
    content = map_path.read_bytes()
    path = tmp_path / "changed.h5"
    names = []
    with h5py.File(map_path, "r") as file:
        file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
        attributes = list(file.attrs)
    replacements = (None, np.zeros(3), np.full((2, 3), np.nan), np.array([b"words"]), np.zeros((0, 3)))
    for i, name in enumerate(names + attributes):
        path.write_bytes(content)
        with h5py.File(path, "r+") as file:
            place = file if name in names else file.attrs
            del place[name]
            if (value := replacements[i % len(replacements)]) is not None:
                place[name] = value
        sign(path)
        done = ask(path, "0 0 0.4 0 0 1")
        assert done.returncode in (0, 1)
        assert done.returncode == 0 or str(path) in done.stderr


def lies_about_a_size(map_path, path, name):
    """A map whose dataset promises some terabytes, of which nothing was written."""
    path.write_bytes(map_path.read_bytes())
    with h5py.File(path, "r+") as file:
        kind, rank = file[name].dtype, file[name].ndim
        del file[name]
        file.create_dataset(name, (1 << 40, *[3] * (rank - 1)), kind, chunks=(64, *[3] * (rank - 1)))
    sign(path)


READ = """
import sys, capability_map
try: capability_map.CapabilityMap.load(sys.argv[1])
except capability_map.CapabilityMapError as err: print(err)
"""


@pytest.mark.parametrize("name", ["spheres/cell", "spheres/bits", "directions/outward", "points/witness"])
@pytest.mark.parametrize("reader", [[QUERY], [sys.executable, "-c", READ]], ids=["C++", "Python"])
def test_a_size_that_lies_takes_no_memory(map_path, tmp_path, name, reader):
    path = tmp_path / "lies.h5"
    lies_about_a_size(map_path, path, name)
    done = subprocess.run(
        [*reader, path],
        input="",
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30)),
    )
    told = done.stdout + done.stderr
    assert f"{path}: dataset {name} promises more numbers than a file of this size can hold" in told
    assert len(told.splitlines()) == 1


@pytest.mark.parametrize("size", [[400, 500, 500], [2**31 - 1] * 3])
def test_a_grid_that_lies_takes_no_memory(map_path, tmp_path, size):
    path = tmp_path / "lies.h5"
    path.write_bytes(map_path.read_bytes())
    with h5py.File(path, "r+") as file:
        file["grid/size"][...] = size
        file["spheres/cell"][...] = np.arange(len(file["spheres/cell"]))
    sign(path)
    with pytest.raises(CapabilityMapError, match=r"lies\.h5: its grid has \d+ cells; valid: up to 20000000"):
        CapabilityMap.load(path)
    assert "its grid" in ask(path).stderr


def test_wrong_words_on_the_command_line_are_explained(map_path):
    for words in (["--no-such-option"], ["--nearest", "more"]):
        done = ask(map_path, "", *words)
        assert (done.returncode, done.stdout) == (2, "")
        assert done.stderr == "query: valid: MAP, or MAP --nearest; --help says more\n"
    helped = ask("--help")
    assert helped.returncode == 0
    assert "VIEWS" in helped.stdout and "covered" in helped.stdout


GOOD = "0 0 0.4 0 0 1"


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("nan 0 0 0 0 1", "'nan' is no finite number of 64 bits"),
        ("0 0 inf 0 0 1", "'inf' is no finite number"),
        ("0 0 zero 0 0 1", "'zero' is no finite number"),
        ("0 0 0x10 0 0 1", "'0x10' is no finite number"),
        ("0 0 1e400 0 0 1", "'1e400' is no finite number"),
        ("0 0 1,5 0 0 1", "'1,5' is no finite number"),
        ("0 0 +-1 0 0 1", "'+-1' is no finite number"),
        ("1 2 3", "'1 2 3' has 3 numbers; valid: six, x y z dx dy dz"),
        ("1", "'1' has 1 number; valid: six"),
        ("1 2 3 0 0 1 9", "'1 2 3 0 0 1 9' has 7 numbers; valid: six"),
        ("0 0 0.4 0 0 0", "direction (0, 0, 0) is not valid: three finite numbers, not all 0"),
        ("hello", "'hello' is no finite number"),
        ("\x00\x01\x7f\xff\x1b[31m" + 50 * "z", "'????"),
        (5000 * "1 ", "is longer than 4096 characters"),
    ],
)
def test_a_line_that_is_no_view_is_named_and_ends_it(map_path, line, told):
    done = ask(map_path, f"{GOOD}\n\n{line}\n{GOOD}\n")
    assert done.returncode == 1
    assert done.stderr.startswith("query: line 3: ") and told in done.stderr
    assert done.stderr.count("\n") == 1 and len(done.stderr) < 200
    assert done.stdout == ask(map_path, GOOD + "\n").stdout + "\n"  # what came before is answered


@pytest.mark.parametrize("line", [GOOD, "0 0 .4 0 0 1e-9", "\t0  0\t+0.4 0 0 1e160 ", "-0 0 0.4 -0 0 7"])
@pytest.mark.parametrize("end", ["\n", "\r\n", ""])
def test_one_rule_for_whatever_way_a_view_is_written(map_path, line, end):
    done = ask(map_path, line + end)
    assert done.returncode == 0, done.stderr
    assert done.stdout == ask(map_path, GOOD + "\n").stdout


def test_a_line_of_answers_for_each_line_that_is_read(map_path):
    done = ask(map_path, f"# a comment\n\n{GOOD}\n   \n  # {GOOD}\n{GOOD}")
    answer = ask(map_path, GOOD).stdout
    assert done.returncode == 0
    assert done.stdout == f"# a comment\n\n{answer}   \n  # {GOOD}\n{answer}"
    assert ask(map_path, "").stdout == ""


def test_input_and_output_that_fail_are_told(map_path, tmp_path):
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [QUERY, map_path], input=GOOD, stdout=full, stderr=subprocess.PIPE, text=True, timeout=60
        )
    assert (done.returncode, done.stderr) == (
        1,
        "query: the answers cannot be written: No space left on device\n",
    )
    folder = os.open(tmp_path, os.O_RDONLY)
    done = subprocess.run([QUERY, map_path], stdin=folder, capture_output=True, text=True, timeout=60)
    os.close(folder)
    assert (done.returncode, done.stderr) == (1, "query: line 1: cannot be read: Is a directory\n")


def test_a_reader_who_leaves_is_no_error(map_path):
    process = subprocess.Popen(
        [QUERY, map_path], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    process.stdin.write(GOOD + "\n")
    process.stdin.flush()
    process.stdout.readline()
    process.stdout.close()
    with contextlib.suppress(BrokenPipeError):
        process.stdin.write(1000 * (GOOD + "\n"))
        process.stdin.close()
    assert process.stderr.read() == ""
    assert process.wait(60) == 128 + signal.SIGPIPE
