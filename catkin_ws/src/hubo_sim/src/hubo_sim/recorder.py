"""The run as a video, from where the world's own camera stands; time in which physics sleeps is left out."""

from __future__ import annotations

import logging

from hubo_sim.errors import SimError
from hubo_sim.pictures import picture_of
from hubo_sim.simulator import Simulator
from hubo_sim.video import open_video

_SIZE_PX = (640, 480)
_log = logging.getLogger(__name__)


class Recorder:
    """Call `after_step` after each physics step and `close` at the end. Raises SimError for a bad path."""

    def __init__(self, sim: Simulator, path: str, rate_hz: float) -> None:
        self._sim, self._path = sim, path
        self._video = open_video(path, _SIZE_PX, rate_hz)
        self._every = max(round(sim.config.physics_rate_hz / rate_hz), 1)  # steps a frame

    def after_step(self) -> None:
        """Take a picture when one is due. When it cannot be stored that is logged once, and recording ends."""
        if self._video is None or self._sim.steps % self._every:
            return
        try:
            self._video.add(picture_of(self._sim.scene, self._sim.world.camera, *_SIZE_PX, fine=1))
        except SimError as err:
            self._give_up(err)

    def close(self) -> None:
        """Finish the file."""
        if self._video is None:
            return
        try:
            self._video.close()
            _log.info("video written to %s", self._path)
        except SimError as err:
            self._give_up(err)

    def _give_up(self, err: SimError) -> None:
        self._video = None
        _log.error("no video: %s", err)
