"""Where figures get their data. The only file of this package that imports other packages of the workspace: figures are
made from the real simulator, map and capability map, not from anything drawn for the purpose.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from fv_msgs.msg import Box, Evaluation, ExplorationVolume
from geometry_msgs.msg import Point
from std_msgs.msg import Header

if TYPE_CHECKING:
    from capability_map import CapabilityMap

FRAME = Header(frame_id="world")
WAIST_DEG = (0.0, 30.0, -30.0, 60.0, -60.0)  # turns of the waist about the start pose, one scan each
RANGE_M = 3.0
# A camera at eye height that looks ahead, z of the optical frame along x of the map.
T_MAP_CAMERA = np.array(
    [[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]]
)


class NoData(RuntimeError):
    """A figure's data cannot be had; the text says why in one line."""


@dataclasses.dataclass
class Scans:
    """Clouds and what they are worth.

    first, several: evaluations after the first scan and after all; cloud (N, 3) [m] and its colours (N, 3) of the
    first scan, map frame; bounds (2, 3) [m]; count: of scans; made_by: how the data were made, one line.
    """

    first: Evaluation
    several: Evaluation
    cloud: np.ndarray
    cloud_colors: np.ndarray
    bounds: np.ndarray
    count: int
    made_by: str

    def volume(self) -> ExplorationVolume:
        """The bounds as a message."""
        low, high = self.bounds.astype(float)
        return ExplorationVolume(header=FRAME, bounds=Box(Point(*low), Point(*high)))


def simulated(world: str, robot: str, resolution: float, seed: int = 1) -> Scans:
    """Scans of a simulated world by the robot's own camera, from its start pose and with the waist turned.

    Raises NoData when the simulator or the map cannot be imported or made.
    """
    try:
        from hubo_sim.config import SimConfig
        from hubo_sim.robot_source import load_robot_spec
        from hubo_sim.simulator import Simulator
        from hubo_sim.worlds import load_world
    except ImportError as error:
        raise NoData(f"the simulator is not there ({error})") from error
    place = load_world(world)
    simulator = Simulator(load_robot_spec(robot), place, SimConfig(seed=seed))
    try:
        shots = [_shot(simulator, number, np.radians(turn)) for number, turn in enumerate(WAIST_DEG)]
    finally:
        simulator.close()
    bounds = np.array([place.bounds.min_m, place.bounds.max_m])
    made_by = (
        f"hubo_sim world {world}, robot {robot}, seed {seed}, {len(WAIST_DEG)} scans with the waist turned"
    )
    clouds = [(points, T) for points, T, _ in shots]
    return _evaluated(clouds, shots[0][2], bounds, resolution, made_by)


def recorded(path: Path, resolution: float) -> Scans:
    """Recorded scans (.pcd, .graph, .bag; see fv_exploration.recordings) instead of simulated ones.

    A PCD without a viewpoint is taken for a camera's at T_MAP_CAMERA. Raises NoData for a file that cannot be read or
    holds no finite point within range.
    """
    try:
        from fv_exploration.recordings import read_scans
    except ImportError as error:
        raise NoData(f"the reader of recordings is not there ({error})") from error
    try:
        clouds = [
            _near(np.asarray(scan.points_sensor), np.asarray(scan.T_map_sensor)) for scan in read_scans(path)
        ]
    except (OSError, ValueError) as error:
        raise NoData(str(error)) from error
    clouds = [(points, T) for points, T in clouds if len(points)]
    if not clouds:
        raise NoData(f"{path}: no finite point within {2.0 * RANGE_M:g} m")
    placed = np.concatenate([points @ T[:3, :3].T + T[:3, 3] for points, T in clouds])
    low = np.minimum(placed.min(axis=0), clouds[0][1][:3, 3]) - 0.1
    made_by = f"recording {path.name}, {len(clouds)} scans, voxels of {100 * resolution:g} cm"
    return _evaluated(clouds, None, np.array([low, placed.max(axis=0) + 0.1]), resolution, made_by)


def _near(points: np.ndarray, T: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Finite points (N, 3) within range, and the pose of their camera."""
    points = points.reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=1)]
    points = points[np.linalg.norm(points, axis=1) < 2.0 * RANGE_M]
    return points, T_MAP_CAMERA if np.allclose(T, np.eye(4)) else T


def _shot(simulator, number: int, turn: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (N, 3) in the optical frame, T_world_optical and colours (N, 3) of one scan."""
    positions = simulator.spec.start_positions("")
    if "WST" in positions or "WST" in simulator.robot.joint_names:
        positions = {**positions, "WST": positions.get("WST", 0.0) + turn}
    simulator.robot.set_positions(positions)
    camera = next(iter(simulator.cameras.values()))
    scan = camera.scan(simulator.scene, number)
    points = camera.points(scan.depth).reshape(-1, 3)
    return points, camera.pose(), scan.rgba.reshape(-1, 4)[:, :3] / 255.0


def _evaluated(clouds, seen, bounds: np.ndarray, resolution: float, made_by: str) -> Scans:
    """Clouds, points (N, 3) and camera poses, put into a map; seen: colours (N, 3) of the first cloud or None."""
    try:
        from fv_exploration import _core
    except ImportError as error:
        raise NoData(f"the map is not there ({error})") from error
    grid = _core.OccupancyMap(
        _core.MapConfig(resolution_m=resolution, bounds_min=bounds[0].tolist(), bounds_max=bounds[1].tolist())
    )
    evaluator = _core.Evaluator(grid)
    limits = _core.ScanConfig(0.3, 2.0 * RANGE_M, 0.0)
    messages = []
    for points, T in clouds:
        grid.insert_scan(points, T, limits)
        messages.append(_message(grid, evaluator))
    points, T = clouds[0]
    finite = np.isfinite(points).all(axis=1)
    tones = np.full((len(points), 3), 0.3) if seen is None else seen
    placed = points[finite] @ T[:3, :3].T + T[:3, 3]
    return Scans(messages[0], messages[-1], placed, tones[finite], bounds, len(clouds), made_by)


def _message(grid, evaluator) -> Evaluation:
    from fv_exploration.ros import conversions

    found = evaluator.update()
    msg = conversions.evaluation_msg(grid, found, evaluator.utility(RANGE_M), FRAME)
    msg.initial_ellipsoids = [conversions.ellipsoid_msg(one) for one in evaluator.initial_ellipsoids()]
    return msg


KINDS = {1: "cone", 2: "double cone", 3: "ring"}  # as capability_map numbers them; 0: no valid point


@dataclasses.dataclass
class Spheres:
    """A loaded capability map and how it was made."""

    cap: CapabilityMap
    made_by: str

    @property
    def shoulder(self) -> np.ndarray:
        """Where the arm begins (3,) [m], in the map's base frame."""
        return self.cap.data.reach_center_m

    def colors(self) -> np.ndarray:
        """Colours (S, 3) of all spheres by their reachability index, as capability_map shows it everywhere."""
        from capability_map.drawing import geometry

        return geometry.index_colors(self.cap.index())[:, :3]

    def scale(self) -> tuple[np.ndarray, float]:
        """Colours (K, 3) of the index from 0 to its largest value, and that value [%]."""
        from capability_map.drawing import geometry

        largest = float(self.cap.index().max(initial=0.0))
        return geometry.index_colors(np.linspace(0.0, largest, 24))[:, :3], largest

    def fitted(self, what: str) -> np.ndarray:
        """What was fitted to each sphere (S, ...): type, axis, opening_rad or error_percent.

        Raises NoData for a map without.
        """
        name = f"least_error_{what}"
        if name not in self.cap.data.shapes:
            raise NoData("the capability map has no structures; build it again")
        return np.asarray(self.cap.data.shapes[name])


def capability(path: Path) -> Spheres:
    """Read a capability map; raises NoData when there is none that can be used."""
    try:
        from capability_map import CapabilityMap, CapabilityMapError
    except ImportError as error:
        raise NoData(f"the capability map's package is not there ({error})") from error
    if not path.is_file():
        raise NoData(f"no capability map {path}; rosrun capability_map build makes it")
    try:
        loaded = CapabilityMap.load(path)
    except (CapabilityMapError, OSError, ValueError) as error:
        raise NoData(f"{error}; rosrun capability_map build makes it anew") from error
    data = loaded.data
    made_by = (
        f"rosrun capability_map build --robot {data.robot} --group {data.group}, radius {data.radius_m:.4f} m"
    )
    return Spheres(loaded, made_by)


def default_capability_path(robot: str, group: str) -> Path:
    """Where the capability map of a robot's arm lies; raises NoData without the package."""
    try:
        from capability_map import default_map_path
    except ImportError as error:
        raise NoData(f"the capability map's package is not there ({error})") from error
    return Path(default_map_path(robot, group))


def start_positions(robot: str, pose: str = "") -> dict[str, float]:
    """Joint positions of a robot's start pose (or a named one); raises NoData without its description."""
    try:
        from hubo_description import load_robot
    except ImportError as error:
        raise NoData(f"the robot's description is not there ({error})") from error
    loaded = load_robot(robot)
    wanted = pose or loaded.config.exploration.start_pose
    for states in loaded.group_states.values():
        if wanted in states:
            return dict(states[wanted])
    raise NoData(f"robot {robot} has no pose {wanted!r}")
