"""The camera in HUBO's hand looks at HUBO: pybullet renders and knows which pixel is whose."""

import numpy as np
import pytest

from fv_robot_model import PointClass, SelfCollision, SelfFilter, Shape

pybullet = pytest.importorskip("pybullet")
hubo_description = pytest.importorskip("hubo_description")
bullet_client = pytest.importorskip("pybullet_utils.bullet_client")

WIDTH, HEIGHT = 160, 120
NEAR_M, FAR_M = 0.02, 10.0
NOISE_M = 0.003
VIEWS = 8
LOST_SHARE = 0.01


class Room:
    """HUBO in an empty room of 5 x 5 x 4 m, and its camera."""

    def __init__(self, urdf_file, sensor) -> None:
        self._client = bullet_client.BulletClient(pybullet.DIRECT)
        self._robot = self._client.loadURDF(str(urdf_file), useFixedBase=True)
        self._held = -2  # nothing: -1 is the background
        self._joints = {
            self._client.getJointInfo(self._robot, i)[1].decode(): i
            for i in range(self._client.getNumJoints(self._robot))
        }
        self._tan_x = np.tan(np.radians(sensor.horizontal_fov_deg) / 2)
        self._tan_y = np.tan(np.radians(sensor.vertical_fov_deg) / 2)
        for axis, distance in ((0, 2.5), (1, 2.5), (2, 2.0)):
            self._add_walls(axis, distance)

    def _add_walls(self, axis: int, distance_m: float) -> None:
        half = np.full(3, 2.6)
        half[axis] = 0.05
        shape = self._client.createVisualShape(pybullet.GEOM_BOX, halfExtents=half.tolist())
        for sign in (-1.0, 1.0):
            position = np.zeros(3)
            position[axis] = sign * distance_m
            self._client.createMultiBody(0.0, -1, shape, position.tolist())

    def hold(self, edges_m: list[float], p_world: np.ndarray) -> None:
        """Put a box, upright, where the robot holds it; its pixels count as the robot's from now on."""
        half = [edge / 2 for edge in edges_m]
        shape = self._client.createVisualShape(pybullet.GEOM_BOX, halfExtents=half)
        self._held = self._client.createMultiBody(0.0, -1, shape, p_world.tolist())

    def look(
        self, names: list[str], q: np.ndarray, T_world_optical: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """(N, 3) points in the optical frame and (N,) True where the pixel shows the robot."""
        for name, value in zip(names, q, strict=True):
            self._client.resetJointState(self._robot, self._joints[name], value)
        T_gl_world = np.diag([1.0, -1.0, -1.0, 1.0]) @ np.linalg.inv(T_world_optical)
        x, y = NEAR_M * self._tan_x, NEAR_M * self._tan_y
        projection = pybullet.computeProjectionMatrix(-x, x, -y, y, NEAR_M, FAR_M)
        _, _, _, buffer, owner = self._client.getCameraImage(
            WIDTH, HEIGHT, T_gl_world.T.ravel().tolist(), projection, renderer=pybullet.ER_TINY_RENDERER
        )
        z = FAR_M * NEAR_M / (FAR_M - (FAR_M - NEAR_M) * np.asarray(buffer, float).reshape(HEIGHT, WIDTH))
        u, v = np.meshgrid(
            (np.arange(WIDTH) + 0.5) / WIDTH * 2 - 1, (np.arange(HEIGHT) + 0.5) / HEIGHT * 2 - 1
        )
        points = np.stack([u * self._tan_x * z, v * self._tan_y * z, z], axis=-1).reshape(-1, 3)
        return points, np.isin(np.asarray(owner).ravel(), [self._robot, self._held])


def _views_of_itself(robot, room: Room, optical_frame: str):
    """Random free postures in which at least 0.5 % of the pixels show the robot: points, truth, pose, q."""
    model = robot.model
    group = model.group("torso_right_arm")
    checker = SelfCollision(model)
    at_rest = set(checker.contacts(np.zeros(len(model.joint_names))))  # neighbours that touch by construction
    found = 0
    for sample in robot.random_q(20000, seed=5):
        q = np.zeros(len(model.joint_names))
        q[group.joint_indices] = sample[group.joint_indices]
        if set(checker.contacts(q)) - at_rest:
            continue
        T = model.forward(q)[model.link_index(optical_frame)]
        points, is_robot = room.look(model.joint_names, q, T)
        if is_robot.mean() > 0.005:
            found += 1
            yield points, is_robot, T, q
        if found == VIEWS:
            return
    pytest.fail(f"only {found} postures show the robot")


@pytest.mark.parametrize("robot", ["hubo"], indirect=True)
def test_no_point_of_the_robot_survives_and_the_scene_stays(robot) -> None:
    sensor = next(iter(hubo_description.load_robot("hubo").sensors.values()))
    room = Room(robot.urdf_file, sensor)
    selfie = SelfFilter(robot.model)
    random = np.random.default_rng(6)
    lost = scene = 0
    for points, is_robot, T_root_optical, q in _views_of_itself(robot, room, sensor.optical_frame):
        noisy = points * (1.0 + random.normal(0.0, NOISE_M, (len(points), 1)) / points[:, 2:])
        is_scene = selfie.classify(noisy, T_root_optical, q) == int(PointClass.SCENE)
        assert not (is_scene & is_robot).any()
        lost += int((~is_scene & ~is_robot).sum())
        scene += int((~is_robot).sum())
    assert lost <= LOST_SHARE * scene, f"{lost} of {scene} points of the scene are lost"


@pytest.mark.parametrize("robot", ["hubo"], indirect=True)
def test_what_the_hand_holds_is_filtered_when_it_is_attached(robot) -> None:
    sensor = next(iter(hubo_description.load_robot("hubo").sensors.values()))
    room = Room(robot.urdf_file, sensor)
    model = robot.model
    q = np.zeros(len(model.joint_names))
    poses = model.forward(q)
    T_root_optical = poses[model.link_index(sensor.optical_frame)]
    T_root_box = np.eye(4)
    T_root_box[:3, 3] = T_root_optical[:3, 3] + 0.3 * T_root_optical[:3, 2]
    edges = [0.08, 0.05, 0.1]
    room.hold(edges, T_root_box[:3, 3])
    points, is_held = room.look(model.joint_names, q, T_root_optical)
    assert is_held.sum() > 50
    T_link_box = np.linalg.inv(poses[model.link_index("Body_RWP")]) @ T_root_box
    laden = model.with_attached("box", "Body_RWP", [Shape.box(edges, T_link_box)])
    kept = {
        name: SelfFilter(some).classify(points, T_root_optical, q) == int(PointClass.SCENE)
        for name, some in (("bare", model), ("laden", laden))
    }
    assert (kept["bare"] & is_held).any()
    assert not (kept["laden"] & is_held).any()
    lost = (~kept["laden"] & ~is_held).sum()
    assert lost <= LOST_SHARE * (~is_held).sum(), f"{lost} points of the scene are lost"
