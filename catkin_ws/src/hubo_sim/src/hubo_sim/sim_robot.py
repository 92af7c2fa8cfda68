"""The robot in the pybullet scene: joints by name, commands in, state out."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fv_common.native_output import native_output_hidden
from fv_common.transforms import quaternion_of, transform
from fv_robot_model import RobotModel
from hubo_description.bullet_urdf import urdf_for_bullet
from hubo_sim.bullet import BulletClient, pybullet
from hubo_sim.errors import SimError
from hubo_sim.robot_spec import RobotSpec
from hubo_sim.worlds.scene import Scene, place_root, root_pose

# Bullet's motor gains of position joints: with the velocity fed forward these follow a trajectory closely
# and do not ring (bench/sim.py, case tracking).
POSITION_GAIN = 0.3
VELOCITY_GAIN = 1.0
_GEAR_ERP = 0.8  # share of a mimic joint's error that a step takes away
_GEAR_FORCE = 1e4  # [N m, N] a linkage gives way to nothing
_DEFAULT_FORCE = 100.0  # [N m] where the URDF states no effort


@dataclass(frozen=True)
class JointInfo:
    """A movable joint, SI units: limits [rad or m], damping [N m s]; continuous joints have infinite limits."""

    name: str
    index: int
    lower: float
    upper: float
    max_velocity: float
    max_effort: float
    damping: float
    continuous: bool


class SimRobot:
    """A robot fixed at its base link. Arrays over joints have the order of `joint_names`."""

    def __init__(
        self, scene: Scene, spec: RobotSpec, T_world_base: np.ndarray, self_collision: bool = True
    ) -> None:
        self.spec = spec
        self._client = scene.client
        with tempfile.TemporaryDirectory() as folder:
            urdf = _bullet_text(spec, Path(folder))
            self.body = _load(scene, urdf, Path(folder) / "robot.urdf", T_world_base, self_collision)
        scene.note_textures(self.body, urdf)
        infos = [self._client.getJointInfo(self.body, i) for i in range(self._client.getNumJoints(self.body))]
        base_name = self._client.getBodyInfo(self.body)[0].decode()
        self.link_index: dict[str, int] = {base_name: -1} | {info[12].decode(): info[0] for info in infos}
        self.link_name: dict[int, str] = {index: name for name, index in self.link_index.items()}
        self.joints = [_joint(info, spec) for info in infos if info[2] in (0, 1)]
        self.joint_names = [joint.name for joint in self.joints]
        self.indices = [joint.index for joint in self.joints]
        self._lookup = {name: i for i, name in enumerate(self.joint_names)}
        if spec.base_link != base_name:
            raise SimError(f"base_link {spec.base_link!r} is not the URDF's root, which is {base_name!r}")
        for pair in spec.model.disabled_pairs if self_collision else ():
            self._disable(*pair)
        self._require_shapes()
        self._mimics = _Mimics(spec.model, self._lookup)
        self._mimics.couple(self._client, self.body, self.indices)
        self._target = np.zeros(len(self.joints))
        self._target_velocity = np.zeros(len(self.joints))
        self._effort = np.zeros(len(self.joints))
        self._friction = np.zeros(len(self.joints))
        self._effort_mode = np.zeros(len(self.joints), bool)
        self._stale = np.ones(len(self.joints), bool)  # position commands that the engine has not got yet
        self.set_positions(dict.fromkeys(self.joint_names, 0.0))

    def fold(self, values: np.ndarray) -> np.ndarray:
        """Forces (J,) or inertias (J, J) of all joints with those of mimics added to their leaders'."""
        return self._mimics.fold(values)

    def _require_shapes(self) -> None:
        """Check that Bullet made every collision shape. Raises SimError naming the link."""
        for link, index in self.link_index.items():
            wanted = len(self.spec.model.shapes(link))
            made = len(self._client.getCollisionShapeData(self.body, index)) if wanted else 0
            if made < wanted:
                raise SimError(f"link {link!r}: Bullet made {made} of its {wanted} collision shapes")

    def joint_rows(self, names: list[str]) -> np.ndarray:
        """Row numbers of joints by name. Raises SimError listing the valid names."""
        unknown = [name for name in names if name not in self._lookup]
        if unknown:
            raise SimError(
                f"unknown joint {', '.join(unknown)}; the robot has: {', '.join(self.joint_names)}"
            )
        return np.array([self._lookup[name] for name in names], int)

    def state(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Positions [rad], velocities [rad/s] and motor efforts [N m], (J,) each."""
        states = self._client.getJointStates(self.body, self.indices)
        positions = np.array([s[0] for s in states])
        velocities = np.array([s[1] for s in states])
        motors = np.array([s[3] for s in states])
        return positions, velocities, np.where(self._effort_mode, self._effort, motors)

    def set_positions(self, positions: dict[str, float]) -> None:
        """Put joints [rad] at rest at once, clamped to nothing; every joint holds where it is then, mimics follow."""
        values = self.state()[0]
        values[self.joint_rows(list(positions))] = list(positions.values())
        self._mimics.follow(values)
        for row in {*self.joint_rows(list(positions)), *self._mimics.rows}:
            self._client.resetJointState(self.body, self.indices[row], float(values[row]), 0.0)
        self._target = self.state()[0]
        self._target_velocity[:] = 0.0
        self._stale[:] = True

    def use_effort(self, names: list[str]) -> None:
        """Let these joints be driven by efforts instead of positions; their damping is then the driver's to apply.

        Bullet applies joint damping explicitly, which diverges where damping * step > 2 * inertia (a wrist).
        """
        rows = np.setdiff1d(self.joint_rows(names), self._mimics.rows)  # gears drive those
        self._effort_mode[rows] = True
        for row in rows:  # Bullet's joints have a motor of their own that must be let go
            self._client.setJointMotorControl2(
                self.body, self.indices[row], pybullet.VELOCITY_CONTROL, targetVelocity=0.0, force=0.0
            )
            self._client.changeDynamics(self.body, self.indices[row], jointDamping=0.0)

    def command_positions(self, rows: np.ndarray, positions: np.ndarray, velocities: np.ndarray) -> None:
        """Set the targets [rad], [rad/s] of position joints from the next step on."""
        changed = (self._target[rows] != positions) | (self._target_velocity[rows] != velocities)
        self._stale[rows] |= changed
        self._target[rows] = positions
        self._target_velocity[rows] = velocities

    def command_efforts(self, rows: np.ndarray, efforts: np.ndarray, friction: np.ndarray) -> None:
        """Set the motors' efforts and the friction that works against them [N m], (R,) each, for the next step."""
        self._effort[rows] = efforts
        self._friction[rows] = friction

    def apply(self) -> None:
        """Hand the commands to the engine; call before every physics step."""
        self._stale[self._mimics.rows] = False  # gears drive them
        stale = np.flatnonzero(self._stale & ~self._effort_mode)
        if stale.size:
            self._client.setJointMotorControlArray(
                self.body,
                [self.indices[i] for i in stale],
                pybullet.POSITION_CONTROL,
                targetPositions=self._target[stale],
                targetVelocities=self._target_velocity[stale],
                forces=[self.joints[i].max_effort for i in stale],
                positionGains=[POSITION_GAIN] * stale.size,
                velocityGains=[VELOCITY_GAIN] * stale.size,
            )
            self._stale[:] = False
        effort = np.flatnonzero(self._effort_mode)
        if effort.size:  # Bullet forgets torques after each step
            self._client.setJointMotorControlArray(
                self.body,
                [self.indices[i] for i in effort],
                pybullet.TORQUE_CONTROL,
                forces=self._effort[effort] - self._friction[effort],
            )

    def link_pose(self, link: str) -> np.ndarray:
        """T_world_link (4, 4) of a link's URDF frame. Raises SimError listing the links."""
        index = self._index_of(link)
        if index < 0:
            return root_pose(self._client, self.body)
        state = self._client.getLinkState(self.body, index, computeForwardKinematics=True)
        return transform(state[4], state[5])

    def link_velocity(self, link: str) -> tuple[np.ndarray, np.ndarray]:
        """Linear [m/s] and angular [rad/s] velocity, (3,) each, of a link frame's origin, world frame."""
        index = self._index_of(link)
        if index < 0:
            return np.zeros(3), np.zeros(3)  # the base is fixed
        state = self._client.getLinkState(self.body, index, computeLinkVelocity=1, computeForwardKinematics=1)
        arm = np.array(state[4]) - np.array(state[0])  # Bullet speaks of the centre of mass
        angular = np.array(state[7])
        return np.array(state[6]) + np.cross(angular, arm), angular

    def enable_force_torque(self, joint: str) -> str:
        """Make `joint_reaction` of a joint available; the name of its child link. Raises SimError."""
        self._reaction_index(joint)
        self._client.enableJointForceTorqueSensor(self.body, self._reaction_index(joint), True)
        return self.link_name[self._reaction_index(joint)]

    def joint_reaction(self, joint: str) -> tuple[np.ndarray, np.ndarray]:
        """Force [N] and torque [N m], (3,) each, in the child link's frame, of the last step."""
        reaction = self._client.getJointState(self.body, self._reaction_index(joint))[2]
        return np.array(reaction[:3]), np.array(reaction[3:])

    def _index_of(self, link: str) -> int:
        if link not in self.link_index:
            raise SimError(f"unknown link {link!r}; the robot has: {', '.join(sorted(self.link_index))}")
        return self.link_index[link]

    def _reaction_index(self, joint: str) -> int:
        count = self._client.getNumJoints(self.body)
        names = {self._client.getJointInfo(self.body, i)[1].decode(): i for i in range(count)}
        if joint not in names:
            raise SimError(f"unknown joint {joint!r}; the robot has: {', '.join(names)}")
        return names[joint]

    def rigid_with(self, link: str) -> set[str]:
        """The links that no joint can move against `link`, itself included."""
        links = {link}
        infos = [self._client.getJointInfo(self.body, i) for i in range(self._client.getNumJoints(self.body))]
        pairs = [
            (info[12].decode(), self.link_name[info[16]]) for info in infos if info[2] == pybullet.JOINT_FIXED
        ]
        while True:
            more = {name for pair in pairs if links.intersection(pair) for name in pair}
            if more <= links:
                return links
            links |= more

    def move_base(self, T_world_base: np.ndarray) -> None:
        """Put the base link elsewhere, (4, 4)."""
        place_root(self._client, self.body, T_world_base)

    def forgive_touching_links(self) -> list[str]:
        """Take link pairs that touch in this very pose out of self-collision; the pairs as "link|link".

        Such links overlap in the model, not in the robot; left in, they would push each other about for ever.
        """
        self._client.performCollisionDetection()
        points = self._client.getContactPoints(bodyA=self.body, bodyB=self.body)
        pairs = sorted({(self.link_name[p[3]], self.link_name[p[4]]) for p in points if p[8] <= 0.0})
        for pair in pairs:
            self._disable(*pair)
        return [f"{link1}|{link2}" for link1, link2 in pairs]

    def _disable(self, link1: str, link2: str) -> None:
        pair = [self.link_index.get(link1), self.link_index.get(link2)]
        if None not in pair:  # an SRDF may name links that this URDF has not
            self._client.setCollisionFilterPair(self.body, self.body, pair[0], pair[1], 0)


class _Mimics:
    """The mimic joints among a robot's joints: gears, that the engine solves together with all else."""

    def __init__(self, model: RobotModel, lookup: dict[str, int]) -> None:
        self._mimics = [joint for joint in model.joints if joint.leader]
        self.rows = np.array([lookup[joint.name] for joint in self._mimics], int)
        self.leaders = np.array([lookup[joint.leader] for joint in self._mimics], int)
        self._multipliers = np.array([joint.multiplier for joint in self._mimics], float)
        self._offsets = np.array([joint.offset for joint in self._mimics], float)
        self._rates = np.eye(len(lookup))  # of all joints by those that move by themselves
        self._rates[self.rows, self.rows] = 0.0
        self._rates[self.rows, self.leaders] = self._multipliers

    def follow(self, positions: np.ndarray) -> None:
        """Set the mimics' positions to what their leaders' ask for, in place; all joints' (J,)."""
        positions[self.rows] = self._multipliers * positions[self.leaders] + self._offsets

    def fold(self, values: np.ndarray) -> np.ndarray:
        """Forces (J,) or inertias (J, J) of all joints as those feel them that move by themselves."""
        if not self.rows.size:
            return values
        folded = self._rates.T @ values
        return folded @ self._rates if values.ndim == 2 else folded

    def couple(self, client: BulletClient, body: int, indices: list[int]) -> None:
        """Tie every mimic to its leader by a gear, and let go of the motors that Bullet gives to joints."""
        no_axis = [0.0, 0.0, 0.0]
        for row, leader, joint in zip(self.rows, self.leaders, self._mimics, strict=True):
            ends = body, indices[row], body, indices[leader]
            client.setJointMotorControl2(*ends[:2], pybullet.VELOCITY_CONTROL, targetVelocity=0.0, force=0.0)
            gear = client.createConstraint(*ends, pybullet.JOINT_GEAR, no_axis, no_axis, no_axis)
            client.changeConstraint(
                gear,
                gearRatio=-joint.multiplier,
                relativePositionTarget=joint.offset,
                erp=_GEAR_ERP,
                maxForce=_GEAR_FORCE,
            )


def _bullet_text(spec: RobotSpec, folder: Path) -> str:
    try:
        return urdf_for_bullet(spec.urdf_xml, spec.model, folder)
    except ValueError as err:
        raise SimError(f"robot: {err}") from err


def _load(scene: Scene, urdf: str, path: Path, T_world_base: np.ndarray, self_collision: bool) -> int:
    flags = pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_USE_MATERIAL_COLORS_FROM_MTL
    if self_collision:
        flags |= pybullet.URDF_USE_SELF_COLLISION | pybullet.URDF_USE_SELF_COLLISION_EXCLUDE_PARENT
    path.write_text(urdf, encoding="utf-8")
    try:
        with native_output_hidden():
            return scene.client.loadURDF(
                str(path), T_world_base[:3, 3], quaternion_of(T_world_base), useFixedBase=True, flags=flags
            )
    except pybullet.error as err:
        raise SimError(f"broken URDF: Bullet cannot load it ({err})") from err


def _joint(info: tuple, spec: RobotSpec) -> JointInfo:
    name = info[1].decode()
    lower, upper, effort, velocity = info[8], info[9], info[10], info[11]
    if name in spec.model.joint_names:
        own = spec.model.limits[
            spec.model.joint_index(name)
        ]  # narrowed by mimics, which Bullet does not know
        lower, upper = (own.lower, own.upper) if own.bounded else (0.0, -1.0)
    continuous = not lower < upper
    limit = spec.joint_limits.get(name) or {}
    if limit.get("has_velocity_limits"):
        velocity = float(limit["max_velocity"])
    return JointInfo(
        name=name,
        index=info[0],
        lower=-np.inf if continuous else lower,
        upper=np.inf if continuous else upper,
        max_velocity=velocity if velocity > 0.0 else np.inf,
        max_effort=effort if effort > 0.0 else _DEFAULT_FORCE,
        damping=info[6],
        continuous=continuous,
    )
