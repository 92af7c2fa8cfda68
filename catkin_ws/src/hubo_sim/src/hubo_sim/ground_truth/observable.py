"""The voxels of an exploration volume that a robot's camera can observe at all, by sampling its configurations."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import qmc

import hubo_description.sensors as description
from fv_common.files import write_replacing
from hubo_sim.errors import SimError
from hubo_sim.paths import cache_folder
from hubo_sim.robot_spec import RobotSpec
from hubo_sim.sensors.depth_camera import DepthCamera
from hubo_sim.sensors.render import Pinhole, take_picture
from hubo_sim.sim_robot import SimRobot
from hubo_sim.worlds import Bounds, World
from hubo_sim.worlds.scene import Scene

_VERSION = 2  # of the method, part of the cache key
_MIN_SAMPLES = 400
_MAX_SAMPLES = 6000
_WINDOW = 0.1  # settled: over the last tenth of the samples ...
_GROWTH = 1e-3  # ... the set grew by less than this share
_NEAR_M = 0.02
_NEIGHBOUR_RAD = 0.3  # spread of configurations about one that found something
_REMEMBERED = 100


@dataclass(frozen=True)
class ObservableSet:
    """Observable voxels on OctoMap's grid: voxel k has its centre at (k + 0.5) * resolution_m."""

    resolution_m: float
    first_key: np.ndarray  # (3,) key of mask[0, 0, 0]
    mask: np.ndarray  # (X, Y, Z) bool
    samples: int  # collision-free configurations that were rendered
    tried: int  # configurations drawn
    settled: bool  # False: the sample limit came first

    def keys_of(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Grid indices (P, 3) of world points (P, 3), and (P,) whether they are within the grid."""
        keys = np.floor(np.asarray(points) / self.resolution_m + 1e-6).astype(np.int64) - self.first_key
        return keys, ((keys >= 0) & (keys < self.mask.shape)).all(-1)

    def known_share(self, points: np.ndarray, resolution_m: float | None = None) -> float:
        """Of the observable voxels, the share that the voxel centres (P, 3) name. Raises SimError on another grid."""
        if resolution_m is not None and abs(resolution_m - self.resolution_m) > 1e-9:
            raise SimError(
                f"the observable set has voxels of {self.resolution_m} m, the map of {resolution_m} m"
            )
        keys, inside = self.keys_of(points)
        known = np.zeros(self.mask.shape, bool)
        known[tuple(keys[inside].T)] = True
        total = int(self.mask.sum())
        return float((known & self.mask).sum() / total) if total else 0.0

    def centres(self) -> np.ndarray:
        """(V, 3) centres of the observable voxels."""
        return (np.argwhere(self.mask) + self.first_key + 0.5) * self.resolution_m


@dataclass(frozen=True)
class ObservableRequest:
    """What the set depends on; group and camera default to those of the robot's exploration entry."""

    world: World
    robot: RobotSpec
    resolution_m: float
    bounds: Bounds | None = None
    group: str = ""
    camera: str = ""
    seed: int = 0

    def key(self) -> str:
        """Hash of everything that the answer depends on."""
        parts = [_VERSION, self.world, self.robot.urdf_xml, self.robot.srdf_xml, self.robot.config]
        parts += [self.robot.sensors, self.resolution_m, self.bounds, self.group, self.camera, self.seed]
        return hashlib.sha256(json.dumps(parts, default=_plain, sort_keys=True).encode()).hexdigest()[:20]


def _plain(value: object) -> object:
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else vars(value)


def observable_set(
    request: ObservableRequest,
    progress: Callable[[int, int], None] | None = None,
    folder: Path | None = None,
) -> ObservableSet:
    """The observable set from the cache, else computed (about a minute) and cached.

    progress(samples, voxels) is called now and then. folder: of the cache, default paths.cache_folder().
    """
    folder = folder or cache_folder()
    path = folder / f"observable_{request.world.name}_{request.key()}.npz"
    if path.is_file():
        with np.load(path) as data:
            return ObservableSet(
                float(data["resolution_m"]),
                data["first_key"],
                data["mask"],
                int(data["samples"]),
                int(data["tried"]),
                bool(data["settled"]),
            )
    result = compute_observable(request, progress)
    folder.mkdir(parents=True, exist_ok=True)
    write_replacing(path, lambda beside: np.savez_compressed(beside, **vars(result)))
    return result


def compute_observable(
    request: ObservableRequest, progress: Callable[[int, int], None] | None = None
) -> ObservableSet:
    """Sample collision-free configurations of the group until the set settles.

    Half of them are spread evenly within the joint limits; the others lie about ones that found new voxels.
    """
    with Scene() as scene:
        sampler = _Sampler(request, scene)
        history, tried = [], 0
        while len(history) < _MAX_SAMPLES and not _settled(history):
            tried += 1
            if tried > 50 * _MAX_SAMPLES:
                raise SimError("no collision-free configurations found: is the robot inside of something?")
            if sampler.place():
                history.append(sampler.look())
                sampler.reward(history[-1] - (history[-2] if len(history) > 1 else 0))
                if progress and len(history) % 50 == 0:
                    progress(len(history), history[-1])
        grid = sampler.grid
        return ObservableSet(
            request.resolution_m, grid.first_key, grid.mask, len(history), tried, _settled(history)
        )


def _settled(history: list[int]) -> bool:
    count = len(history)
    if count < _MIN_SAMPLES:
        return False
    return history[-1] - history[int((1.0 - _WINDOW) * count)] < _GROWTH * history[-1]


class _Grid:
    """A boolean grid that rays are marked in."""

    def __init__(self, resolution_m: float, bounds: Bounds) -> None:
        self.resolution_m = resolution_m
        low, high = bounds.corners / resolution_m
        self.first_key = np.ceil(low - 0.5 + 1e-9).astype(np.int64)
        last = np.floor(high - 0.5 - 1e-9).astype(np.int64)
        self.mask = np.zeros(last - self.first_key + 1, bool)

    def to_cells(self, vectors: np.ndarray, is_point: bool) -> np.ndarray:
        """World vectors (..., 3) in units of cells; points are counted from the grid's corner."""
        offset = self.first_key if is_point else 0.0
        return (vectors / self.resolution_m - offset).astype(np.float32)

    def mark(self, cells: np.ndarray) -> None:
        """Mark the voxels of points (P, 3) in units of cells."""
        shape = np.array(self.mask.shape, np.float32)
        cells = cells[((cells >= 0.0) & (cells < shape)).all(-1)].astype(np.int32)
        self.mask[cells[:, 0], cells[:, 1], cells[:, 2]] = True


class _Sampler:
    """Puts the robot into random configurations and marks what its camera sees."""

    def __init__(self, request: ObservableRequest, scene: Scene) -> None:
        spec, world = request.robot, request.world
        exploration = spec.config.get("exploration") or {}
        group, camera = request.group or exploration.get("group"), request.camera or exploration.get("camera")
        if group not in spec.groups:
            raise SimError(f"unknown group {group!r}; valid: {', '.join(sorted(spec.groups))}")
        sensors = spec.parsed_sensors()
        cameras = sorted(
            name for name, sensor in sensors.items() if isinstance(sensor, description.DepthCamera)
        )
        if camera not in cameras:
            raise SimError(f"unknown camera {camera!r}; valid: {', '.join(cameras)}")
        scene.load_world(world)
        self._scene = scene
        self._robot = SimRobot(
            scene,
            spec,
            spec.base_pose(world.robot),
            self_collision=bool(spec.model.disabled_pairs),
        )
        self._robot.set_positions(spec.start_positions())
        self._robot.forgive_touching_links()
        self._joints = [self._robot.joints[row] for row in self._robot.joint_rows(list(spec.groups[group]))]
        self._low = np.array([max(joint.lower, -np.pi) for joint in self._joints])
        self._high = np.array([min(joint.upper, np.pi) for joint in self._joints])
        self._sequence = qmc.Halton(len(self._joints), seed=request.seed)  # more even than random numbers
        self._rng = np.random.default_rng(request.seed)
        self._turn, self._good = False, []
        self._camera = DepthCamera(sensors[camera], self._robot, noise=False)
        self.grid = _Grid(request.resolution_m, request.bounds or world.bounds)
        full = self._camera.pinhole
        self._pinhole = Pinhole(80, 60, full.horizontal_fov_rad, full.vertical_fov_rad)
        self._rays = self._pinhole.rays().reshape(-1, 3).astype(np.float32)
        self._lengths = np.linalg.norm(self._rays, axis=1)

    def place(self) -> bool:
        """Draw a configuration; whether it is free of collision."""
        drawn = self._draw()
        self._drawn = drawn
        self._robot.set_positions(dict(zip((joint.name for joint in self._joints), drawn, strict=True)))
        client = self._scene.client
        client.performCollisionDetection()
        return all(point[8] > 0.0 for point in client.getContactPoints(bodyA=self._robot.body))

    def _draw(self) -> np.ndarray:
        """A configuration (J,): spread evenly, or every other time about one that found much of late."""
        self._turn = not self._turn
        if self._turn or not self._good:
            return self._low + self._sequence.random()[0] * (self._high - self._low)
        gains = np.array([gain for _, gain in self._good], float)
        picked = self._good[self._rng.choice(len(gains), p=gains / gains.sum())][0]
        return np.clip(picked + self._rng.normal(0.0, _NEIGHBOUR_RAD, len(picked)), self._low, self._high)

    def reward(self, gain: int) -> None:
        """Remember the last configuration if it found voxels."""
        if gain > 0:
            self._good = [*self._good[-_REMEMBERED:], (self._drawn, gain)]

    def look(self) -> int:
        """Mark what the camera sees from here; the number of voxels that are marked so far."""
        limits, T = self._camera.config, self._camera.pose()
        picture = take_picture(
            self._scene, self._pinhole, T, _NEAR_M, limits.max_range_m + 0.5, with_bodies=True
        )
        depth = picture.depth.ravel().astype(np.float32)
        with np.errstate(invalid="ignore"):
            use = (depth >= limits.min_range_m) & (depth * self._lengths <= limits.max_range_m)
        use &= picture.body.ravel() != self._robot.body  # the self-filter drops the robot's own points
        self._mark(T, use, depth)
        return int(self.grid.mask.sum())

    def _mark(self, T: np.ndarray, use: np.ndarray, depth: np.ndarray) -> None:
        """Mark the rays to use (R,) from the camera to their depths (R,), in steps of half a voxel, ends included.

        Near the camera, where rays lie closer than a third of a voxel, some of them suffice.
        """
        if not use.any():
            return
        grid = self.grid
        origin = grid.to_cells(T[:3, 3], is_point=True)
        directions = grid.to_cells(self._rays @ T[:3, :3].T, is_point=False)
        step = 0.5 * grid.resolution_m / float(self._lengths.max())
        picked = {n: self._every(n, use).nonzero()[0] for n in (8, 4, 2, 1)}
        for t in np.arange(0.0, float(depth[use].max()), step):
            spacing = t / min(self._pinhole.fx, self._pinhole.fy)  # of neighbouring rays [m]
            rows = picked[next(n for n in (8, 4, 2, 1) if n == 1 or n * spacing < grid.resolution_m / 3.0)]
            rows = rows[depth[rows] > t]
            grid.mark(origin + directions[rows] * np.float32(t))
        grid.mark(origin + directions[use] * depth[use, None])

    def _every(self, n: int, use: np.ndarray) -> np.ndarray:
        """Of the rays to use (R,), those of every n-th row and column of the picture."""
        some = np.zeros((self._pinhole.height, self._pinhole.width), bool)
        some[::n, ::n] = True
        return some.ravel() & use
