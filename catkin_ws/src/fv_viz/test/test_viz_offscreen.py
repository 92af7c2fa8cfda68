"""What is said when pictures cannot be taken: no display, an RViz that fails and fails again."""

import shutil
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from fv_viz.config import ScreenshotConfig
from fv_viz.offscreen import camera, xvfb


@pytest.fixture
def failing(monkeypatch):
    """An RViz that starts and then fails; the list of its deaths."""
    deaths = []

    class Failing:
        def __init__(self, config, display):
            pass

        def order(self, order, timeout_s):
            deaths.append(f"fate {len(deaths) + 1}")
            raise camera.RvizFailed(deaths[-1])

        def close(self):
            pass

    monkeypatch.setattr(camera, "RvizProcess", Failing)
    monkeypatch.setenv("DISPLAY", ":nowhere")
    return deaths


def test_an_rviz_that_fails_is_started_once_more_and_then_named(failing):
    taker = camera.Camera(ScreenshotConfig())
    with pytest.raises(camera.RvizFailed, match="fate 2; before its restart: fate 1"):
        taker.take({"grab": "a.png"})
    taker.close()
    assert len(failing) == 2


def test_a_camera_that_is_closed_does_not_wait_for_its_picture_nor_start_again(monkeypatch):
    asked, ended = threading.Event(), threading.Event()
    starts = []

    class Hanging:
        def __init__(self, config, display):
            starts.append(display)

        def order(self, order, timeout_s):
            asked.set()
            assert ended.wait(30), "nobody closed it"
            raise camera.RvizFailed("died with code -15")

        def close(self):
            ended.set()

    monkeypatch.setattr(camera, "RvizProcess", Hanging)
    monkeypatch.setenv("DISPLAY", ":nowhere")
    taker = camera.Camera(ScreenshotConfig())
    with ThreadPoolExecutor() as others:
        picture = others.submit(taker.take, {"grab": "a.png"})
        assert asked.wait(30)
        taker.close()
        with pytest.raises(camera.RvizFailed, match="died with code -15"):
            picture.result(30)
    assert len(starts) == 1


def test_neither_display_nor_xvfb_is_said_and_nothing_is_left_behind(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr(xvfb.shutil, "which", lambda name: None)
    taker = camera.Camera(ScreenshotConfig())
    with pytest.raises(RuntimeError, match="no display and no Xvfb"):
        taker.start()
    taker.close()


@pytest.mark.skipif(not shutil.which("Xvfb"), reason="no Xvfb")
def test_an_x_server_of_our_own_has_a_free_number_and_leaves_the_socket_files_of_others_alone():
    """From a network namespace of its own it does not see that a number is taken, but the files are everyone's."""
    before = x_socket_files()
    one, two = xvfb.Xvfb(), xvfb.Xvfb()
    assert one.name != two.name
    assert x_socket_files() == before
    one.close()
    two.close()
    assert x_socket_files() == before


def x_socket_files() -> dict[str, int]:
    """Name and inode of each socket file of an X server."""
    return {path.name: path.stat().st_ino for path in Path("/tmp/.X11-unix").glob("X*")}
