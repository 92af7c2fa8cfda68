"""A depth camera's ROS side: cloud, images, calibration, and the trigger service."""

from __future__ import annotations

from collections.abc import Callable

import rospy
from fv_msgs.srv import TakeScan, TakeScanResponse
from sensor_msgs.msg import CameraInfo, Image, PointCloud2

from fv_common.conversions import cloud_msg, image_msg
from hubo_sim.ros.conversions import camera_info_msg, header
from hubo_sim.sensors.depth_camera import DepthCamera
from hubo_sim.worlds.scene import Scene


class RosCamera:
    """Publishes one depth camera below its topic prefix."""

    def __init__(self, camera: DepthCamera) -> None:
        topic = camera.config.topic.rstrip("/")
        self.camera = camera
        self.trigger_name = f"{topic}/trigger"
        self.scans = 0
        self._due_s = 0.0
        self._cloud_pub = rospy.Publisher(f"{topic}/depth/points", PointCloud2, queue_size=2)
        self._depth_pub = rospy.Publisher(f"{topic}/depth/image_raw", Image, queue_size=2)
        self._color_pub = rospy.Publisher(f"{topic}/rgb/image_raw", Image, queue_size=2)
        self._info_pubs = [
            rospy.Publisher(f"{topic}/{kind}/camera_info", CameraInfo, queue_size=2)
            for kind in ("depth", "rgb")
        ]

    def open(self, request_scan: Callable[[RosCamera], str]) -> None:
        """Begin to listen; request_scan(camera) waits for a scan and returns its stamp, or raises RuntimeError."""
        rospy.Service(self.trigger_name, TakeScan, lambda _: self._on_trigger(request_scan))

    def is_due(self, now_s: float) -> bool:
        """Whether a free-running scan is due."""
        if now_s < self._due_s:
            return False
        self._due_s = max(self._due_s + 1.0 / self.camera.config.rate_hz, now_s)
        return True

    def publish(self, scene: Scene, stamp: rospy.Time) -> None:
        """Measure now and publish under `stamp`: the cloud first, and of the rest what somebody listens to."""
        scan = self.camera.scan(scene, self.scans)
        self.scans += 1
        head = header(stamp, self.camera.config.optical_frame)
        self._cloud_pub.publish(cloud_msg(self.camera.points(scan.depth), head, scan.rgba))
        for publisher in self._info_pubs:
            publisher.publish(camera_info_msg(self.camera.pinhole, head))
        if self._depth_pub.get_num_connections():
            self._depth_pub.publish(image_msg(scan.depth, head))
        if self._color_pub.get_num_connections():
            self._color_pub.publish(image_msg(scan.rgba, head))

    def _on_trigger(self, request_scan: Callable[[RosCamera], rospy.Time]) -> TakeScanResponse:
        try:
            return TakeScanResponse(success=True, stamp=request_scan(self))
        except RuntimeError as err:
            return TakeScanResponse(success=False, message=str(err))
