"""Every figure: which displays it shows, from where, and what it says. Numbers are those of the thesis."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
from fv_msgs.msg import Evaluation

from fv_viz import capability, colors, legend, packing, shapes
from fv_viz.config import VizConfig
from fv_viz.evaluation import triples
from fv_viz.figures import plans, sources
from fv_viz.figures.compose import Figure, slice_picture
from fv_viz.figures.stage import FRAME, Stage

_ENTRIES = legend.entries(VizConfig())


@dataclasses.dataclass
class Material:
    """The data of all figures, each made when first asked for, and the stage."""

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

    def in_world(self, frame: str, point) -> np.ndarray:
        """A point (3,) of one of the robot's frames, in the world; the robot is on the stage."""
        return plans.in_world(self.robot, frame, self._made["robot"], point)

    def with_robot(self) -> None:
        """Bring the robot model onto the stage, once, in its start pose; raises NoData."""
        if "robot" not in self._made:
            self._made["robot"] = plans.bring_robot(self.stage, self.robot)

    def show(self, msg: Evaluation) -> None:
        """Have an evaluation drawn unless it is already."""
        if self._made.get("shown") is not msg:
            self.stage.evaluation(msg)
            self._made["shown"] = msg

    def camera(self, yaw: float, pitch: float, whole: bool = False, cut: float = 0.6) -> list[float]:
        """A camera that looks at what a scan shows (or all scans), and leaves out what is nearer than the cut.

        cut: as a share of the scene's diagonal, in front of its middle.
        """
        msg = self.scans.several if whole else self.scans.first
        points = np.concatenate([triples(msg.occupied), triples(msg.frontier)])
        low, high = points.min(axis=0).astype(float), points.max(axis=0).astype(float)
        reach = float(np.linalg.norm(high - low))
        return [reach, yaw, pitch, *((low + high) / 2.0), max(1.0 - cut, 0.01) * reach]


def figure_2_2(m: Material) -> Figure:
    """A slice of the map."""
    msg = m.scans.several
    size, low = msg.resolution, m.scans.bounds[0]
    counts = np.rint((m.scans.bounds[1] - low) / size).astype(int)
    states = np.zeros(counts[:2], dtype=np.uint8)
    occupied = triples(msg.occupied)
    level = np.rint((np.median(occupied[:, 2]) - low[2]) / size - 0.5)
    for name, value in (("free", 1), ("frontier", 3), ("occupied", 2)):
        index = np.rint((triples(getattr(msg, name)) - low) / size - 0.5).astype(int)
        index = index[
            (index[:, 2] == level) & (index[:, :2] >= 0).all(axis=1) & (index[:, :2] < counts[:2]).all(axis=1)
        ]
        states[index[:, 0], index[:, 1]] = value
    shows = "walls black, explored free space grey, frontiers red, unknown white, in one level of the 3D map"
    return Figure(
        [("one level of the map", slice_picture(states))], shows, m.scans.made_by, [], ("red", "grey")
    )


def figure_3_1(m: Material) -> Figure:
    """Cloud, occupied, free, all."""
    scans, eye = m.scans, m.camera(-2.5, 0.6)
    m.show(scans.first)
    m.stage.cloud(packing.cloud(FRAME, scans.cloud, scans.cloud_colors))
    views = (
        ("point cloud of the first scan", ["Cloud"]),
        ("its occupied voxels", ["Occupied by height"]),
        ("free voxels", ["Free"]),
        ("both, and the exploration volume", ["Occupied by height", "Free", "Volume and clearance"]),
    )
    shows = (
        "the first scan of the scene, and the occupied and free voxels that come of it; the rest is unknown"
    )
    panels = [(words, m.stage.take(show, eye)) for words, show in views]
    return Figure(panels, shows, scans.made_by, _lines("occupied", "free"), ("blue",))


def figure_3_2(m: Material) -> Figure:
    """Ellipsoids before and after merging."""
    m.show(m.scans.first)
    eye, common = m.camera(-2.5, 0.6), ["Occupied by height", "Void"]
    panels = [
        ("initial ellipsoids", m.stage.take([*common, "Initial ellipsoids"], eye)),
        ("merged", m.stage.take([*common, "Void ellipsoids"], eye)),
    ]
    shows = f"void ellipsoids before ({len(m.scans.first.initial_ellipsoids)}) and after merging"
    shows += f" ({len(m.scans.first.ellipsoids)}); dots are centres of void voxels"
    return Figure(
        panels,
        shows,
        m.scans.made_by,
        _lines("void", "initial_ellipsoids", "ellipsoids"),
        ("purple",),
    )


def figure_3_3(m: Material) -> Figure:
    """Two rows of spheres."""
    s = m.spheres
    mask = capability.near_rows(s.centers, s.shoulder, s.radius)
    panel = _capability(m, "Spheres as spikes", _spikes(s, mask), s.centers[mask], 0.35)
    shows = f"two rows of reachability spheres ({mask.sum()}), red: reachable from everywhere, green: hardly"
    return Figure([("two rows of spheres", panel)], shows, s.made_by, _index(), ("green",))


def figure_3_4(m: Material) -> Figure:
    """Index in cuts."""
    s, panels = m.spheres, []
    for axis, words, yaw, pitch in (
        (2, "horizontal cut through the shoulder", -0.9, 1.0),
        (1, "upright cut", -1.4, 0.2),
    ):
        mask = np.abs(s.centers[:, axis] - s.shoulder[axis]) <= s.radius * 1.01
        blobs = capability.balls(_base(s), s.centers[mask], s.valid[mask], s.radius)
        panels.append((words, _capability(m, "Index cuts", blobs, s.centers[mask], pitch, yaw)))
    shows = "reachability index in two cuts of the arm's workspace, red: reachable from everywhere"
    return Figure(panels, shows, s.made_by, _index(), ("green", "orange"))


def figure_3_5(m: Material) -> Figure:
    """Spheres and their structures."""
    s, panels = m.spheres, []
    if not len(s.kinds):
        raise sources.NoData("the capability map has no structures; build it again")
    share = s.valid.mean(axis=1)
    for number, kind in list(enumerate(sources.KINDS))[1:]:
        rows = np.flatnonzero((s.kinds == number) & (share > 0.08) & (share < 0.92))
        if len(rows):
            panels.append(_structure(m, s, int(rows[np.argmin(s.errors[rows])]), kind))
    shows = "reachability spheres of the map, one that each structure fits best, with axis and opening angle"
    return Figure(panels, shows, s.made_by, _index(), ("green",))


def figure_3_6(m: Material) -> Figure:
    """The octree at several depths."""
    msg, panels = m.scans.several, []
    occupied = triples(msg.occupied)
    for up in (0, 1, 2, 3):
        size = msg.resolution * 2**up
        coarse = np.unique(np.floor(occupied / size).astype(int), axis=0)
        view = Evaluation(
            header=FRAME, resolution=size, occupied=((coarse + 0.5) * size).astype(np.float32).ravel()
        )
        m.show(view)
        words = f"depth {16 - up}: {100 * size:g} cm, {len(coarse)} occupied nodes"
        panels.append((words, m.stage.take(["Occupied by height"], m.camera(-2.5, 0.6, whole=True))))
    shows = (
        "occupied nodes of the map's octree at four depths; a node is occupied when one of its children is"
    )
    return Figure(panels, shows, m.scans.made_by, _lines("occupied"), ("blue",))


def figure_4_1(m: Material) -> Figure:
    """The robot."""
    m.with_robot()
    panels = [
        ("whole", m.stage.take(["Robot", "Grid"], [2.6, -0.7, 0.15, 0.1, 0.0, 0.75])),
        ("the hand with the sensor", m.stage.take(["Robot"], [0.9, -0.9, 0.35, 0.3, -0.25, 1.0])),
    ]
    shows = f"robot {m.robot} in its start pose with the depth camera at its tip"
    return Figure(panels, shows, f"rosrun hubo_description upload_robot --robot {m.robot}", [], ("grey",))


def figure_5_1(m: Material) -> Figure:
    """Frontiers from six sides."""
    m.show(m.scans.first)
    sides = (("from behind left", 2.5, 0.6), ("from behind right", -2.5, 0.6), ("from the right", -1.57, 0.2))
    sides += (
        ("from the left", 1.57, 0.2),
        ("from above", 3.1416, 1.55),
        ("cut open from behind: hollow", 3.1416, 0.2),
    )
    panels = []
    for words, yaw, pitch in sides:
        cut = 0.0 if "hollow" in words else 0.6
        panels.append(
            (words, m.stage.take(["Frontier", "Occupied by height"], m.camera(yaw, pitch, cut=cut)))
        )
    shows = "frontier voxels (red) of the first scan, before clustering; the set is hollow"
    return Figure(panels, shows, m.scans.made_by, _lines("occupied", "frontier"), ("red", "blue"))


def figure_5_2(m: Material) -> Figure:
    """The map by height."""
    m.show(m.scans.several)
    panel = m.stage.take(["Occupied by height", "Volume and clearance"], m.camera(-2.5, 0.6, whole=True))
    shows = f"the map after {len(sources.WAIST_DEG)} scans by the simulated sensor, coloured by height"
    return Figure(
        [("occupied voxels by height", panel)], shows, m.scans.made_by, _lines("occupied"), ("blue",)
    )


def figure_5_3(m: Material) -> Figure:
    """Voids and ellipsoids from four sides."""
    m.show(m.scans.first)
    common = ["Occupied by height", "Void"]
    plan = (("void voxels", [], -2.5), ("initial ellipsoids", ["Initial ellipsoids"], -2.5))
    plan += (
        ("void clusters", ["Void ellipsoids"], -2.5),
        ("void clusters from the front", ["Void ellipsoids"], 0.6),
    )
    panels = [(words, m.stage.take([*common, *more], m.camera(yaw, 0.6))) for words, more, yaw in plan]
    shows = "void voxels as dots, initial ellipsoids, and the void clusters that merging leaves"
    return Figure(panels, shows, m.scans.made_by, _lines("occupied", "void", "ellipsoids"), ("purple",))


def figure_5_4(m: Material) -> Figure:
    """Frontier clusters, the four largest alone."""
    msg, panels = m.scans.several, []
    labels, counts = np.unique(np.asarray(msg.frontier_cluster), return_counts=True)
    for label in labels[np.argsort(-counts)][:4]:
        mask = np.asarray(msg.frontier_cluster) == label
        part = Evaluation(header=FRAME, resolution=msg.resolution, void=msg.void)
        part.frontier = triples(msg.frontier)[mask].ravel()
        part.frontier_cluster = np.asarray(msg.frontier_cluster)[mask]
        m.show(part)
        words = f"cluster {label}: {mask.sum()} voxels"
        panels.append((words, m.stage.take(["Frontier clusters", "Void"], m.camera(-2.5, 0.75, whole=True))))
    shows = f"the {len(panels)} largest of {len(labels)} frontier clusters, one each; dots are void voxels"
    return Figure(panels, shows, m.scans.made_by, _lines("frontier_clusters", "void"), ("orange",))


def figure_5_5(m: Material) -> Figure:
    """Frontier-voids, the two largest alone."""
    msg, panels = m.scans.several, []
    order = sorted(msg.frontier_voids, key=lambda one: -msg.ellipsoids[one.ellipsoid].voxel_count)
    for one in [fv for fv in order if len(fv.frontier_clusters)][:2]:
        part = Evaluation(
            header=FRAME, resolution=msg.resolution, occupied=msg.occupied, ellipsoids=msg.ellipsoids
        )
        part.void, part.void_ellipsoid = msg.void, msg.void_ellipsoid
        part.frontier, part.frontier_cluster = msg.frontier, msg.frontier_cluster
        part.frontier_voids = [one]
        m.show(part)
        words = f"void of {msg.ellipsoids[one.ellipsoid].voxel_count} voxels, {len(one.frontier_clusters)} clusters"
        panels.append(
            (words, m.stage.take(["Frontier-voids", "Occupied by height"], m.camera(-2.5, 0.75, whole=True)))
        )
    shows = (
        "the two largest frontier-voids: a void cluster (translucent) with the frontiers that neighbour it"
    )
    return Figure(panels, shows, m.scans.made_by, _lines("frontier_voids", "occupied"), ())


def figure_5_6(m: Material) -> Figure:
    """Spheres near the base."""
    s = m.spheres
    distance = np.linalg.norm(s.centers - s.shoulder, axis=1)
    mask = np.zeros(len(distance), bool)
    mask[np.argsort(distance)[:12]] = True
    panel = _capability(m, "Spheres as spikes", _spikes(s, mask), s.centers[mask], 0.3)
    shows = "the twelve spheres nearest to the shoulder; spikes that fill whole regions: no spheres with bald spots"
    return Figure([("spheres near the shoulder", panel)], shows, s.made_by, _index(), ())


def figure_5_7(m: Material) -> Figure:
    """Utility."""
    m.show(m.scans.several)
    eye = m.camera(-2.5, 0.75, whole=True)
    panels = [
        ("utility of free voxels", m.stage.take(["Utility", "Occupied by height"], eye)),
        ("with the frontier-voids", m.stage.take(["Utility", "Frontier-voids"], eye)),
    ]
    shows = "utility of free voxels, light green (low) to opaque red (high)"
    return Figure(panels, shows, m.scans.made_by, _lines("utility", "occupied"), ("red",))


def figure_5_8(m: Material) -> Figure:
    """Start, path and goal of a plan."""
    m.with_robot()
    msg, made_by = plans.planned_path(m.stage, m.robot, m._made["robot"])
    m.stage.path(msg)
    panels = [
        ("from the front right", m.stage.take(["Path", "Robot"], [1.7, -0.9, 0.2, 0.1, -0.1, 0.95])),
        ("from above, behind", m.stage.take(["Path", "Robot"], [1.7, 2.4, 0.9, 0.1, -0.1, 0.95])),
    ]
    shows = "a plan of the right arm: start light green, goal dark violet, poses between faint"
    return Figure(panels, shows, made_by, _lines("path"), ("green",))


def _lines(*names: str) -> list[legend.Entry]:
    return [entry for name in names for entry in _ENTRIES[name]]


def _index() -> list[legend.Entry]:
    steps = colors.scale(capability.SCALE, np.linspace(0.0, 1.0, 24))
    return [legend.Entry("scale", steps, "reachability index, 0 to 100 %")]


def _base(s: sources.Spheres):
    return type(FRAME)(frame_id=s.base_frame)


def _spikes(s: sources.Spheres, mask: np.ndarray) -> list[bytes]:
    return capability.spikes(_base(s), s.centers[mask], s.valid[mask], s.directions, s.radius)


def _capability(m: Material, display: str, blobs: list[bytes], centers, pitch: float, yaw: float = -0.9):
    """A picture of capability markers with the robot; the camera frames the centres."""
    m.with_robot()
    topics = {"Spheres as spikes": "spheres", "Index cuts": "index", "Shapes": "shapes"}
    m.stage.draw(blobs, f"/fv_viz/capability/{topics[display]}")
    low, high = centers.min(axis=0), centers.max(axis=0)
    middle = m.in_world(m.spheres.base_frame, (low + high) / 2.0)
    reach = max(float(np.linalg.norm(high - low)), 0.4)
    return m.stage.take([display, "Robot"], [1.35 * reach, yaw, pitch, *middle])


def _structure(m: Material, s: sources.Spheres, row: int, kind: str):
    """One sphere with its structure and axis."""
    m.with_robot()
    center, axis, color = s.centers[row], s.axes[row], colors.rgb("views")
    blobs = capability.spikes(_base(s), s.centers[[row]], s.valid[[row]], s.directions, s.radius)
    blobs += [capability.structure(_base(s), center, axis, s.openings[row], kind, s.radius, color)]
    ends = np.array(
        [center - axis * s.radius * (1.6 if kind != "cone" else 0.0), center + axis * s.radius * 1.6]
    )
    m.stage.draw(
        [*blobs, shapes.lines(_base(s), "axis", ends, color, 0.04 * s.radius)], "/fv_viz/capability/spheres"
    )
    picture = m.stage.take(
        ["Spheres as spikes"], [5.0 * s.radius, 0.6, 0.35, *m.in_world(s.base_frame, center)]
    )
    words = f"{kind}: {np.degrees(s.openings[row]):.0f}° about its axis, error {s.errors[row]:.0f} %"
    return words, picture


FIGURES: dict[str, Callable[[Material], Figure]] = {
    name.removeprefix("figure_").replace("_", "."): function
    for name, function in list(globals().items())
    if name.startswith("figure_")
}
