"""What the planner talks to, played by the tests: map, joint states, transform, controllers."""

from __future__ import annotations

import threading
import time

import actionlib
import numpy as np
import rospy
import tf2_ros
from control_msgs.msg import FollowJointTrajectoryAction, FollowJointTrajectoryResult
from fv_msgs.msg import MapUpdate
from geometry_msgs.msg import TransformStamped
from ompl_planner import _core
from sensor_msgs.msg import JointState

BASE_HEIGHT = 0.8327
RESOLUTION = 0.02
EVERYWHERE = [-1.5, -1.5, -0.2, 1.5, 1.5, 2.4]


class FakeMap:
    """The explorer's latched map, made of boxes."""

    def __init__(self) -> None:
        self.pub = rospy.Publisher("/fv_exploration/map", MapUpdate, queue_size=1, latch=True)
        self.sequence = 0

    def publish(
        self,
        free=(EVERYWHERE,),
        occupied=(),
        unknown=(),
        frame: str = "world",
        resolution: float = RESOLUTION,
    ) -> int:
        """Publish a new map; rows are min x y z, max x y z [m]. Returns its sequence number."""
        self.sequence += 1
        msg = MapUpdate(sequence=self.sequence)
        msg.header.frame_id = frame
        msg.header.stamp = rospy.Time.now()
        msg.octomap.header = msg.header
        msg.octomap.binary = True
        msg.octomap.id = "OcTree"
        msg.octomap.resolution = resolution
        payload = _core.octree_payload(
            resolution_m=resolution,
            free=np.reshape(free, (-1, 6)).astype(float),
            occupied=np.reshape(occupied, (-1, 6)).astype(float),
            unknown=np.reshape(unknown, (-1, 6)).astype(float),
        )
        msg.octomap.data = np.frombuffer(payload, dtype=np.int8).tolist()
        self.pub.publish(msg)
        return self.sequence

    def publish_raw(self, msg: MapUpdate) -> None:
        """Publish a message as it is, for maps that must be refused."""
        self.pub.publish(msg)


class FakeRobot:
    """Joint states at 50 Hz, the fixed base, and controllers that follow perfectly."""

    def __init__(self, controllers: dict[str, list[str]], start: dict[str, float]) -> None:
        self._lock = threading.Lock()
        self._positions = dict(start)
        self.publishing = True
        self._messages = 0  # published so far
        self.slowdown = 1.0  # motions take this many times longer
        self.refuse = ""  # a controller that aborts its goals
        self.starts: dict[str, float] = {}  # wall time at which each controller began
        self._pub = rospy.Publisher("/joint_states", JointState, queue_size=5)
        self._broadcaster = tf2_ros.StaticTransformBroadcaster()
        self._send_transform()
        self._servers = [self._serve(name, joints) for name, joints in controllers.items()]
        self._thread = threading.Thread(target=self._publish_forever, daemon=True)
        self._thread.start()

    def positions(self) -> dict[str, float]:
        with self._lock:
            return dict(self._positions)

    def place(self, positions: dict[str, float]) -> None:
        """Set joints and wait until the planner must have heard of it."""
        with self._lock:
            self._positions.update(positions)
        told = self._messages
        while self.publishing and self._messages < told + 3:  # that under way may have the old ones
            time.sleep(0.01)
        time.sleep(0.1)

    def _send_transform(self) -> None:
        msg = TransformStamped()
        msg.header.frame_id = "world"
        msg.header.stamp = rospy.Time.now()
        msg.child_frame_id = "base_link"
        msg.transform.translation.z = BASE_HEIGHT
        msg.transform.rotation.w = 1.0
        self._broadcaster.sendTransform(msg)

    def _publish_forever(self) -> None:
        while not rospy.is_shutdown():
            if self.publishing:
                positions = self.positions()
                msg = JointState(name=list(positions), position=list(positions.values()))
                msg.header.stamp = rospy.Time.now()
                self._pub.publish(msg)
                self._messages += 1
            time.sleep(0.02)

    def _serve(self, name: str, joints: list[str]) -> actionlib.SimpleActionServer:
        action = f"/{name}/follow_joint_trajectory"
        server = actionlib.SimpleActionServer(
            action, FollowJointTrajectoryAction, lambda goal: self._follow(name, goal), auto_start=False
        )
        server.joints = joints
        server.follow_name = name
        server.start()
        self.__dict__.setdefault("servers", {})[name] = server
        return server

    def _follow(self, name: str, goal) -> None:
        server = self.servers[name]
        trajectory = goal.trajectory
        begin = time.time()
        self.starts[name] = begin
        if name == self.refuse:
            result = FollowJointTrajectoryResult(error_code=-4, error_string="tolerance violated")
            server.set_aborted(result)
            return
        times = np.array([p.time_from_start.to_sec() for p in trajectory.points]) * self.slowdown
        values = np.array([p.positions for p in trajectory.points])
        while time.time() - begin < times[-1]:
            if server.is_preempt_requested():
                server.set_preempted()
                return
            self._set(trajectory.joint_names, times, values, time.time() - begin)
            time.sleep(0.01)
        self._set(trajectory.joint_names, times, values, times[-1])
        server.set_succeeded(FollowJointTrajectoryResult())

    def _set(self, names, times, values, t: float) -> None:
        now = [float(np.interp(t, times, column)) for column in values.T]
        with self._lock:
            self._positions.update(zip(names, now, strict=True))
