"""What the figures are drawn from: scans, capability map and robot, each made when first asked for, on one stage."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
from fv_msgs.msg import Evaluation

from fv_figures import plans, sources
from fv_figures.stage import SETTINGS, Stage
from fv_viz.config import VizConfig
from fv_viz.drawing import framing, legend
from fv_viz.drawing.evaluation import triples

_ENTRIES = legend.entries(VizConfig(**SETTINGS))


@dataclasses.dataclass
class Material:
    """The data of all figures and the stage."""

    stage: Stage
    robot: str
    make_scans: Callable[[], sources.Scans]
    make_spheres: Callable[[], sources.Spheres]
    _made: dict = dataclasses.field(default_factory=dict)

    @property
    def scans(self) -> sources.Scans:
        """Scans and evaluations; raises NoData."""
        if "scans" not in self._made:
            self._made["scans"] = self.make_scans()
            self.stage.volume(self._made["scans"].volume())
        return self._made["scans"]

    @property
    def spheres(self) -> sources.Spheres:
        """The capability map; raises NoData."""
        if "spheres" not in self._made:
            self._made["spheres"] = self.make_spheres()
        return self._made["spheres"]

    @property
    def joints(self) -> dict[str, float]:
        """Positions of the robot's joints in its start pose; brings the robot onto the stage. Raises NoData."""
        if "robot" not in self._made:
            self._made["robot"] = plans.bring_robot(self.stage, self.robot)
        return self._made["robot"]

    def show(self, msg: Evaluation) -> None:
        """Have an evaluation drawn unless it is already."""
        if self._made.get("shown") is not msg:
            self.stage.evaluation(msg)
            self._made["shown"] = msg

    def look(self, points: np.ndarray, yaw: float, pitch: float, cut_m: float = np.inf) -> list[float]:
        """A camera that sees all points (N, 3) [m]: see framing.orbit."""
        return framing.orbit(points, yaw, pitch, self.stage.aspect, cut_m)

    def at_scan(
        self, yaw: float, pitch: float, several: bool = False, cut: float | None = None
    ) -> list[float]:
        """A camera that sees what the first scan shows, or all of them.

        cut: what is further than this share of the scene's diagonal in front of its middle is left out.
        """
        msg = self.scans.several if several else self.scans.first
        points = np.concatenate([triples(msg.occupied), triples(msg.frontier)])
        diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
        return self.look(points, yaw, pitch, np.inf if cut is None else cut * diagonal)


def lines(*names: str) -> list[legend.Entry]:
    """Legend lines of layers."""
    return [entry for name in names for entry in _ENTRIES[name]]


def index_scale(spheres: sources.Spheres) -> list[legend.Entry]:
    """The legend line of the reachability index."""
    steps, largest = spheres.scale()
    return [legend.Entry("scale", steps, f"reachability index, 0 to {largest:.0f} %")]
