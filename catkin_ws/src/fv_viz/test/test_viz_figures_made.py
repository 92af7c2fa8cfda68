"""Some figures for real: simulator, map, RViz; skipped by name where one of them is missing."""

import shutil
import subprocess

import numpy as np
import pytest
from PIL import Image as Picture

from fv_viz.figures import compose

pytest.importorskip("hubo_sim")
pytest.importorskip("fv_exploration")
WANTED = {"2.2": ("red", "grey"), "3.2": ("purple",), "5.1": ("red", "blue"), "5.2": ("blue",)}


@pytest.mark.skipif(not shutil.which("Xvfb"), reason="no Xvfb")
@pytest.mark.skipif(not shutil.which("rosrun"), reason="no rosrun")
def test_figures_of_the_simulator_show_what_they_should(tmp_path):
    command = [
        "rosrun",
        "fv_viz",
        "figures",
        "--only",
        ",".join(WANTED),
        "--out",
        str(tmp_path),
        "--world",
        "shelf",
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    for number, hues in WANTED.items():
        path = tmp_path / f"figure_{number.replace('.', '_')}.png"
        with Picture.open(path) as picture:
            assert compose.faults(picture, hues) == []
            assert np.ptp(np.asarray(picture.convert("L"))) > 100
        assert "Data: hubo_sim world shelf" in path.with_suffix(".txt").read_text()


@pytest.mark.skipif(not shutil.which("rosrun"), reason="no rosrun")
@pytest.mark.skipif(not shutil.which("Xvfb"), reason="no Xvfb")
def test_a_figure_without_data_is_said_and_the_rest_is_made(tmp_path):
    command = ["rosrun", "fv_viz", "figures", "--only", "3.3,2.2", "--map", str(tmp_path / "none.h5")]
    done = subprocess.run([*command, "--out", str(tmp_path)], capture_output=True, text=True, timeout=300)
    assert done.returncode == 1
    assert "figure 3.3: not made" in done.stdout
    assert (tmp_path / "figure_2_2.png").exists()
