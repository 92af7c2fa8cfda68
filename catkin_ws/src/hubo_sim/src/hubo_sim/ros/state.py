"""What the node tells of itself as time goes on: the clock, the joints, contacts, and where the robot's base is."""

from __future__ import annotations

import rospy
from fv_msgs.msg import Contacts
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage

from hubo_sim.config import SimConfig
from hubo_sim.ros.conversions import contacts_msg, joint_state_msg, time_from_ns, transform_msg
from hubo_sim.simulator import Simulator

_CONTACT_PERIOD_NS = 50_000_000  # at most this often while the same contact lasts


class StatePublishers:
    """Publishes a simulator's state at its rates, in simulated time; no moment is told twice."""

    def __init__(self, sim: Simulator, config: SimConfig) -> None:
        self._sim, self._config = sim, config
        self._clock_due = self._joints_due = self._contacts_due = 0
        self._last_clock_ns = self._last_joints_ns = -1
        self._last_pairs: list[str] | None = None
        self._clock_pub = rospy.Publisher("/clock", Clock, queue_size=10)
        self._joints_pub = rospy.Publisher("/joint_states", JointState, queue_size=50)
        self._contacts_pub = rospy.Publisher("/hubo_sim/contacts", Contacts, queue_size=50, latch=True)
        self._tf_pub = rospy.Publisher("/tf_static", TFMessage, queue_size=5, latch=True)

    @property
    def next_joints_ns(self) -> int:
        """From when on robot_state_publisher takes joint states: it ignores those that come sooner."""
        return self._last_joints_ns + round(1e9 / self._config.joint_state_rate_hz)

    def publish_base_transform(self) -> None:
        """Tie the robot's base link to the world, unless it is the world's own frame (see Simulator)."""
        base = self._sim.spec.base_link
        if base == self._config.world_frame:
            return
        pose = self._sim.robot.link_pose(base)
        msg = transform_msg(pose, self._config.world_frame, base, time_from_ns(self._sim.clock_ns))
        self._tf_pub.publish(TFMessage([msg]))

    def publish_now(self) -> rospy.Time:
        """Clock and joint states of this moment; its stamp."""
        stamp = time_from_ns(self._sim.clock_ns)
        self._publish_clock(stamp)
        self._publish_joints(stamp)
        return stamp

    def publish_due(self) -> None:
        """Clock, joint states and contacts as far as they are due."""
        now = self._sim.clock_ns
        stamp = time_from_ns(now)
        if now >= self._clock_due:
            self._publish_clock(stamp)
            self._clock_due = _next_due(self._clock_due, now, self._config.clock_rate_hz)
        if now >= self._joints_due:
            self._publish_joints(stamp)
        contacts = self._sim.contacts
        if contacts.pairs != self._last_pairs or (contacts.pairs and now >= self._contacts_due):
            self._contacts_pub.publish(contacts_msg(contacts, stamp, self._config.world_frame))
            self._last_pairs, self._contacts_due = list(contacts.pairs), now + _CONTACT_PERIOD_NS

    def _publish_clock(self, stamp: rospy.Time) -> None:
        if self._sim.clock_ns > self._last_clock_ns:
            self._clock_pub.publish(Clock(stamp))
            self._last_clock_ns = self._sim.clock_ns

    def _publish_joints(self, stamp: rospy.Time) -> None:
        now = self._sim.clock_ns
        if now == self._last_joints_ns:
            return
        self._joints_pub.publish(joint_state_msg(self._sim.robot.joint_names, self._sim.robot.state(), stamp))
        self._last_joints_ns = now
        if now >= self._joints_due:  # else it came in between, for a scan
            self._joints_due = _next_due(self._joints_due, now, self._config.joint_state_rate_hz)


def _next_due(due_ns: int, now_ns: int, rate_hz: float) -> int:
    """When to publish next so that the rate holds on average, without catching up after a gap."""
    return max(due_ns + round(1e9 / rate_hz), now_ns)
