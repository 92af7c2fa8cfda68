"""Lidar, inertial unit and force-torque sensor against what physics says."""

import numpy as np
import pytest

from hubo_sim.config import SimConfig
from hubo_sim.control.trajectory_goal import TrajectoryGoal
from hubo_sim.errors import SimError
from hubo_sim.robot_spec import RobotSpec
from hubo_sim.ros.conversions import laser_msg
from hubo_sim.simulator import Simulator
from hubo_sim.worlds import parse_world

INERTIAL = '<inertial><mass value="{m}"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>'
URDF = f"""<robot name="r">
  <link name="base">{INERTIAL.format(m=5)}</link>
  <link name="mast">{INERTIAL.format(m=2)}</link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="mast"/><origin xyz="0 0 1"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="50" velocity="2"/></joint>
  <link name="tip"/>
  <joint name="fix" type="fixed"><parent link="mast"/><child link="tip"/><origin xyz="0.5 0 0"/></joint>
</robot>"""
WORLD = {
    "description": "a wall",
    "bounds": {"min_m": [-1, -1, -1], "max_m": [1, 1, 1]},
    "objects": [{"name": "wall", "box": {"size_m": [0.1, 10, 10]}, "position_m": [2.05, 0, 0]}],
}
LIDAR = {
    "type": "lidar",
    "link": "mast",
    "frame": "mast",
    "topic": "/scan",
    "samples": 181,
    "horizontal_fov_deg": 180.0,
}
LIDAR |= {"min_range_m": 0.1, "max_range_m": 5.0}
IMU = {"type": "imu", "link": "tip", "topic": "/imu"}
WRENCH = {"type": "force_torque", "joint": "turn", "topic": "/wrench"}


def make(**sensors):
    controllers = {"c": {"type": "position_controllers/JointTrajectoryController", "joints": ["turn"]}}
    spec = RobotSpec(URDF, sensors=sensors, controllers=controllers)
    sim = Simulator(spec, parse_world(WORLD, "w", "w"), SimConfig(renderer="tiny"))
    for _ in range(60):
        sim.step()
    return sim


def test_planar_lidar_measures_a_wall():
    sim = make(lidar=LIDAR)
    lidar = sim.sensors["lidar"]
    ranges = lidar.scan(sim.scene, 0)[0]
    wanted = 2.0 / np.cos(lidar.azimuths_rad)
    seen = wanted < 4.9
    assert ranges[seen] == pytest.approx(wanted[seen], abs=1e-3)
    assert np.isnan(ranges[wanted > 5.1]).all()
    msg = laser_msg(ranges, lidar.azimuths_rad, (0.1, 5.0), None)
    assert msg.ranges[90] == pytest.approx(2.0, abs=1e-3) and np.isinf(msg.ranges[0])
    sim.close()


def test_layers_of_a_3d_lidar_lie_on_the_wall():
    sim = make(
        lidar=LIDAR | {"layers": 8, "vertical_fov_deg": 30.0, "horizontal_fov_deg": 60.0, "samples": 50}
    )
    lidar = sim.sensors["lidar"]
    points = lidar.points(lidar.scan(sim.scene, 0))
    assert points.shape == (8, 50, 3)
    assert points[..., 0] == pytest.approx(2.0, abs=2e-3)
    sim.close()


def test_lidar_noise_has_its_spread_and_repeats():
    sim = make(lidar=LIDAR | {"sigma_m": 0.02, "samples": 2000, "horizontal_fov_deg": 60.0})
    lidar = sim.sensors["lidar"]
    first = lidar.scan(sim.scene, 1)[0]
    error = first - 2.0 / np.cos(lidar.azimuths_rad)
    assert error.std() == pytest.approx(0.02, rel=0.1)
    assert np.array_equal(first, lidar.scan(sim.scene, 1)[0])
    assert not np.array_equal(first, lidar.scan(sim.scene, 2)[0])
    sim.close()


def test_lidar_readings_that_noise_carries_past_the_limits_are_none():
    sim = make(lidar=LIDAR | {"max_range_m": 2.02, "sigma_m": 0.05})  # the wall is at 2 m
    ahead = np.array([sim.sensors["lidar"].scan(sim.scene, number)[0, 90] for number in range(40)])
    assert 5 < np.isnan(ahead).sum() < 35
    assert np.nanmax(ahead) <= 2.02


def test_imu_feels_nothing_of_a_reset():
    sim = make(imu=IMU)
    controller = sim.controllers["c"]
    controller.start(TrajectoryGoal(["turn"], [1.0], [[1.5]], [[]], [[]]), sim.now_s)
    for _ in range(120):
        sim.step()
    sim.reset()
    sim.step()
    force = sim.sensors["imu"].measure(0)[1]
    assert force == pytest.approx([0.0, 0.0, 9.81], abs=0.3)


def test_imu_at_rest_feels_gravity_upwards():
    sim = make(imu=IMU)
    angular, force = sim.sensors["imu"].measure(0)
    assert angular == pytest.approx(np.zeros(3), abs=1e-6)
    assert force == pytest.approx([0.0, 0.0, 9.81], abs=1e-3)
    sim.close()


def test_imu_on_a_turning_mast_feels_its_rate_and_the_centripetal_force():
    sim = make(imu=IMU)
    for i in range(240):  # 1 rad/s
        sim.robot.command_positions(np.array([0]), np.array([i / 240.0]), np.array([1.0]))
        sim.robot.apply()
        sim.scene.client.stepSimulation()
        sim.sensors["imu"].update(sim.scene.step_s)
    angular, force = sim.sensors["imu"].measure(0)
    assert angular == pytest.approx([0.0, 0.0, 1.0], abs=0.01)
    assert force[0] == pytest.approx(-0.5, abs=0.05)  # towards the axis: -omega^2 r
    sim.close()


def test_force_torque_at_rest_carries_the_weight_beyond_the_joint():
    sim = make(wrench=WRENCH)
    force, _ = sim.sensors["wrench"].measure(0)
    assert abs(force[2]) == pytest.approx(2.001 * 9.81, rel=0.01)
    assert force[:2] == pytest.approx([0.0, 0.0], abs=0.01)
    sim.close()


@pytest.mark.parametrize(
    ("sensor", "word"),
    [
        ({"type": "sonar"}, "sonar"),
        (LIDAR | {"link": "nose"}, "nose"),
        (LIDAR | {"samples": 0}, "samples"),
        (LIDAR | {"smaples": 3}, "smaples"),
        (WRENCH | {"joint": "knee"}, "knee"),
        (IMU | {"link": "nose"}, "nose"),
        (IMU | {"rate_hz": 0.0}, "rate_hz"),
    ],
)
def test_bad_sensors_are_named(sensor, word):
    with pytest.raises(SimError, match=word):
        make(bad=sensor)
