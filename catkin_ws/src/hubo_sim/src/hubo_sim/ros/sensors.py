"""The ROS side of lidars, inertial units and force-torque sensors."""

from __future__ import annotations

import numpy as np
import rospy
from geometry_msgs.msg import WrenchStamped
from sensor_msgs.msg import Imu as ImuMsg
from sensor_msgs.msg import LaserScan, PointCloud2

from fv_common.conversions import cloud_msg
from hubo_sim.ros.conversions import header, imu_msg, laser_msg, wrench_msg
from hubo_sim.sensors.other_sensors import ForceTorque, Imu, Lidar
from hubo_sim.worlds.scene import Scene


class RosSensor:
    """Publishes one sensor on its topic: LaserScan, PointCloud2, Imu or WrenchStamped."""

    def __init__(self, sensor: Lidar | Imu | ForceTorque) -> None:
        self._sensor = sensor
        self.readings = 0  # so far: the noise depends on it
        self._due_s = 0.0
        self._pub = rospy.Publisher(sensor.config.topic, self._message_type(), queue_size=10)

    @property
    def is_heavy(self) -> bool:
        """Whether lockstep leaves it out unless scans run free."""
        return isinstance(self._sensor, Lidar)

    def is_due(self, now_s: float) -> bool:
        """Whether a reading is due."""
        if now_s < self._due_s:
            return False
        self._due_s = max(self._due_s + 1.0 / self._sensor.config.rate_hz, now_s)
        return True

    def publish(self, scene: Scene, stamp: rospy.Time) -> None:
        """Measure now and publish under `stamp`."""
        sensor, number = self._sensor, self.readings
        self.readings += 1
        if isinstance(sensor, Lidar):
            self._pub.publish(self._lidar_msg(sensor, sensor.scan(scene, number), stamp))
        elif isinstance(sensor, Imu):
            self._pub.publish(imu_msg(*sensor.measure(number), header(stamp, sensor.config.link)))
        else:
            self._pub.publish(wrench_msg(*sensor.measure(number), header(stamp, sensor.frame)))

    def _message_type(self) -> type:
        sensor = self._sensor
        if isinstance(sensor, Lidar):
            return LaserScan if sensor.config.layers == 1 else PointCloud2
        return ImuMsg if isinstance(sensor, Imu) else WrenchStamped

    @staticmethod
    def _lidar_msg(sensor: Lidar, ranges: np.ndarray, stamp: rospy.Time) -> LaserScan | PointCloud2:
        config, head = sensor.config, header(stamp, sensor.config.frame)
        if config.layers == 1:
            return laser_msg(ranges[0], sensor.azimuths_rad, (config.min_range_m, config.max_range_m), head)
        return cloud_msg(sensor.points(ranges), head)
