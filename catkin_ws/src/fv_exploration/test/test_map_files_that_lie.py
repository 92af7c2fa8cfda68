"""Map files that promise more than there is are refused before memory is taken for it, and never waited for."""

import os
import resource
import subprocess
import sys

import pytest

READ = """
import sys, fv_exploration
try: fv_exploration.OccupancyMap.read(sys.argv[1])
except (ValueError, fv_exploration.MapFileError) as err: print(err)
"""


def refusal(path):
    """What reading says, with 2 GiB of addresses."""
    done = subprocess.run(
        [sys.executable, "-c", READ, str(path)],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30)),
    )
    assert done.returncode == 0, done.stderr
    (line,) = done.stdout.splitlines()
    assert line.startswith(f"{path}: ")
    return line


def header(first, nodes):
    return f"# Octomap {first}\nid OcTree\nsize {nodes}\nres 0.05\ndata\n".encode()


@pytest.mark.parametrize("name,first", [("m.bt", "OcTree binary file"), ("m.ot", "OcTree file")])
def test_a_header_that_promises_terabytes(tmp_path, name, first):
    path = tmp_path / name
    path.write_bytes(header(first, 10**12) + bytes(5 if name == "m.ot" else 2))
    assert "has 1 nodes, its header says 1000000000000" in refusal(path)


@pytest.mark.parametrize("name", ["m.bt", "m.ot"])
def test_a_file_of_terabytes(tmp_path, name):
    path = tmp_path / name
    path.touch()
    os.truncate(path, 1 << 42)  # a hole: it takes no disk
    assert "has 4398046511104 bytes; valid: at most 2 GiB" in refusal(path)


def test_what_is_no_file(tmp_path):
    (tmp_path / "folder.ot").mkdir()
    os.mkfifo(tmp_path / "pipe.ot")
    for name in ("folder.ot", "pipe.ot", "nothing.ot"):
        assert "cannot be opened" in refusal(tmp_path / name)
