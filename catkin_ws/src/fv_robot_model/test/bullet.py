"""A robot in pybullet without physics: the independent oracle for kinematics and self-collision."""

from pathlib import Path

import numpy as np
import pybullet
from pybullet_utils.bullet_client import BulletClient


def _matrix(position: tuple[float, ...], quaternion_xyzw: tuple[float, ...]) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = np.reshape(pybullet.getMatrixFromQuaternion(quaternion_xyzw), (3, 3))
    T[:3, 3] = position
    return T


class BulletRobot:
    """Joint values in, link poses and distances between links out."""

    def __init__(self, urdf_file: Path) -> None:
        self._client = BulletClient(pybullet.DIRECT)
        self._body = self._client.loadURDF(str(urdf_file), useFixedBase=True)
        infos = [
            self._client.getJointInfo(self._body, i) for i in range(self._client.getNumJoints(self._body))
        ]
        self._joints = {info[1].decode(): info[0] for info in infos}
        self._links = {info[12].decode(): info[0] for info in infos}
        self._links[self._client.getBodyInfo(self._body)[0].decode()] = -1

    def set(self, names: list[str], q: np.ndarray) -> None:
        """Put the joints at q (J,)."""
        for name, value in zip(names, q, strict=True):
            self._client.resetJointState(self._body, self._joints[name], value)

    def _T_world_link(self, link: str) -> np.ndarray:
        index = self._links[link]
        if index >= 0:
            state = self._client.getLinkState(self._body, index, computeForwardKinematics=True)
            return _matrix(state[4], state[5])
        inertial = self._client.getDynamicsInfo(self._body, -1)
        T_world_com = _matrix(*self._client.getBasePositionAndOrientation(self._body))
        return T_world_com @ np.linalg.inv(_matrix(inertial[3], inertial[4]))

    def T_root_link(self, root: str, link: str) -> np.ndarray:
        """(4, 4) pose of a link's frame."""
        return np.linalg.inv(self._T_world_link(root)) @ self._T_world_link(link)

    def distance(self, link_a: str, link_b: str, within_m: float) -> float:
        """Distance between two links [m], negative where they overlap; within_m when they are further apart."""
        points = self._client.getClosestPoints(
            self._body, self._body, within_m, self._links[link_a], self._links[link_b]
        )
        return min((point[8] for point in points), default=within_m)
