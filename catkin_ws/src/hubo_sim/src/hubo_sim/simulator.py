"""The simulator without ROS: scene, robot, controllers and contacts, stepped by whoever owns it."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field, replace

import numpy as np

import hubo_description.sensors as description
from fv_common.errors import told_as
from fv_common.schema import from_mapping
from hubo_sim.config import SimConfig
from hubo_sim.control.drives import EffortDrive, PositionDrive, make_drive
from hubo_sim.control.trajectory_controller import TYPES, ControllerConfig, TrajectoryController
from hubo_sim.errors import SimError
from hubo_sim.robot_spec import RobotSpec
from hubo_sim.sensors.depth_camera import DepthCamera
from hubo_sim.sensors.other_sensors import OTHER_SENSORS, ForceTorque, Imu, Lidar
from hubo_sim.sim_robot import SimRobot
from hubo_sim.worlds import World
from hubo_sim.worlds.scene import Scene

_log = logging.getLogger(__name__)
_NS = 1_000_000_000


@dataclass
class ContactLog:
    """Contacts of the last step, and how many steps had any; pairs are "link|object" or "link|link"."""

    total: int = 0
    pairs: list[str] = field(default_factory=list)
    depths: list[float] = field(default_factory=list)  # penetration [m]


class Simulator:
    """A robot in a world. Physics time counts steps; clock_ns is simulated time, which may run while physics sleeps.

    One thread owns it. The same sequence of calls gives the same states.
    """

    def __init__(self, spec: RobotSpec, world: World, config: SimConfig) -> None:
        self.spec, self.world, self.config = spec, world, config
        self.scene = Scene(config.physics_rate_hz, gui=config.gui, egl=config.renderer != "tiny")
        if config.renderer == "egl" and not self.scene.uses_egl:
            self.scene.close()
            raise SimError("renderer egl does not load here; use auto or tiny")
        self.scene.load_world(world)
        if spec.model.bare_links:
            _log.warning(
                "links without <collision>, they touch nothing: %s", ", ".join(spec.model.bare_links)
            )
        self_collision = config.self_collision and bool(spec.model.disabled_pairs)
        if config.self_collision and not self_collision:
            _log.warning(
                "the SRDF disables no link pairs: no self-collision, neighbours would push each other"
            )
        base_pose = spec.base_pose(world.robot, config.world_frame)
        self.robot = SimRobot(self.scene, spec, base_pose, self_collision=self_collision)
        self._start = spec.start_positions(config.start_pose)
        self.robot.set_positions(self._start)
        touching = self.robot.forgive_touching_links() if self_collision else []
        if touching:
            _log.warning("links overlap at the start, their contacts are ignored: %s", ", ".join(touching))
        self.controllers: dict[str, TrajectoryController] = {}
        self._drives: dict[str, PositionDrive | EffortDrive] = {}
        self._rows: dict[str, np.ndarray] = {}  # of each controller's joints among the robot's
        for name, content in spec.controllers.items():
            if content.get("type") in TYPES:
                self._add_controller(name, content)
        sensors = spec.parsed_sensors()
        self.cameras = {
            name: DepthCamera(sensor, self.robot, config.noise, config.seed)
            for name, sensor in sensors.items()
            if isinstance(sensor, description.DepthCamera)
        }
        self.sensors: dict[str, Lidar | Imu | ForceTorque] = {
            name: OTHER_SENSORS[type(sensor)](sensor, self.robot)
            for name, sensor in sensors.items()
            if type(sensor) in OTHER_SENSORS
        }
        self.clock_ns = 0
        self.steps = 0
        self.contacts = ContactLog()
        self._rest_steps = 0
        self._body_names: dict[int, str] = {}

    @property
    def now_s(self) -> float:
        """Simulated time [s]."""
        return self.clock_ns / _NS

    def close(self) -> None:
        """Free the physics client."""
        self.scene.close()

    def step(self) -> None:
        """One physics step, with controllers before and contacts after it."""
        positions, velocities, _ = self.robot.state()
        now, step_s = self.now_s, self.scene.step_s
        for name, controller in self.controllers.items():
            rows = self._rows[name]
            set_point = controller.update(now, step_s, positions[rows], velocities[rows])
            self._drives[name].drive(set_point)
        self.robot.apply()
        self.scene.client.stepSimulation()
        rate = self.config.physics_rate_hz  # whole nanoseconds, without drift
        self.clock_ns += round((self.steps + 1) * _NS / rate) - round(self.steps * _NS / rate)
        self.steps += 1
        for sensor in self.sensors.values():
            if isinstance(sensor, Imu):
                sensor.update(step_s)
        self._count_contacts()
        slow = np.all(np.abs(self.robot.state()[1]) < self.config.rest_speed_rad_s)
        self._rest_steps = self._rest_steps + 1 if slow else 0

    def sleep_until(self, clock_ns: int) -> None:
        """Let simulated time pass without physics. Time never runs back."""
        self.clock_ns = max(self.clock_ns, clock_ns)

    @property
    def at_rest(self) -> bool:
        """Whether every joint has been slow for rest_time_s and no trajectory is under way."""
        needed = self.config.rest_time_s * self.config.physics_rate_hz
        return self._rest_steps >= needed and not self.is_moving

    @property
    def is_moving(self) -> bool:
        """Whether a controller follows a trajectory."""
        return any(controller.is_moving(self.now_s) for controller in self.controllers.values())

    def current_world(self) -> World:
        """The world as it is now, with what was spawned and moved; the robot's place is the start's."""
        return replace(self.world, objects=self.scene.current_objects())

    def reset(self) -> None:
        """Robot and world as at the start; simulated time goes on, contacts count from zero."""
        for name in list(self.scene.bodies):
            self.scene.remove_object(name)
        self.scene.load_world(self.world)
        self._body_names.clear()
        self.robot.move_base(self.spec.base_pose(self.world.robot, self.config.world_frame))
        self.robot.set_positions(dict.fromkeys(self.robot.joint_names, 0.0) | self._start)
        positions = self.robot.state()[0]
        for name, controller in self.controllers.items():
            controller.reset(positions[self._rows[name]])
            self._drives[name].reset()
        for sensor in self.sensors.values():
            if isinstance(sensor, Imu):
                sensor.reset()
        self.contacts = ContactLog()
        self._rest_steps = 0

    @told_as(SimError)
    def _add_controller(self, name: str, content: dict) -> None:
        config = from_mapping(ControllerConfig, content, f"controller {name}")
        rows = self.robot.joint_rows(config.joints)
        for other, taken in self.controllers.items():
            shared = [joint for joint in config.joints if joint in taken.names]
            if shared:
                raise SimError(f"controller {name}: joint {', '.join(shared)} belongs to controller {other}")
        joints = [self.robot.joints[row] for row in rows]
        limits = [self.spec.joint_limits.get(joint.name) or {} for joint in joints]
        deceleration = np.array([float(limit.get("max_acceleration") or 5.0) for limit in limits])
        positions = self.robot.state()[0][rows]
        try:
            self._drives[name] = make_drive(self.robot, self.scene.client, config, self.scene.step_s)
        except SimError as err:
            raise SimError(f"controller {name}: {err}") from err
        self.controllers[name] = TrajectoryController(config, joints, positions, deceleration)
        self._rows[name] = rows

    def _count_contacts(self) -> None:
        points = self.scene.client.getContactPoints(bodyA=self.robot.body)
        depths: dict[str, float] = {}
        for point in points:
            if point[8] <= 0.0:
                name = self._pair_name(point)
                depths[name] = max(depths.get(name, 0.0), -point[8])
        self.contacts.pairs, self.contacts.depths = list(depths), list(depths.values())
        self.contacts.total += bool(depths)

    def _pair_name(self, point: tuple) -> str:
        link = self.robot.link_name[point[3]]
        if point[2] == self.robot.body:
            return f"{link}|{self.robot.link_name[point[4]]}"
        if point[2] not in self._body_names:
            self._body_names = {body: name for name, body in self.scene.bodies.items()}
        return f"{link}|{self._body_names.get(point[2], '?')}"
