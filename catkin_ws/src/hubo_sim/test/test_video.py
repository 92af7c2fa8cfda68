"""Videos of a run: as many frames as they should have, of what happened; what cannot be recorded is told."""

import json
import shutil
import subprocess

import numpy as np
import pytest
from PIL import Image

from hubo_sim.config import SimConfig
from hubo_sim.control.trajectory_goal import TrajectoryGoal
from hubo_sim.errors import SimError
from hubo_sim.recorder import Recorder
from hubo_sim.robot_source import load_robot_spec
from hubo_sim.simulator import Simulator
from hubo_sim.video import open_video
from hubo_sim.worlds import load_world


def frames_of(path):
    with Image.open(path) as gif:
        out = []
        for i in range(gif.n_frames):
            gif.seek(i)
            out.append(np.asarray(gif.convert("RGB"), int))
        return out, gif.info["duration"]


def test_gif_of_a_run_shows_the_arm_in_motion(tmp_path):
    sim = Simulator(load_robot_spec("kuka_iiwa"), load_world("empty"), SimConfig())
    recorder = Recorder(sim, str(tmp_path / "run.gif"), 8.0)
    (controller,) = sim.controllers.values()
    target = [*controller.set_point.position[:-1], controller.set_point.position[-1]]
    target[0] += 1.0
    controller.start(TrajectoryGoal(controller.names, [1.0], [target], [[0.0] * 7], [[]]), 0.0, "turn")
    for _ in range(240):
        sim.step()
        recorder.after_step()
    recorder.close()
    sim.close()
    frames, duration_ms = frames_of(tmp_path / "run.gif")
    assert (len(frames), frames[0].shape, duration_ms) == (8, (480, 640, 3), 120)  # GIF counts in 10 ms
    assert np.abs(frames[0] - frames[-1]).max(axis=-1).astype(bool).mean() > 0.005


def test_long_gif_keeps_the_whole_run_in_larger_steps(tmp_path):
    video = open_video(str(tmp_path / "long.gif"), (16, 16), 10.0)
    for i in range(1000):
        video.add(np.full((16, 16, 3), i // 4, np.uint8))
    video.close()
    frames, _ = frames_of(tmp_path / "long.gif")
    assert 125 <= len(frames) <= 301
    assert frames[0].max() < 8 and frames[-1].min() > 240


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="ffmpeg is not installed")
def test_mp4_has_every_frame_at_its_rate(tmp_path):
    path = tmp_path / "run.mp4"
    video = open_video(str(path), (64, 48), 10.0)
    for i in range(30):
        video.add(np.full((48, 64, 3), 8 * i, np.uint8))
    video.close()
    asked = "stream=codec_name,width,height,nb_frames,r_frame_rate"
    probe = subprocess.run(
        ["ffprobe", "-v", "error", "-show_entries", asked, "-of", "json", str(path)],
        capture_output=True,
        check=True,
    )
    stream = json.loads(probe.stdout)["streams"][0]
    assert (stream["codec_name"], stream["width"], stream["height"]) == ("h264", 64, 48)
    assert (stream["nb_frames"], stream["r_frame_rate"]) == ("30", "10/1")


def test_what_cannot_be_recorded_is_told_before_the_run(tmp_path, monkeypatch):
    for name, word in (("run.avi", "must end in .mp4 or .gif"), ("no/run.gif", "no such folder")):
        with pytest.raises(SimError, match=word):
            open_video(str(tmp_path / name), (16, 16), 10.0)
    monkeypatch.setattr(shutil, "which", lambda _: None)
    with pytest.raises(SimError, match="needs the program ffmpeg"):
        open_video(str(tmp_path / "run.mp4"), (16, 16), 10.0)
