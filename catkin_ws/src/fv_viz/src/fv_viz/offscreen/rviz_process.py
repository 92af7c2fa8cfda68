"""RViz as a program that takes orders: JSON lines in, JSON lines out. Run as a module, by RvizProcess only.

Orders: {"camera": [...], "preset": str, "show": [...], "hide": [...], "expect": [topics on which something must have
come], "settle_s": s} with "grab": file for a picture or "measure_s": s for the frames per second. Between orders RViz
does not render, so that it costs nothing.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Set

import numpy as np
from python_qt_binding.QtCore import QSocketNotifier
from python_qt_binding.QtGui import QImage
from python_qt_binding.QtWidgets import QApplication
from rviz import bindings as rviz

CAMERA = ("Distance", "Yaw", "Pitch")
DROPPED = "Unknown reason for transform failure"  # RViz's words when a marker's frame came too late


class Renderer:
    """One RViz window without docks, and the orders that it knows."""

    def __init__(self, app: QApplication, config: str, width: int, height: int) -> None:
        self._app = app
        self._frame = rviz.VisualizationFrame()
        self._frame.setSplashPath("")
        self._frame.initialize()
        parsed = rviz.Config()
        rviz.YamlConfigReader().readFile(parsed, config)
        if not parsed.isValid():
            raise ValueError(f"{config} is no RViz configuration")
        self._frame.load(parsed)
        self._frame.setMenuBar(None)
        self._frame.statusBar().hide()
        self._frame.setHideButtonVisibility(False)
        self._hide_docks()
        self._frame.resize(width, height)
        self._frame.show()
        self._manager = self._frame.getManager()
        self._root = self._manager.getRootDisplayGroup()
        self._root.subProp("Global Options").subProp("Frame Rate").setValue(30)  # it rests between orders
        self._shown = {display.getName(): display.isEnabled() for display in self._displays()}
        self._running = True
        self.work(1.0)
        self._rest()

    def obey(self, order: dict) -> dict:
        """Carry out one order; returns the reply."""
        self._toggle(order.get("show", []), order.get("hide", []))
        self._look(order.get("preset", ""), order.get("camera", []))
        self._wake()
        try:
            expected = frozenset(order.get("expect", []))
            reply = {"stable": self._settle_without_errors(float(order.get("settle_s", 5.0)), expected)}
            if "grab" in order and not self._grab().save(order["grab"], "PNG"):
                raise OSError(f"cannot write {order['grab']}")
            if "measure_s" in order:
                reply["frames_per_s"] = self._rate(float(order["measure_s"]))
        finally:
            self._rest()
        absent = [f"{name}: nothing has come on {topic}" for name, topic in self._absent(expected)]
        return {**reply, "topics": list(self._topics().values()), "errors": self._errors(), "absent": absent}

    def work(self, seconds: float) -> None:
        """Let Qt and RViz run for a while."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self._app.processEvents()
            time.sleep(0.005)

    def _displays(self) -> list:
        return [self._root.getDisplayAt(k) for k in range(self._root.numDisplays())]

    def _hide_docks(self) -> None:
        from python_qt_binding.QtWidgets import QDockWidget, QToolBar

        for widget in self._frame.findChildren(QDockWidget) + self._frame.findChildren(QToolBar):
            widget.hide()

    def _toggle(self, show: list[str], hide: list[str]) -> None:
        unknown = sorted({*show, *hide} - set(self._shown) - {"*"})
        if unknown:
            raise ValueError(f"no display named {', '.join(unknown)}; known: {', '.join(self._shown)}")
        for display in self._displays():
            name = display.getName()
            wanted = (
                name in show or "*" in show or (self._shown[name] and name not in hide and "*" not in hide)
            )
            if wanted != display.isEnabled():
                display.setEnabled(wanted)

    def _look(self, preset: str, camera: list[float]) -> None:
        views = self._manager.getViewManager()
        if preset:
            saved = {views.getViewAt(k).getName(): views.getViewAt(k) for k in range(views.getNumViews())}
            if preset not in saved:
                raise ValueError(f"no saved view {preset!r}; known: {', '.join(saved)}")
            views.setCurrentFrom(saved[preset])
        elif camera:
            if len(camera) not in (6, 7):
                raise ValueError(
                    f"camera needs distance, yaw, pitch, x, y, z, near; got {len(camera)} numbers"
                )
            current = views.getCurrent()
            for name, value in zip(CAMERA, camera[:3], strict=True):
                current.subProp(name).setValue(float(value))
            for name, value in zip("XYZ", camera[3:6], strict=True):
                current.subProp("Focal Point").subProp(name).setValue(float(value))
            current.subProp("Near Clip Distance").setValue(float(camera[6]) if len(camera) == 7 else 0.01)

    def _wake(self) -> None:
        if not self._running:
            self._manager.startUpdate()
            self._running = True

    def _rest(self) -> None:
        if self._running:
            self._manager.stopUpdate()
            self._running = False

    def _frames(self, count: int, limit_s: float) -> None:
        """Run until some frames more are drawn."""
        deadline, goal = time.monotonic() + limit_s, self._manager.getFrameCount() + count
        while self._manager.getFrameCount() < goal and time.monotonic() < deadline:
            self._app.processEvents()
            time.sleep(0.005)

    def _rate(self, seconds: float) -> float:
        """Frames that RViz draws in a second."""
        started, first = time.monotonic(), self._manager.getFrameCount()
        self.work(seconds)
        return (self._manager.getFrameCount() - first) / (time.monotonic() - started)

    def _settle_without_errors(self, limit_s: float, expected: Set[str]) -> bool:
        """Wait until the picture rests, and start displays that dropped a marker again while there is time.

        RViz drops a marker that came before its frame for good; a display that starts again gets what is latched.
        Other errors go by themselves or stay.
        """
        deadline = time.monotonic() + limit_s
        stable = self._settle(limit_s, expected)
        while (dropped := self._dropped()) and time.monotonic() < deadline:
            for display in dropped:
                display.setEnabled(False)
                display.setEnabled(True)
            stable = self._settle(deadline - time.monotonic(), expected)
        return stable

    def _dropped(self) -> list:
        """Shown displays that dropped a marker."""
        return [
            display
            for display, status in self._failing().items()
            if any(DROPPED in str(status.childAt(k).getValue()) for k in range(status.numChildren()))
        ]

    def _settle(self, limit_s: float, expected: Set[str]) -> bool:
        """Wait until what is expected has come and the picture does not change any more; False at the limit."""
        deadline, before = time.monotonic() + limit_s, None
        self._frames(3, limit_s)
        while time.monotonic() < deadline:
            self.work(0.15)
            self._frames(2, limit_s)
            now = self._pixels()
            same = before is not None and before.shape == now.shape and np.mean(before != now) < 1e-4
            if same and not self._absent(expected):
                return True
            before = now
        return False

    def _grab(self) -> QImage:
        return self._app.primaryScreen().grabWindow(self._frame.winId()).toImage()

    def _pixels(self) -> np.ndarray:
        image = self._grab().convertToFormat(QImage.Format_RGB32)
        data = image.constBits().asarray(image.sizeInBytes())
        return np.frombuffer(data, dtype=np.uint8).copy()

    def _topics(self) -> dict:
        """Shown displays and their topics."""
        topics = {}
        for display in self._displays():
            named = {child.getName(): child for child in _children(display)}
            topic = named.get("Topic") or named.get("Marker Topic")
            if display.isEnabled() and topic:
                topics[display] = str(topic.getValue())
        return topics

    def _absent(self, expected: Set[str]) -> list[tuple[str, str]]:
        """Names and topics of the shown displays that have got nothing yet on a topic where something is expected."""
        return [
            (display.getName(), topic)
            for display, topic in self._topics().items()
            if topic in expected and not _has_content(display)
        ]

    def _failing(self) -> dict:
        """Shown displays with an error, and their status; RViz names the status property "Status: Error" then."""
        found = {}
        for display in self._displays():
            wrong = [child for child in _children(display) if child.getName() == "Status: Error"]
            if display.isEnabled() and wrong:
                found[display] = wrong[0]
        return found

    def _errors(self) -> list[str]:
        """A line for each display with an error."""
        found = []
        for display, status in self._failing().items():
            words = "; ".join(f"{line.getName()}: {line.getValue()}" for line in _children(status))
            found.append(f"{display.getName()}: {words}")
        return found


def _children(node) -> list:
    return [node.childAt(k) for k in range(node.numChildren())]


def _has_content(display) -> bool:
    """Whether a display has got a message: markers leave namespaces, all others count what they have received."""
    received: list[str] = []
    for child in _children(display):
        if child.getName() == "Namespaces":
            return child.numChildren() > 0
        if child.getName().startswith("Status"):
            received = [str(line.getValue()) for line in _children(child) if line.getName() == "Topic"]
    return any("received" in words and not words.startswith("No ") for words in received)


def serve(app: QApplication, renderer: Renderer, replies) -> None:
    """Obey orders from standard input until it ends."""

    def on_input() -> None:
        line = sys.stdin.buffer.readline()
        if not line:
            os._exit(0)  # the parent is gone; destructors of a running RViz may hang
        try:
            reply = {"ok": True, **renderer.obey(json.loads(line))}
        except (ValueError, OSError, KeyError) as error:
            reply = {"ok": False, "message": str(error)}
        print(json.dumps(reply), file=replies, flush=True)

    notifier = QSocketNotifier(sys.stdin.fileno(), QSocketNotifier.Read)
    notifier.activated.connect(on_input)
    print(json.dumps({"ok": True}), file=replies, flush=True)
    app.exec_()


def main() -> None:
    """Arguments: configuration, width, height, descriptor for the replies (RViz itself chats on stdout)."""
    config, width, height, descriptor = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4])
    app = QApplication(sys.argv[:1])
    with os.fdopen(descriptor, "w") as replies:
        serve(app, Renderer(app, config, width, height), replies)


if __name__ == "__main__":
    main()
