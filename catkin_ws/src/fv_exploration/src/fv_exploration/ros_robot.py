"""The robot as the exploration sees it: topics, services and actions behind ``exploration.Robot``."""

from __future__ import annotations

import collections
import math
import time
from collections.abc import Callable
from typing import Any

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
from numpy.typing import NDArray
from sensor_msgs.msg import JointState, PointCloud2
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from fv_exploration.conversions import (
    MessageError,
    cloud_msg,
    matrix_from_transform,
    points_from_cloud,
    pose_array,
)
from fv_exploration.exploration import ExplorationError, Plan, Scan, ScanError
from fv_exploration.explore_config import ExploreConfig

Array = NDArray[np.float64]
POLL_S = 0.01


class RosRobot:
    """Scans through a cloud topic, plans and moves through the planning node's actions.

    Publishes ``/fv_exploration/removed`` for whoever listens: the points of each scan that are the robot's own.

    :param is_robot: ``(points (N, 3), T_map_sensor (4, 4), joint positions by name) -> (N,)`` bool: the robot's own
        points, not to be mapped.
    :param stop: asked while waiting; True ends the wait with ExplorationError.
    """

    def __init__(
        self,
        config: ExploreConfig,
        map_frame: str,
        group: str,
        is_robot: Callable[[Array, Array, dict[str, float]], NDArray[np.bool_]],
        stop: Callable[[], bool],
    ) -> None:
        self._config = config
        self._map_frame = map_frame
        self._group = group
        self._is_robot = is_robot
        self._stop = stop
        self._clouds: collections.deque[PointCloud2] = collections.deque(maxlen=4)
        self._joints: collections.deque[JointState] = collections.deque(maxlen=400)
        self._tf_buffer = tf2_ros.Buffer(cache_time=rospy.Duration(600.0))
        self._tf_listener = tf2_ros.TransformListener(self._tf_buffer)
        self._removed_pub = rospy.Publisher("/fv_exploration/removed", PointCloud2, queue_size=1)
        self._planner = actionlib.ActionClient("/ompl_planner/plan", PlanMotionAction)
        self._executor = actionlib.ActionClient("/ompl_planner/execute", ExecuteMotionAction)
        self._joint_sub = rospy.Subscriber("/joint_states", JointState, self._joints.append, queue_size=50)
        self._cloud_sub = rospy.Subscriber(
            config.scan.cloud_topic, PointCloud2, self._clouds.append, queue_size=4
        )

    def now_s(self) -> float:
        """ROS time [s]."""
        return rospy.get_time()

    def wait_until_ready(self, timeout_s: float = 60.0) -> None:
        """Wait for joint states and the planning node; ExplorationError names what is missing."""
        self._wait(lambda: len(self._joints) > 0, "joint states on /joint_states", timeout_s)
        for client, name in (
            (self._planner, "/ompl_planner/plan"),
            (self._executor, "/ompl_planner/execute"),
        ):
            self._wait(
                lambda c=client: c.wait_for_server(rospy.Duration(0.05)), f"the action {name}", timeout_s
            )

    def joint_positions(self) -> dict[str, float]:
        """The newest position of every joint [rad or m]."""
        positions: dict[str, float] = {}
        for message in list(self._joints)[-50:]:
            positions.update(zip(message.name, message.position, strict=False))
        return positions

    def pose_of(self, frame: str, stamp: rospy.Time | None = None) -> Array:
        """(4, 4) pose of a frame in the map frame, at a stamp or the newest."""
        time_wanted = stamp or rospy.Time(0)
        return self._wait(
            lambda: self._lookup(frame, time_wanted),
            f"a transform from {frame} to {self._map_frame}",
            self._config.scan.timeout_s,
        )

    def scan(self) -> Scan:
        """The first usable cloud taken at rest, with the robot's own points removed; ScanError when there is none."""
        try:
            cloud = self._triggered_cloud() if self._config.scan.trigger_service else self._cloud_at_rest()
            T_map_sensor = self.pose_of(cloud.header.frame_id, cloud.header.stamp)
            points = points_from_cloud(cloud).astype(float)
        except (ExplorationError, MessageError) as error:
            raise ScanError(str(error)) from error
        joints = self._joints_at(cloud.header.stamp)
        own = self._is_robot(points, T_map_sensor, joints)
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
        if result.status == PlanMotionResult.SUCCESS and result.map_sequence < map_sequence:
            return Plan(
                None, -1, f"the plan is for map {result.map_sequence}, the map is {map_sequence} by now"
            )
        if result.status != PlanMotionResult.SUCCESS:
            return Plan(None, -1, result.message)
        motion = result.trajectory
        ends = dict(zip(motion.joint_names, motion.points[-1].positions, strict=True))
        return Plan(result, result.goal_index, result.message, result.duration, result.path_length, ends)

    def execute(self, plan: Plan) -> str:
        """Execute the plan; the text says why it was not finished, empty when it was."""
        planned: PlanMotionResult = plan.trajectory
        goal = ExecuteMotionGoal(planned.trajectory, planned.map_sequence)
        result: ExecuteMotionResult = self._call(self._executor, goal)
        return (
            ""
            if result.status == ExecuteMotionResult.SUCCESS
            else (result.message or f"status {result.status}")
        )

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
            answer = rospy.ServiceProxy(service, Trigger)()
        except (rospy.ROSException, rospy.ServiceException) as error:
            raise ExplorationError(f"no scan from {service}: {error}") from error
        if not answer.success:
            raise ExplorationError(f"no scan from {service}: {answer.message}")
        taken_s = float(answer.message)
        return self._wait(
            lambda: self._first_cloud(lambda stamp_s: abs(stamp_s - taken_s) < 1e-4),
            f"the cloud of {taken_s:.3f} s on {self._config.scan.cloud_topic}",
            self._config.scan.timeout_s,
        )

    def _cloud_at_rest(self) -> PointCloud2:
        timeout_s = self._config.scan.timeout_s
        rested_s = self._wait(self._resting_since_s, "the robot's joints to come to rest", timeout_s)
        return self._wait(
            lambda: self._first_cloud(lambda stamp_s: stamp_s >= rested_s),
            f"a cloud on {self._config.scan.cloud_topic} that was taken at rest",
            timeout_s,
        )

    def _resting_since_s(self) -> float | None:
        """Stamp at which the joints have been slow for long enough, None while they have not."""
        recent = list(self._joints)
        if (
            not recent
            or recent[-1].header.stamp.to_sec() - recent[0].header.stamp.to_sec() < self._config.scan.rest_s
        ):
            return None
        end_s = recent[-1].header.stamp.to_sec()
        window = [m for m in recent if end_s - m.header.stamp.to_sec() <= self._config.scan.rest_s]
        speeds = [abs(speed) for message in window for speed in message.velocity]
        return end_s if max(speeds, default=0.0) <= self._config.scan.rest_speed_rad_s else None

    def _first_cloud(self, wanted: Callable[[float], bool]) -> PointCloud2 | None:
        return next((cloud for cloud in list(self._clouds) if wanted(cloud.header.stamp.to_sec())), None)

    def _joints_at(self, stamp: rospy.Time) -> dict[str, float]:
        """Joint positions of the message that is nearest in time, for each joint."""
        positions: dict[str, float] = {}
        by_distance = sorted(self._joints, key=lambda m: -abs((m.header.stamp - stamp).to_sec()))
        for message in by_distance:
            positions.update(zip(message.name, message.position, strict=False))
        return positions

    def _lookup(self, frame: str, stamp: rospy.Time) -> Array | None:
        try:
            return matrix_from_transform(
                self._tf_buffer.lookup_transform(self._map_frame, frame, stamp).transform
            )
        except tf2_ros.TransformException:
            return None

    def _wait(self, condition: Callable[[], Any], what: str, timeout_s: float) -> Any:
        """Poll until the condition gives something.

        The limit is in wall time on purpose: simulated time may run fast, stand still or jump back.
        """
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline and not rospy.is_shutdown():
            found = condition()
            if found is not None and found is not False:
                return found
            if self._stop():
                raise ExplorationError(f"stopped while waiting for {what}")
            time.sleep(POLL_S)
        raise ExplorationError(f"waited {timeout_s:.0f} s for {what}")
