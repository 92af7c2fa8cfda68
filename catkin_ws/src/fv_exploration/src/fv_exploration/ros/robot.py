"""The robot as the exploration sees it: topics, services and actions behind ``fv_exploration.robot.Robot``."""

from __future__ import annotations

import collections
import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol, TypeVar

import actionlib
import numpy as np
import rospy
import tf2_ros
from actionlib import CommState
from fv_msgs.msg import (
    ExecuteMotionAction,
    ExecuteMotionGoal,
    ExecuteMotionResult,
    PlanMotionAction,
    PlanMotionGoal,
    PlanMotionResult,
)
from fv_msgs.srv import TakeScan
from numpy.typing import NDArray
from sensor_msgs.msg import JointState, PointCloud2
from std_msgs.msg import Header

from fv_common.conversions import cloud_msg, matrix_from_transform, pose_array
from fv_common.errors import MessageError
from fv_common.transform_buffer import TransformBuffer
from fv_exploration.explore_config import ExploreConfig
from fv_exploration.robot import ExplorationError, Plan, PlanStatus, Scan, ScanError
from fv_exploration.ros.conversions import (
    points_from_cloud,
)
from fv_exploration.ros.joint_history import JointHistory

Array = NDArray[np.float64]
Found = TypeVar("Found")
POLL_S = 0.01
FAR_JOINTS_S = 0.5
"""Joints that were told so long before or after a scan are said to be guessed."""


class Body(Protocol):
    """Who knows the robot's own points; ``RobotBody`` does."""

    def is_robot(
        self, points: Array, T_map_sensor: Array, positions: Mapping[str, float]
    ) -> NDArray[np.bool_]:
        """(N,) which points (N, 3) of the sensor's frame are not to be mapped."""


class Nobody:
    """A body that is in no scan."""

    def is_robot(
        self, points: Array, T_map_sensor: Array, positions: Mapping[str, float]
    ) -> NDArray[np.bool_]:
        """See ``Body``."""
        return np.zeros(len(points), dtype=bool)


class RosRobot:
    """Scans through a cloud topic, plans and moves through the planning node's actions.

    Publishes ``/fv_exploration/removed`` for whoever listens: the points of each scan that are the robot's own.

    :param stop: asked while waiting; True ends the wait with ExplorationError.
    :param warn: told in one line what of its input is left out or guessed.
    """

    def __init__(
        self,
        config: ExploreConfig,
        map_frame: str,
        group: str,
        stop: Callable[[], bool],
        warn: Callable[[str], None],
    ) -> None:
        self._config = config
        self._map_frame = map_frame
        self._group = group
        self.body: Body = Nobody()  # whose points are left out of scans
        self._stop = stop
        self._warn = warn
        self._clouds: collections.deque[PointCloud2] = collections.deque(maxlen=4)
        self._joints = JointHistory()
        self._joint_names: list[str] = []  # of the robot; others on the topic are nothing to us
        self._no_transform = ""  # why the last one was not found
        self._tf_buffer = TransformBuffer(cache_time=rospy.Duration(600.0))
        self._tf_listener = tf2_ros.TransformListener(self._tf_buffer)
        self._removed_pub = rospy.Publisher("/fv_exploration/removed", PointCloud2, queue_size=1)
        self._planner = actionlib.ActionClient("/ompl_planner/plan", PlanMotionAction)
        self._executor = actionlib.ActionClient("/ompl_planner/execute", ExecuteMotionAction)
        self._joint_sub = rospy.Subscriber("/joint_states", JointState, self._on_joints, queue_size=50)
        self._cloud_sub = rospy.Subscriber(
            config.scan.cloud_topic, PointCloud2, self._clouds.append, queue_size=4
        )

    def now_s(self) -> float:
        """ROS time [s]."""
        return float(rospy.get_time())

    def wait_until_ready(self, timeout_s: float = 60.0) -> None:
        """Wait for time, joint states and the planning node; ExplorationError names what is missing."""
        self._wait(
            lambda: rospy.get_time() > 0,
            lambda: "time on /clock: /use_sim_time is true and nobody sends it",
            timeout_s,
        )
        self._wait(
            lambda: self._joints.newest_s() > 0,
            lambda: f"joint states: {self._silence('/joint_states', self._joint_sub)}",
            timeout_s,
        )
        self._wait_for_action(self._planner, "/ompl_planner/plan", timeout_s)
        self._wait_for_action(self._executor, "/ompl_planner/execute", timeout_s)

    def _wait_for_action(self, client: actionlib.ActionClient, name: str, timeout_s: float) -> None:
        self._wait(
            lambda: bool(client.wait_for_server(rospy.Duration(0.05))),
            lambda: f"the action {name}: nobody serves it; start rosrun ompl_planner planner_node",
            timeout_s,
        )

    def require_joints(self, names: Sequence[str]) -> None:
        """Wait until something has been heard of all joints of the robot; ExplorationError names those missing."""
        self._joint_names = list(names)
        self._wait(
            lambda: not self._joints.missing(names),
            lambda: (
                f"positions on /joint_states of {', '.join(self._joints.missing(names))}: nobody sends them, and "
                "every movable joint of the robot is needed"
            ),
            self._config.scan.timeout_s,
        )

    def joint_positions(self) -> dict[str, float]:
        """The newest position of every joint [rad or m]."""
        return self._joints.newest()

    def pose_of(self, frame: str, stamp: rospy.Time | None = None) -> Array:
        """(4, 4) pose of a frame in the map frame, at a stamp or the newest; never extrapolated."""
        time_wanted = stamp or rospy.Time(0)
        return self._wait(
            lambda: self._lookup(frame, time_wanted),
            lambda: f"a transform from '{frame}' to the map frame '{self._map_frame}': {self._no_transform}",
            self._config.scan.timeout_s,
        )

    def scan(self) -> Scan:
        """The first usable cloud taken at rest, with the robot's own points removed; ScanError when there is none."""
        try:
            cloud = self._triggered_cloud() if self._config.scan.trigger_service else self._cloud_at_rest()
            T_map_sensor = self.pose_of(cloud.header.frame_id, cloud.header.stamp)
            points = points_from_cloud(cloud, self._warn).astype(float)
        except (ExplorationError, MessageError) as error:
            raise ScanError(str(error)) from error
        joints = self._joints_at(cloud.header.stamp)
        own = self.body.is_robot(points, T_map_sensor, joints)
        self._publish_removed(points[own], T_map_sensor, cloud.header.stamp)
        return Scan(points[~own], T_map_sensor, joints)

    def plan(self, poses: Array, scores: Array, map_sequence: int, seed: int) -> Plan:
        """Ask the planning node for a motion to the best of these camera poses."""
        settings = self._config.motion
        goal = PlanMotionGoal(
            group=self._group,
            goal_type=PlanMotionGoal.GOAL_POSES,
            goal_poses=pose_array(poses, Header(frame_id=self._map_frame)),
            goal_scores=list(map(float, scores)),
            position_tolerance=settings.position_tolerance_m,
            angle_tolerance=math.radians(settings.angle_tolerance_deg),
            free_roll=True,
            planner=settings.planner,
            time_budget=settings.plan_budget_s,
            seed=seed % 2**32,
            unknown_space=PlanMotionGoal.UNKNOWN_IS_OBSTACLE,
            min_map_sequence=map_sequence,
        )
        result: PlanMotionResult = self._call(self._planner, goal)
        dropped = result.status == PlanMotionResult.NO_RESULT  # by actionlib, when it was cancelled early
        status = PlanStatus.CANCELLED if dropped else PlanStatus(result.status)
        if status is not PlanStatus.SUCCESS:
            return Plan(status, result.message or f"status {result.status}")
        if result.map_sequence < map_sequence:
            text = f"the plan is for map {result.map_sequence}, the map is {map_sequence} by now"
            return Plan(PlanStatus.MAP_TOO_OLD, text)
        motion = result.trajectory
        ends = dict(zip(motion.joint_names, motion.points[-1].positions, strict=True))
        return Plan(
            status,
            result.message,
            result.goal_index,
            result.plan,
            result.duration,
            result.path_length,
            ends,
        )

    def execute(self, plan: Plan) -> str:
        """Execute the plan; the text says why it was not finished, empty when it was."""
        result: ExecuteMotionResult = self._call(self._executor, ExecuteMotionGoal(plan=plan.motion))
        if result.status == ExecuteMotionResult.SUCCESS:
            return ""
        return result.message or f"status {result.status}"

    def _on_joints(self, message: JointState) -> None:
        problem = self._joints.add(
            message.header.stamp.to_sec(), message.name, message.position, message.velocity
        )
        if problem:
            self._warn(f"/joint_states: {problem}")

    def _publish_removed(self, points: Array, T_map_sensor: Array, stamp: rospy.Time) -> None:
        if self._removed_pub.get_num_connections() == 0:
            return
        points_map = points @ T_map_sensor[:3, :3].T + T_map_sensor[:3, 3]
        self._removed_pub.publish(cloud_msg(points_map, Header(frame_id=self._map_frame, stamp=stamp)))

    def _call(self, client: actionlib.ActionClient, goal: Any) -> Any:
        """Send a goal and wait for its result; a stop cancels it.

        Polls the goal's handle: SimpleActionClient loses the transitions of an answer that comes before its
        ``send_goal`` has returned, and its ``wait_for_result`` waits in ROS time, which may stand still.
        """
        handle = client.send_goal(goal)
        cancelled = False
        # A cancel that crosses the answer takes the handle back out of DONE: the result itself tells.
        while handle.get_result() is None and handle.get_comm_state() not in (CommState.DONE, CommState.LOST):
            if rospy.is_shutdown() or client.pub_goal.get_num_connections() == 0:
                raise ExplorationError(f"{client.ns} went away")
            if self._stop() and not cancelled:
                handle.cancel()
                cancelled = True
            time.sleep(POLL_S)
        result = handle.get_result()
        if result is None:
            raise ExplorationError(f"{client.ns} did not answer: {handle.get_goal_status_text()}")
        if result.status == result.NO_RESULT and not cancelled:  # as actionlib gives for a goal it dropped
            raise ExplorationError(f"{client.ns} dropped the goal: {handle.get_goal_status_text()}")
        return result

    def _triggered_cloud(self) -> PointCloud2:
        service = self._config.scan.trigger_service
        try:
            rospy.wait_for_service(service, timeout=self._config.scan.timeout_s)
            answer = rospy.ServiceProxy(service, TakeScan)()
        except (rospy.ROSException, rospy.ServiceException) as error:
            raise ExplorationError(f"no scan from {service}: {error}") from error
        if not answer.success:
            raise ExplorationError(f"no scan from {service}: {answer.message}")
        taken_s = answer.stamp.to_sec()
        return self._wait(
            lambda: self._first_cloud(lambda stamp_s: stamp_s == taken_s),
            lambda: f"the cloud of {taken_s:.3f} s: {self._no_cloud()}",
            self._config.scan.timeout_s,
        )

    def _cloud_at_rest(self) -> PointCloud2:
        settings = self._config.scan
        rested_s = self._wait(
            self._resting_since_s,
            lambda: (
                f"the robot's joints to come to rest: {self._unrest()} (at rest: at most "
                f"{settings.rest_speed_rad_s:g} a second for {settings.rest_s:g} s)"
            ),
            settings.timeout_s,
        )
        return self._wait(
            lambda: self._first_cloud(lambda stamp_s: stamp_s >= rested_s),
            lambda: f"a cloud taken at rest, after {rested_s:.3f} s: {self._no_cloud()}",
            settings.timeout_s,
        )

    def _unrest(self) -> str:
        settings = self._config.scan
        return self._joints.unrest(self._joint_names, settings.rest_s, settings.rest_speed_rad_s)

    def _resting_since_s(self) -> float | None:
        """Stamp up to which the joints are known to have been at rest for long enough, None while they are not."""
        return None if self._unrest() else self._joints.newest_s()

    def _no_cloud(self) -> str:
        """Why there is no cloud, as far as can be seen from here."""
        topic = self._config.scan.cloud_topic
        newest = max((cloud.header.stamp.to_sec() for cloud in list(self._clouds)), default=None)
        if newest is not None:
            return f"the newest on {topic} is of {newest:.3f} s; is it stamped by another clock?"
        return self._silence(topic, self._cloud_sub)

    @staticmethod
    def _silence(topic: str, subscriber: rospy.Subscriber) -> str:
        """What can be said of a topic on which nothing has come."""
        if subscriber.get_num_connections() == 0:
            return f"nobody publishes {topic}"
        return f"{topic} has a publisher, but it has sent nothing"

    def _first_cloud(self, wanted: Callable[[float], bool]) -> PointCloud2 | None:
        return next((cloud for cloud in list(self._clouds) if wanted(cloud.header.stamp.to_sec())), None)

    def _joints_at(self, stamp: rospy.Time) -> dict[str, float]:
        """Joint positions of the message that is nearest in time, for each joint."""
        positions, gap_s = self._joints.at(stamp.to_sec())
        if gap_s > FAR_JOINTS_S:
            self._warn(f"positions of joints are {gap_s:.2f} s away from the scan that they are taken for")
        return positions

    def _lookup(self, frame: str, stamp: rospy.Time) -> Array | None:
        try:
            found = self._tf_buffer.lookup_transform(self._map_frame, frame.lstrip("/"), stamp)
        except tf2_ros.TransformException as error:
            self._no_transform = str(error)
            return None
        return matrix_from_transform(found.transform)

    def _wait(
        self, condition: Callable[[], Found | None], what: Callable[[], str], timeout_s: float
    ) -> Found:
        """Poll until the condition gives something; ``what`` says what is waited for and why it has not come.

        The limit is in wall time on purpose: simulated time may run fast, stand still or jump back.
        """
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline and not rospy.is_shutdown():
            found = condition()
            if found is not None and found is not False:
                return found
            if self._stop():
                raise ExplorationError(f"stopped while waiting for {what()}")
            time.sleep(POLL_S)
        raise ExplorationError(f"waited {timeout_s:.0f} s for {what()}")
