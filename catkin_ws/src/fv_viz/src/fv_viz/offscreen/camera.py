"""Takes pictures through an RViz process: starts it, watches its time, and starts it once more when it fails."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

from fv_common import processes
from fv_viz.config import ScreenshotConfig
from fv_viz.offscreen.xvfb import Xvfb


class RvizFailed(RuntimeError):
    """RViz died, hung or did not start."""


class RvizProcess:
    """One running RViz.

    Raises RvizFailed when it does not come up.
    """

    def __init__(self, config: ScreenshotConfig, display: str) -> None:
        reader, writer = os.pipe()
        self._replies: int | None = reader
        self._closing = threading.Lock()
        self._display = display
        environment = {**os.environ, "DISPLAY": display}
        environment.setdefault("LIBGL_ALWAYS_SOFTWARE", "1")
        environment.setdefault("QT_X11_NO_MITSHM", "1")
        arguments = [config.config, str(config.width), str(config.height), str(writer)]
        with open(config.log or os.devnull, "ab") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "fv_viz.offscreen.rviz_process", *arguments],
                stdin=subprocess.PIPE,
                stdout=log,
                stderr=log,
                pass_fds=[writer],
                env=environment,
                preexec_fn=processes.die_with_parent,
            )
        os.close(writer)
        self._read(config.start_timeout_s, "start")

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    def order(self, order: dict, timeout_s: float) -> dict:
        """Send one order and wait for its reply; raises RvizFailed, or ValueError when RViz refuses the order."""
        if self._replies is None:
            raise RvizFailed("RViz has been closed")
        try:
            self._process.stdin.write(json.dumps(order).encode() + b"\n")
            self._process.stdin.flush()
        except OSError as error:
            raise RvizFailed(f"RViz has died ({error})") from error
        reply = self._read(timeout_s, "picture")
        if not reply["ok"]:
            raise ValueError(reply["message"])
        return reply

    def close(self) -> None:
        """End RViz; a second call does nothing."""
        with self._closing:  # who waits for a reply closes, too, when RViz ends
            if self._replies is None:
                return
            processes.stop(self._process, patience_s=1.0)
            self._process.stdin.close()
            os.close(self._replies)
            self._replies = None

    def _fate(self, timeout_s: float) -> str:
        try:
            return f"died with code {self._process.wait(1.0)}"
        except subprocess.TimeoutExpired:
            return f"did not answer within {timeout_s:g} s"

    def _read(self, timeout_s: float, what: str) -> dict:
        line = processes.read_line(self._replies, timeout_s)
        if line is None:
            fate = self._fate(timeout_s)
            self.close()
            raise RvizFailed(f"RViz {fate} ({what}, display {self._display})")
        return json.loads(line)


class Camera:
    """Pictures on demand; owns the display (its own Xvfb when there is none) and the RViz process.

    Both start with the first picture or start(), which raise RuntimeError when there is neither a display nor Xvfb.
    """

    def __init__(self, config: ScreenshotConfig) -> None:
        self._config = config
        self._server: Xvfb | None = None
        self._rviz: RvizProcess | None = None
        self._closed = False
        # One thread for all orders: programs end with the thread that started them, see die_with_parent.
        self._worker = ThreadPoolExecutor(max_workers=1)

    @property
    def rviz_pid(self) -> int | None:
        """Process id of the running RViz, None when there is none."""
        return self._rviz.pid if self._rviz else None

    def start(self) -> None:
        """Start RViz if it does not run; raises RvizFailed."""
        self._worker.submit(self._start).result()

    def take(self, order: dict) -> dict:
        """One picture; RViz is started again once when it fails.

        Raises RvizFailed when it fails twice, ValueError for an order that RViz refuses (unknown display or view).
        """
        return self._worker.submit(self._take, {"settle_s": self._config.settle_s, **order}).result()

    def close(self) -> None:
        """End RViz and the X server that was started here; a picture that is being waited for fails."""
        self._closed = True
        self._end_rviz(self._rviz)
        self._worker.shutdown()
        self._end_rviz(self._rviz)  # it may have been about to start
        if self._server:
            self._server.close()
            self._server = None

    def _start(self) -> None:
        if self._server is None and not os.environ.get("DISPLAY"):
            self._server = Xvfb()
        if self._rviz is None:
            display = self._server.name if self._server else os.environ["DISPLAY"]
            self._rviz = RvizProcess(self._config, display)

    def _take(self, order: dict) -> dict:
        try:
            return self._try(order)
        except RvizFailed as first:
            if self._closed:
                raise
            try:
                return self._try(order)
            except RvizFailed as second:
                raise RvizFailed(f"{second}; before its restart: {first}") from second

    def _try(self, order: dict) -> dict:
        self._start()
        rviz = self._rviz
        try:
            return rviz.order(order, self._config.timeout_s)
        except RvizFailed:
            self._end_rviz(rviz)
            raise

    def _end_rviz(self, rviz: RvizProcess | None) -> None:
        if rviz:
            rviz.close()
        self._rviz = None
