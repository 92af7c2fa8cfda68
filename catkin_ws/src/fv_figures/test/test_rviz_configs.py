"""fv_viz's RViz configurations with the real nodes behind them: every display on, none with an error."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import rospkg
from PIL import Image as Picture

from fv_figures import compose, plans, sources
from fv_figures.stage import Stage
from fv_viz.config import ScreenshotConfig
from fv_viz.offscreen.camera import Camera

for package in ("hubo_sim", "fv_exploration", "capability_map"):
    pytest.importorskip(package)
pytestmark = [
    pytest.mark.skipif(not shutil.which(program), reason=f"no {program}") for program in ("Xvfb", "rosrun")
]


CONFIGS = Path(rospkg.RosPack().get_path("fv_viz")) / "rviz"


@pytest.fixture(scope="module")
def stage():
    """Simulator's robot in the world, marker node, master; one for all, for a process knows one master only."""
    with Stage() as out:
        out.start_pose = plans.bring_robot(out, "hubo")
        yield out


@pytest.fixture
def opened(stage, tmp_path):
    """Opens a configuration; what it gives takes pictures from its own camera, and no display may have an error."""
    cameras = []

    def open_config(name):
        cameras.append(Camera(ScreenshotConfig(config=str(CONFIGS / name), width=960, height=720)))
        return take

    def take(show="*", expect=None):
        order = {"grab": str(tmp_path / "a.png"), "show": [show], "hide": ["*"], "settle_s": 20.0}
        reply = cameras[-1].take({**order, "expect": stage.expected() + (expect or [])})
        picture = Picture.open(order["grab"]).convert("RGB")
        assert reply["errors"] == []
        assert reply["absent"] == []
        assert compose.faults(picture, {}) == []
        return picture

    yield open_config
    for camera in cameras:
        camera.close()


def share_of(picture, hue):
    return compose.hue_shares(np.asarray(picture, dtype=np.float32).reshape(-1, 3) / 255.0)[hue]


def test_exploration_opens_on_a_real_scan(stage, opened):
    scans = sources.simulated("shelf", "hubo", 0.05)
    stage.volume(scans.volume())
    stage.evaluation(scans.first)
    assert share_of(opened("exploration.rviz")(), "red") > 0.002


def test_planning_opens_on_a_real_plan(stage, opened):
    stage.path(plans.planned_path(stage, "hubo", stage.start_pose)[0])
    picture = opened("planning.rviz")()
    assert share_of(picture, "green") > 0.002
    assert share_of(picture, "orange") > 0.002


def test_capability_opens_on_the_real_node(stage, opened, tmp_path):
    out = str(tmp_path / "map.h5")
    command = ["rosrun", "capability_map", "build", "--robot", "hubo", "--coarse", "--out", out]
    subprocess.run(command, check=True, capture_output=True, timeout=300)
    stage.run("capability_map", "capability_node", f"_map:={out}")
    stage.wait_for("/capability_map/spheres")
    take = opened("capability.rviz")
    markers = [f"/capability_map/{name}" for name in ("spheres", "index_cuts", "shapes")]
    alone, everything = take("Robot"), take(expect=markers)
    difference = np.abs(np.asarray(everything, dtype=int) - np.asarray(alone, dtype=int)).max(axis=-1)
    assert (difference > 40).mean() > 0.02
