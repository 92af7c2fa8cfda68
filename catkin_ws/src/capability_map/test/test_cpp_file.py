"""The C++ reader of map files, through its command `query`: the answers of Python, and no crash on any file."""

from __future__ import annotations

import resource
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


def test_a_grid_that_lies_takes_no_memory(map_path, tmp_path):
    path = tmp_path / "lies.h5"
    path.write_bytes(map_path.read_bytes())
    with h5py.File(path, "r+") as file:
        file["grid/size"][...] = [400, 500, 500]
        file["spheres/cell"][...] = np.arange(len(file["spheres/cell"]))
    sign(path)
    with pytest.raises(
        CapabilityMapError, match=r"lies\.h5: 100000000 cells with \d+ directions need more than 512 MiB"
    ):
        CapabilityMap.load(path)
    assert "directions need more than 512 MiB" in ask(path).stderr


def test_wrong_words_on_the_command_line_are_explained(map_path):
    assert ask(map_path, "", "--no-such-option").returncode == 2
    assert ask(map_path, "0 0 zero 0 0 1").returncode == 1
    assert "VIEWS" in ask("--help").stderr
