"""What the commands leave behind: whole files or none, and no traceback when Ctrl-C comes early."""

import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from hubo_sim.files import write_whole
from hubo_sim.pictures import write_png

NODES = Path(__file__).resolve().parents[1] / "nodes"
MAINS = {
    "ground_truth": "ground_truth_main",
    "render_scene": "render_main",
    "settle_world": "settle_main",
    "sim_node": "sim_main",
}


def test_a_picture_replaces_the_one_before_and_leaves_nothing_beside_it(tmp_path):
    for value in (10, 200):
        write_png(tmp_path / "a.png", np.full((4, 6, 3), value, np.uint8))
        assert np.asarray(Image.open(tmp_path / "a.png")).mean() == value
    assert [file.name for file in tmp_path.iterdir()] == ["a.png"]


def test_a_file_that_cannot_be_put_in_place_leaves_nothing_behind(tmp_path):
    (tmp_path / "folder" / "full").mkdir(parents=True)
    with pytest.raises(OSError):
        write_whole(tmp_path / "folder", b"data")
    assert [file.name for file in tmp_path.iterdir()] == ["folder"]


@pytest.mark.parametrize("node", MAINS)
def test_ctrl_c_while_a_command_imports_its_modules_is_no_traceback(node, tmp_path):
    package = tmp_path / "hubo_sim"  # stands in for the real one, whose imports take as long as they take
    package.mkdir()
    (package / "__init__.py").touch()
    (package / f"{MAINS[node]}.py").write_text(
        "import time\nprint('importing', flush=True)\ntime.sleep(600)\n"
    )
    process = subprocess.Popen(
        [sys.executable, str(NODES / node)],
        env={"PYTHONPATH": str(tmp_path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "importing\n"
    process.send_signal(signal.SIGINT)
    _, complaint = process.communicate()
    assert (process.returncode, complaint) == (-signal.SIGINT, "")
