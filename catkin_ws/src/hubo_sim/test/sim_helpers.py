"""What the tests that need ROS share."""

import threading
import time

import pytest
import rospy
from control_msgs.msg import FollowJointTrajectoryGoal
from geometry_msgs.msg import Pose
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from fv_common.cloud_layout import cloud_points

ARM = ["RSP", "RSR", "RSY", "REP", "RWY", "RWP"]
READY = [-0.6, -0.2, 0.0, -1.7, 0.0, 0.73]
INERTIAL = (
    '<inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'
)


def points_of(cloud):
    """(H, W, 3) points of an organised cloud; a warning fails."""
    return cloud_points(cloud, pytest.fail, (1e-6, 1e5)).reshape(cloud.height, cloud.width, 3)


def model(geometry):
    """A URDF of one link with a geometry that is seen and hit."""
    shape = f"<geometry>{geometry}</geometry>"
    return (
        f'<robot name="m"><link name="l">{INERTIAL}<visual>{shape}</visual>'
        f"<collision>{shape}</collision></link></robot>"
    )


BOX = model('<box size="0.2 0.2 0.2"/>')


def trajectory(positions, seconds, names=ARM):
    point = JointTrajectoryPoint(positions=list(positions), velocities=[0.0] * len(positions))
    point.time_from_start = rospy.Duration(seconds)
    return JointTrajectory(joint_names=list(names), points=[point])


def arm_goal(positions, seconds, names=ARM):
    return FollowJointTrajectoryGoal(trajectory=trajectory(positions, seconds, names))


def pose_at(x, y, z):
    pose = Pose()
    pose.position.x, pose.position.y, pose.position.z, pose.orientation.w = x, y, z, 1.0
    return pose


def call(name, kind, **fields):
    """A service of the simulator."""
    return rospy.ServiceProxy(f"/hubo_sim/{name}", kind)(**fields)


PATIENCE_S = 60.0  # of wall time, on a machine that is slow and shared; what is waited for comes much sooner


def wait_until(condition):
    """Whether the condition becomes true; waits on the wall clock, for ROS time may stand still."""
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.02)
    return True


def collect(topic, kind, count, timeout_s=PATIENCE_S):
    """The next `count` messages of a topic; fails when they do not come within timeout_s of wall time."""
    messages, done = [], threading.Event()

    def take(message):
        messages.append(message)
        if len(messages) >= count:
            done.set()

    subscriber = rospy.Subscriber(topic, kind, take, queue_size=1000)
    complete = done.wait(timeout_s)
    subscriber.unregister()
    assert complete, f"{len(messages)} of {count} messages on {topic} within {timeout_s} s"
    return messages[:count]
