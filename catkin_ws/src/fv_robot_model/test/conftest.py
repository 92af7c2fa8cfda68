"""Robots for the tests: a small own one, the KUKA iiwa of pybullet_data, and HUBO when its package is there."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from fv_robot_model import RobotModel

EXAMPLE_URDF = """<robot name="example">
  <link name="base"><collision><geometry><box size="0.4 0.4 0.1"/></geometry></collision></link>
  <link name="trunk"><collision><origin xyz="0 0 0.25"/><geometry><cylinder radius="0.06" length="0.5"/></geometry>
  </collision></link>
  <link name="arm"><collision><origin xyz="0.2 0 0" rpy="0 1.5707963267948966 0"/>
    <geometry><cylinder radius="0.04" length="0.4"/></geometry></collision></link>
  <link name="hand"><collision><geometry><sphere radius="0.06"/></geometry></collision></link>
  <joint name="turn" type="continuous"><parent link="base"/><child link="trunk"/><origin xyz="0 0 0.05"/>
    <axis xyz="0 0 1"/></joint>
  <joint name="lift" type="prismatic"><parent link="trunk"/><child link="arm"/><origin xyz="0.1 0 0.2"/>
    <axis xyz="0 0 1"/><limit lower="-0.25" upper="0.3" effort="10" velocity="0.2"/></joint>
  <joint name="wrist" type="revolute"><parent link="arm"/><child link="hand"/><origin xyz="0.45 0 0" rpy="0 0.5 0"/>
    <axis xyz="0 1 1"/><limit lower="-2" upper="2" effort="10" velocity="2"/></joint>
</robot>"""
EXAMPLE_SRDF = """<robot name="example">
  <group name="arm"><chain base_link="trunk" tip_link="hand"/></group>
  <group name="all"><chain base_link="base" tip_link="hand"/></group>
  <group_state name="home" group="arm"><joint name="lift" value="0.1"/><joint name="wrist" value="-0.5"/></group_state>
</robot>"""


@dataclass
class Example:
    """A robot as text, as model, and as a file that pybullet can load."""

    model: RobotModel
    urdf_file: Path

    def random_q(self, count: int, seed: int) -> np.ndarray:
        """(count, J) uniform within the limits."""
        lower = [limit.lower for limit in self.model.limits]
        upper = [limit.upper for limit in self.model.limits]
        return np.random.default_rng(seed).uniform(lower, upper, (count, len(lower)))


def _written(folder: Path, name: str, urdf: str) -> Path:
    file = folder / f"{name}.urdf"
    file.write_text(urdf)
    return file


def _example(folder: Path) -> Example:
    return Example(RobotModel.from_xml(EXAMPLE_URDF, EXAMPLE_SRDF), _written(folder, "example", EXAMPLE_URDF))


def _kuka(_folder: Path) -> Example:
    pybullet_data = pytest.importorskip("pybullet_data")
    home = Path(pybullet_data.getDataPath()) / "kuka_iiwa"
    file = home / "model.urdf"
    return Example(RobotModel.from_xml(file.read_text(), "", lambda uri: str(home / uri)), file)


def _hubo(folder: Path) -> Example:
    hubo_description = pytest.importorskip("hubo_description")
    robot = hubo_description.load_robot("hubo")
    model = RobotModel.from_xml(robot.urdf_xml, robot.srdf_xml)
    return Example(model, _written(folder, "hubo", robot.urdf_xml.replace("file://", "")))


_MAKERS: dict[str, Callable[[Path], Example]] = {"example": _example, "kuka": _kuka, "hubo": _hubo}


@pytest.fixture(scope="session", params=list(_MAKERS))
def robot(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Example:
    """Each robot in turn."""
    return _MAKERS[request.param](tmp_path_factory.mktemp(request.param))


@pytest.fixture(scope="session")
def example(tmp_path_factory: pytest.TempPathFactory) -> Example:
    """The small one: three joints of three kinds, primitives only."""
    return _example(tmp_path_factory.mktemp("example"))
