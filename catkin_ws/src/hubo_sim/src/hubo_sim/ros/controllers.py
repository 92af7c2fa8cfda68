"""A trajectory controller's ROS side: action, `command`, `state`, `query_state`, as ros_control has them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import rospy
from actionlib import ActionServer
from control_msgs.msg import (
    FollowJointTrajectoryAction,
    FollowJointTrajectoryFeedback,
    FollowJointTrajectoryResult,
    JointTrajectoryControllerState,
)
from control_msgs.srv import QueryTrajectoryState, QueryTrajectoryStateResponse
from trajectory_msgs.msg import JointTrajectory

from hubo_sim.control.trajectory_controller import Outcome, TrajectoryController
from hubo_sim.control.trajectory_goal import Code, Refusal, TrajectoryGoal
from hubo_sim.ros.conversions import controller_state_msg, goal_from_action, goal_from_trajectory, header

# How long the action server lists goals that have ended. actionlib's 5 s may pass within half a second of wall time
# when the simulation runs as fast as it goes: a client that is slower would think its goal lost.
_STATUS_KEPT_S = 60.0


class RosController:
    """Takes goals for one controller and tells how they end. All but the ROS callbacks run in the simulator's thread.

    run_in_sim(function) queues a function for that thread; ask_sim(function) waits for its value.
    """

    def __init__(
        self,
        name: str,
        controller: TrajectoryController,
        run_in_sim: Callable,
        ask_sim: Callable,
        now_s: Callable,
    ) -> None:
        self.name = name
        self.controller = controller
        self._ask_sim, self._run_in_sim, self._now_s = ask_sim, run_in_sim, now_s
        self.pending: tuple[TrajectoryGoal, object] | None = None  # accepted, not started
        self.accepts = True  # False while the simulator is paused
        self.on_accepted: Callable[[], None] = lambda: None
        self._state_due_s = self._feedback_due_s = 0.0
        self._limits_told = 0
        self._state_pub = rospy.Publisher(f"/{name}/state", JointTrajectoryControllerState, queue_size=5)
        self._action = ActionServer(
            f"/{name}/follow_joint_trajectory",
            FollowJointTrajectoryAction,
            goal_cb=lambda gh: run_in_sim(lambda: self._on_goal(gh)),
            cancel_cb=lambda gh: run_in_sim(lambda: self._on_cancel(gh)),
            auto_start=False,
        )

    def open(self) -> None:
        """Begin to listen."""
        self._action.start()
        self._action.status_list_timeout = rospy.Duration(_STATUS_KEPT_S)
        rospy.Service(f"/{self.name}/query_state", QueryTrajectoryState, self._on_query)
        rospy.Subscriber(f"/{self.name}/command", JointTrajectory, self._on_command, queue_size=10)

    def begin_pending(self) -> None:
        """Start what was accepted."""
        if self.pending is not None:
            (goal, handle), self.pending = self.pending, None
            self.controller.start(goal, self._now_s(), handle)

    def publish_due(self, stamp: rospy.Time) -> None:
        """Tell how goals ended, and publish state and feedback at their rates."""
        for outcome in self.controller.ended():
            _tell(outcome)
        self._tell_limits()
        now, config = stamp.to_sec(), self.controller.config
        if now < min(self._state_due_s, self._feedback_due_s):
            return
        state = controller_state_msg(
            self.controller.names, self.controller.desired, self.controller.error, stamp
        )
        if now >= self._state_due_s:
            self._state_due_s = max(self._state_due_s + 1.0 / config.state_publish_rate, now)
            self._state_pub.publish(state)
        if now >= self._feedback_due_s:
            self._feedback_due_s = max(self._feedback_due_s + 1.0 / config.action_monitor_rate, now)
            if self.controller.active is not None:
                self.controller.active.handle.publish_feedback(_feedback(state))

    def _tell_limits(self) -> None:
        """Warn once for each trajectory and limit that holds it back."""
        held_back = self.controller.held_back
        if len(held_back) > self._limits_told:
            rospy.logwarn("/%s is held back by: %s", self.name, ", ".join(held_back))
        self._limits_told = len(held_back)

    def _on_goal(self, handle) -> None:
        try:
            if not self.accepts:
                raise Refusal(Code.INVALID_GOAL, "the simulator is paused: the controller does not run")
            goal = goal_from_action(handle.get_goal())
            self.controller.check(goal, self._now_s())
        except Refusal as err:
            result = FollowJointTrajectoryResult(error_code=err.code, error_string=str(err))
            handle.set_rejected(result, str(err))
            return
        handle.set_accepted()
        self.drop_pending("replaced by a newer trajectory")
        self.pending = (goal, handle)
        self.on_accepted()

    def _on_cancel(self, handle) -> None:
        if self.pending is not None and self.pending[1] == handle:
            self.drop_pending("cancelled")
        else:
            self.controller.cancel(self._now_s(), handle)

    def _on_command(self, msg: JointTrajectory) -> None:
        self._run_in_sim(lambda: self._take_command(msg))

    def _take_command(self, msg: JointTrajectory) -> None:
        goal = goal_from_trajectory(msg)
        try:
            if not self.accepts:
                raise Refusal(Code.INVALID_GOAL, "the simulator is paused: the controller does not run")
            self.controller.check(goal, self._now_s())
        except Refusal as err:
            rospy.logwarn("/%s/command refused: %s", self.name, err)
            return
        self.drop_pending("replaced by a newer trajectory")
        self.pending = (goal, None)
        self.on_accepted()

    def drop_pending(self, text: str) -> None:
        """Forget what was accepted but not started, and say so."""
        if self.pending is not None and self.pending[1] is not None:
            _tell(Outcome(self.pending[1], "canceled", Code.SUCCESSFUL, text))
        self.pending = None

    def _on_query(self, request) -> QueryTrajectoryStateResponse:
        sample = self._ask_sim(lambda: self.controller.sample(request.time.to_sec()))
        values = [np.asarray(v).tolist() for v in (sample.position, sample.velocity, sample.acceleration)]
        return QueryTrajectoryStateResponse(self.controller.names, *values)


def _feedback(state: JointTrajectoryControllerState) -> FollowJointTrajectoryFeedback:
    return FollowJointTrajectoryFeedback(
        header(state.header.stamp, ""), state.joint_names, state.desired, state.actual, state.error
    )


def _tell(outcome: Outcome) -> None:
    """Send a goal's result."""
    result = FollowJointTrajectoryResult(error_code=outcome.code, error_string=outcome.text)
    send = {
        "succeeded": outcome.handle.set_succeeded,
        "aborted": outcome.handle.set_aborted,
        "canceled": outcome.handle.set_canceled,
    }
    send[outcome.status](result, outcome.text)
