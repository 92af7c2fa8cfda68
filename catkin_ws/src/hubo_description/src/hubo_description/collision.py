"""Self-collision of a robot by pybullet: for the disabled pairs and for tests, not for planning."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from fv_common.native_output import native_output_hidden
from fv_robot_model import ModelError
from hubo_description.bullet_urdf import mimic_positions, urdf_for_bullet
from hubo_description.errors import RobotDescriptionError
from hubo_description.robot import Robot


class SelfCollision:
    """Distances between the links of one robot in a physics client of its own. Close it, or use ``with``."""

    def __init__(self, robot: Robot) -> None:
        """Load the robot.

        :raises RobotDescriptionError: pybullet refuses the URDF.
        """
        with native_output_hidden():
            import pybullet  # heavy: only who asks for collisions pays

        self._bullet, self._model = pybullet, robot.model
        self._client = pybullet.connect(pybullet.DIRECT)
        self._body = self._load(robot)
        infos = [pybullet.getJointInfo(self._body, k, self._client) for k in range(self._count())]
        self._joint_index = {info[1].decode(): info[0] for info in infos}
        self.link_index = {robot.model.root_link: -1} | {info[12].decode(): info[0] for info in infos}

    def __enter__(self) -> SelfCollision:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Release the physics client."""
        self._bullet.disconnect(self._client)

    def _count(self) -> int:
        return self._bullet.getNumJoints(self._body, self._client)

    def _load(self, robot: Robot) -> int:
        with tempfile.TemporaryDirectory() as folder:
            text = self._urdf(robot, Path(folder))
            path = Path(folder) / "robot.urdf"
            path.write_text(text, encoding="utf-8")
            try:
                with native_output_hidden():
                    return self._bullet.loadURDF(str(path), useFixedBase=True, physicsClientId=self._client)
            except self._bullet.error as err:
                self.close()
                raise RobotDescriptionError(f"{robot.name}: pybullet cannot load the URDF: {err}") from err

    def _urdf(self, robot: Robot, folder: Path) -> str:
        try:
            return urdf_for_bullet(robot.urdf_xml, robot.model, folder)
        except ModelError as err:
            self.close()
            raise RobotDescriptionError(
                f"{robot.folder}/robot.yaml: urdf {robot.config.urdf}: {err}"
            ) from err

    def set_joints(self, pose: dict[str, float]) -> None:
        """Put the named joints at these values, rad or m, and all mimics where these put them; the others stay."""
        for name, value in (pose | mimic_positions(self._model, pose)).items():
            self._bullet.resetJointState(
                self._body, self._joint_index[name], value, physicsClientId=self._client
            )

    def distance(self, link_a: str, link_b: str, limit_m: float) -> float:
        """Return the distance of two links [m], negative when they overlap; inf beyond limit_m."""
        indices = self.link_index[link_a], self.link_index[link_b]
        points = self._bullet.getClosestPoints(
            self._body, self._body, limit_m, *indices, physicsClientId=self._client
        )
        return min((point[8] for point in points), default=np.inf)

    def colliding_pairs(self, pairs: list[tuple[str, str]]) -> list[tuple[str, str]]:
        """Return those of the pairs that overlap in the present pose."""
        return [pair for pair in pairs if self.distance(*pair, limit_m=0.0) < 0.0]
