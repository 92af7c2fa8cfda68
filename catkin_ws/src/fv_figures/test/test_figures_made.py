"""Every figure for real: simulator, maps, planner, RViz; skipped by name where one of them is missing."""

import shutil
import subprocess

import numpy as np
import pytest
from PIL import Image as Picture

from fv_figures import compose
from fv_figures.catalogue import FIGURES

for package in ("hubo_sim", "fv_exploration", "capability_map"):
    pytest.importorskip(package)
pytestmark = [
    pytest.mark.skipif(not shutil.which(program), reason=f"no {program}") for program in ("Xvfb", "rosrun")
]
# Least shares of hues in the whole picture; samples of the legend are below 0.2 %.
WANTED = {
    "2.2": {"red": 0.01, "grey": 0.1},
    "3.1": {"blue": 0.05},
    "3.2": {"purple": 0.01},
    "3.3": {"grey": 0.02},
    "3.4": {"grey": 0.01, "blue": 0.005},
    "3.5": {"blue": 0.005},
    "3.6": {"blue": 0.05},
    "4.1": {"grey": 0.03},
    "5.1": {"red": 0.1, "blue": 0.01},
    "5.2": {"blue": 0.03},
    "5.3": {"blue": 0.03},
    "5.4": {"orange": 0.001},
    "5.5": {"blue": 0.003},
    "5.6": {"grey": 0.01},
    "5.7": {"blue": 0.01},
    "5.8": {"green": 0.004, "orange": 0.004},
}


def run(*words):
    return subprocess.run(["rosrun", *map(str, words)], capture_output=True, text=True, timeout=1400)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """All figures, made once."""
    folder = tmp_path_factory.mktemp("figures")
    built = run("capability_map", "build", "--robot", "hubo", "--coarse", "--out", folder / "map.h5")
    assert built.returncode == 0, built.stdout + built.stderr
    done = run("fv_figures", "figures", "--out", folder, "--world", "shelf", "--map", folder / "map.h5")
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.mark.parametrize("number", FIGURES)
def test_the_picture_shows_what_it_should(made, number):
    path = made / f"figure_{number.replace('.', '_')}.png"
    with Picture.open(path) as picture:
        assert compose.faults(picture, WANTED[number]) == []
        assert np.ptp(np.asarray(picture.convert("L"))) > 100
    told = path.with_suffix(".txt").read_text().splitlines()
    assert [line.split(":")[0] for line in told[1:]] == ["Data", "Command", "The thesis", "What differs"]
    assert f"scripts/figures --only {number} --world shelf" in told[2]
    assert path.name in (made / "index.html").read_text()


def test_a_figure_without_data_is_said_and_the_rest_is_made(tmp_path):
    done = run("fv_figures", "figures", "--only", "3.3,2.2", "--map", tmp_path / "none.h5", "--out", tmp_path)
    assert done.returncode == 1
    assert "figure 3.3: not made" in done.stdout
    assert (tmp_path / "figure_2_2.png").exists()
