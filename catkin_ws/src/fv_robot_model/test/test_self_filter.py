"""Labels of the self-filter against distances to every shape, on every robot (hulls of meshes included)."""

import numpy as np
from conftest import Example

from fv_robot_model import PointClass, SelfFilter, SelfFilterConfig

PADDING_M, SHADOW_M = 0.02, 0.03
RAY_STEP_M = 0.001


def gap_to_body(robot: Example, q: np.ndarray, points_root: np.ndarray) -> np.ndarray:
    """(N,) distance of points (N, 3) to the nearest shape, less the padding [m]."""
    gap = np.full(len(points_root), np.inf)
    poses = robot.model.forward(q)
    for link, T_root_link in zip(robot.model.link_names, poses, strict=True):
        for shape in robot.model.shapes(link):
            T = np.linalg.inv(T_root_link @ shape.T_link_shape)
            gap = np.minimum(gap, shape.signed_distance(points_root @ T[:3, :3].T + T[:3, 3]))
    return gap - PADDING_M


def points_near_body(robot: Example, q: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """(N, 3) points around the links' origins, where something is to be decided."""
    origins = robot.model.forward(q)[:, :3, 3]
    return origins[random.integers(len(origins), size=800)] + random.normal(0.0, 0.1, (800, 3))


def test_labels_agree_with_the_distances_along_the_rays(robot) -> None:
    random = np.random.default_rng(7)
    selfie = SelfFilter(robot.model, SelfFilterConfig(padding_m=PADDING_M, shadow_m=SHADOW_M))
    for q in robot.random_q(2, seed=8):
        T_root_sensor = np.eye(4)
        T_root_sensor[:3, 3] = random.uniform(-1.5, 1.5, 3)
        points = points_near_body(robot, q, random)
        to_sensor = T_root_sensor[:3, 3] - points
        to_sensor /= np.linalg.norm(to_sensor, axis=1, keepdims=True)
        steps = np.arange(0.0, SHADOW_M, RAY_STEP_M)
        before = np.min([gap_to_body(robot, q, points + s * to_sensor) for s in steps], axis=0)
        labels = selfie.classify(points - T_root_sensor[:3, 3], T_root_sensor, q)
        is_robot = gap_to_body(robot, q, points) <= 0.0
        np.testing.assert_array_equal(labels == int(PointClass.ROBOT), is_robot)
        assert (labels[~is_robot & (before < 0.0)] == int(PointClass.SHADOW)).all()
        assert (labels[before > 2 * RAY_STEP_M] == int(PointClass.SCENE)).all()
        assert len(np.unique(labels)) == 3


def test_is_robot_is_within_the_padding(robot) -> None:
    random = np.random.default_rng(9)
    selfie = SelfFilter(robot.model, SelfFilterConfig(padding_m=PADDING_M))
    for q in robot.random_q(3, seed=10):
        points = points_near_body(robot, q, random)
        np.testing.assert_array_equal(selfie.is_robot(points, q), gap_to_body(robot, q, points) <= 0.0)
