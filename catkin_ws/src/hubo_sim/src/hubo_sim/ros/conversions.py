"""ROS messages from and to plain data; pure, and the only place where it is done."""

from __future__ import annotations

import numpy as np
from control_msgs.msg import FollowJointTrajectoryGoal, JointTolerance, JointTrajectoryControllerState
from fv_msgs.msg import Contacts
from geometry_msgs.msg import Pose, TransformStamped, Vector3, WrenchStamped
from rospy import Duration, Time
from sensor_msgs.msg import CameraInfo, Imu, JointState, LaserScan
from std_msgs.msg import Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from fv_common.conversions import matrix_from_pose, transform_from_matrix
from hubo_sim.control.spline import JointSample
from hubo_sim.control.trajectory_goal import Code, Refusal, Tolerance, TrajectoryGoal, named_twice
from hubo_sim.sensors.render import Pinhole
from hubo_sim.simulator import ContactLog
from hubo_sim.worlds.world import FAR


def time_from_ns(ns: int) -> Time:
    """ROS time of whole nanoseconds."""
    return Time(ns // 1_000_000_000, ns % 1_000_000_000)


def header(stamp: Time, frame: str) -> Header:
    """A header without sequence number; rospy counts it."""
    return Header(stamp=stamp, frame_id=frame)


def laser_msg(
    ranges: np.ndarray, azimuths_rad: np.ndarray, limits_m: tuple[float, float], head: Header
) -> LaserScan:
    """Planar scan of ranges (N,) [m] at evenly spaced angles (N,); no return: inf, as REP 117 has it."""
    step = float(azimuths_rad[1] - azimuths_rad[0]) if len(azimuths_rad) > 1 else 0.0
    return LaserScan(
        header=head,
        angle_min=float(azimuths_rad[0]),
        angle_max=float(azimuths_rad[-1]),
        angle_increment=step,
        range_min=limits_m[0],
        range_max=limits_m[1],
        ranges=np.where(np.isnan(ranges), np.inf, ranges).tolist(),
    )


def imu_msg(angular: np.ndarray, force: np.ndarray, head: Header) -> Imu:
    """Angular velocity (3,) [rad/s] and specific force (3,) [m/s^2]; the orientation is not measured (REP 145)."""
    out = Imu(header=head, angular_velocity=Vector3(*angular), linear_acceleration=Vector3(*force))
    out.orientation_covariance[0] = -1.0
    return out


def wrench_msg(force: np.ndarray, torque: np.ndarray, head: Header) -> WrenchStamped:
    """Force (3,) [N] and torque (3,) [N m]."""
    out = WrenchStamped(header=head)
    out.wrench.force, out.wrench.torque = Vector3(*force), Vector3(*torque)
    return out


def camera_info_msg(camera: Pinhole, head: Header) -> CameraInfo:
    """Calibration of an undistorted pinhole."""
    fx, fy, cx, cy = camera.fx, camera.fy, camera.cx, camera.cy
    return CameraInfo(
        header=head,
        width=camera.width,
        height=camera.height,
        distortion_model="plumb_bob",
        D=[0.0] * 5,
        K=[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        R=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        P=[fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    )


def joint_state_msg(names: list[str], state: tuple[np.ndarray, ...], stamp: Time) -> JointState:
    """Positions, velocities and efforts, (J,) each."""
    position, velocity, effort = (values.tolist() for values in state)
    return JointState(header(stamp, ""), list(names), position, velocity, effort)


def transform_msg(T_parent_child: np.ndarray, parent: str, child: str, stamp: Time) -> TransformStamped:
    """A stamped transform of a (4, 4) matrix."""
    return TransformStamped(header(stamp, parent), child, transform_from_matrix(T_parent_child))


def place_from_pose(pose: Pose) -> np.ndarray:
    """(4, 4) matrix of a pose to put something at. Raises ValueError when it is no pose, or far off."""
    T = matrix_from_pose(pose)
    if not np.all(np.abs(T[:3, 3]) <= FAR):
        raise ValueError(f"pose: position {T[:3, 3].tolist()} must be within +-{FAR:g} m")
    return T


def contacts_msg(contacts: ContactLog, stamp: Time, frame: str) -> Contacts:
    """Contacts of the last step and their count so far."""
    return Contacts(header(stamp, frame), contacts.total, contacts.pairs, contacts.depths)


def goal_from_trajectory(msg: JointTrajectory) -> TrajectoryGoal:
    """A trajectory message as plain data."""
    return TrajectoryGoal(
        joint_names=list(msg.joint_names),
        times_s=[point.time_from_start.to_sec() for point in msg.points],
        positions=[list(point.positions) for point in msg.points],
        velocities=[list(point.velocities) for point in msg.points],
        accelerations=[list(point.accelerations) for point in msg.points],
        stamp_s=msg.header.stamp.to_sec(),
    )


def goal_from_action(msg: FollowJointTrajectoryGoal) -> TrajectoryGoal:
    """An action goal with its tolerances as plain data. Raises Refusal when these name a joint twice."""
    plain = goal_from_trajectory(msg.trajectory)
    return TrajectoryGoal(
        **{
            **vars(plain),
            "path_tolerance": _tolerances(msg.path_tolerance, "path_tolerance"),
            "goal_tolerance": _tolerances(msg.goal_tolerance, "goal_tolerance"),
            "goal_time_tolerance_s": msg.goal_time_tolerance.to_sec(),
        }
    )


def _tolerances(msgs: list[JointTolerance], kind: str) -> dict[str, Tolerance]:
    twice = named_twice([msg.name for msg in msgs])
    if twice:
        raise Refusal(Code.INVALID_JOINTS, f"{kind} names joint {', '.join(twice)} more than once")
    return {msg.name: Tolerance(msg.position, msg.velocity, msg.acceleration) for msg in msgs}


def point_msg(sample: JointSample, time_from_start_s: float = 0.0) -> JointTrajectoryPoint:
    """A trajectory point of a sample."""
    return JointTrajectoryPoint(
        positions=sample.position.tolist(),
        velocities=sample.velocity.tolist(),
        accelerations=sample.acceleration.tolist(),
        time_from_start=Duration.from_sec(time_from_start_s),
    )


def controller_state_msg(
    names: list[str], desired: JointSample, error: JointSample, stamp: Time
) -> JointTrajectoryControllerState:
    """What a controller wants, what it measures and how far they are apart (desired minus actual)."""
    actual = JointSample(
        desired.position - error.position, desired.velocity - error.velocity, np.zeros_like(error.position)
    )
    return JointTrajectoryControllerState(
        header(stamp, ""), list(names), point_msg(desired), point_msg(actual), point_msg(error)
    )
