"""The simulator's node and a client in one process with a ROS master of its own; sim.py starts it.

usage: python3 -m fv_bench.simulation.session office RUNS | goals COUNT      prints its measurements as one line of JSON
"""

from __future__ import annotations

import dataclasses
import json
import os
import queue
import sys
import threading
import time
from collections.abc import Callable

import actionlib
import numpy as np
import rospy
from actionlib_msgs.msg import GoalStatus
from control_msgs.msg import (
    FollowJointTrajectoryAction,
    FollowJointTrajectoryGoal,
    FollowJointTrajectoryResult,
    JointTolerance,
)
from trajectory_msgs.msg import JointTrajectoryPoint

from fv_common.ros_session import RosSession
from hubo_description import load_robot
from hubo_description.upload import upload
from hubo_sim.config import SimConfig
from hubo_sim.ros.cameras import RosCamera
from hubo_sim.ros.node import SimNode
from hubo_sim.ros.params import robot_spec
from hubo_sim.sensors.depth_camera import DepthCamera
from hubo_sim.simulator import Simulator
from hubo_sim.worlds import load_world

ARM = "huboplus/right_hand_controller"
RESULT = FollowJointTrajectoryResult


class Watched(Simulator):
    """Counts steps in which a set-point or a measured joint of the arm is beyond a limit.

    Set-points count exactly; measured joints by more than the tracking bar allows (0.01 rad) or 5 % of the velocity.
    """

    def __init__(self, *args) -> None:
        super().__init__(*args)
        arm = self.controllers[ARM]
        self._arm, self._arm_rows = arm, self.robot.joint_rows(arm.names)
        self._low, self._high, self._speed = (
            np.array([getattr(joint, name) for joint in arm.joints])
            for name in ("lower", "upper", "max_velocity")
        )
        self._last = arm.set_point.position
        self.beyond_set_points = self.beyond_measured = 0

    def step(self) -> None:
        """One physics step and a look at the limits."""
        super().step()
        point, reach = self._arm.set_point.position, self._speed * self.scene.step_s + 1e-9
        wrong = (point < self._low) | (point > self._high) | (np.abs(point - self._last) > reach)
        self._last = point
        self.beyond_set_points += bool(wrong.any())
        position, velocity, _ = (values[self._arm_rows] for values in self.robot.state())
        wrong = (position < self._low - 0.01) | (position > self._high + 0.01)
        self.beyond_measured += bool((wrong | (np.abs(velocity) > 1.05 * self._speed)).any())


@dataclasses.dataclass
class Sent:
    """A goal on its way; who drops `handle` hears nothing more of it."""

    handle: actionlib.ClientGoalHandle
    done: queue.Queue

    def end(self) -> tuple[int, int, str]:
        """Status, result code and text once it is done; a status of -1 when it does not end within a minute."""
        try:
            handle = self.done.get(timeout=60.0)
        except queue.Empty:
            return -1, 0, ""
        result = handle.get_result() or RESULT(0, "there is no result")  # a goal that was lost
        return handle.get_goal_status(), result.error_code, result.error_string


class Client:
    """Sends the arm's goals and waits in simulated time."""

    def __init__(self, sim: Simulator) -> None:
        self.sim, self.arm = sim, sim.controllers[ARM]
        self._actions = actionlib.ActionClient(f"/{ARM}/follow_joint_trajectory", FollowJointTrajectoryAction)
        assert self._actions.wait_for_server(rospy.Duration(60)), "no action server"

    def goal(self, positions: np.ndarray, seconds: float, **changes) -> FollowJointTrajectoryGoal:
        """To positions (J,) within seconds, cubic; `changes` are fields of the goal or of its trajectory."""
        goal, point = FollowJointTrajectoryGoal(), JointTrajectoryPoint()
        point.positions, point.velocities = list(positions), [0.0] * len(positions)
        point.time_from_start = rospy.Duration(seconds)
        goal.trajectory.joint_names, goal.trajectory.points = list(self.arm.names), [point]
        for name, value in changes.items():
            setattr(goal if hasattr(goal, name) else goal.trajectory, name, value)
        return goal

    def send(self, goal: FollowJointTrajectoryGoal) -> Sent:
        """Send a goal."""
        done: queue.Queue = queue.Queue()

        def on_transition(handle) -> None:
            if handle.get_comm_state() == actionlib.CommState.DONE:
                done.put(handle)

        return Sent(self._actions.send_goal(goal, transition_cb=on_transition), done)

    def wait(self, seconds: float) -> None:
        """Let simulated time pass."""
        end = self.sim.now_s + seconds
        while self.sim.now_s < end:
            time.sleep(0.0005)


def random_goal(client: Client, kind: str, rng: np.random.Generator) -> str:
    """Send one goal of a kind (see KINDS); how it ended if that is not as it must, else empty."""
    low = np.maximum([joint.lower for joint in client.arm.joints], -1.5)
    high = np.minimum([joint.upper for joint in client.arm.joints], 1.5)
    here = client.arm.set_point.position
    target = np.clip(here + rng.uniform(-0.5, 0.5, len(here)), low, high)
    speed = np.array([joint.max_velocity for joint in client.arm.joints])
    seconds = float(np.max(1.6 * np.abs(target - here) / speed)) + 0.1
    change, status, code = KINDS[kind](client, seconds)
    sent = [client.send(client.goal(target, seconds, **change))]
    if kind in ("cancelled", "replaced"):
        # actionlib's client takes a goal for lost that it cancels before it has heard of its acceptance.
        while sent[0].handle.get_comm_state() == actionlib.CommState.WAITING_FOR_GOAL_ACK:
            time.sleep(0.0005)
        client.wait(0.3 * seconds)
    if kind == "cancelled":
        sent[0].handle.cancel()
    wanted = [(status, code)]
    if kind == "replaced":
        sent.append(client.send(client.goal(here, seconds + 0.5)))
        wanted.append((GoalStatus.SUCCEEDED, RESULT.SUCCESSFUL))
    ends = [goal.end() for goal in sent]
    return "" if [end[:2] for end in ends] == wanted else f"{kind}: {ends} instead of {wanted}"


def _tight(client: Client, where: str, **more) -> dict:
    return {where: [JointTolerance(name, 1e-9, 0.0, 0.0) for name in client.arm.names]} | more


def _points_twice(client: Client, seconds: float) -> dict:
    return {"points": client.goal(client.arm.set_point.position, seconds).trajectory.points * 2}


_REJECTED, _ABORTED, _PREEMPTED = GoalStatus.REJECTED, GoalStatus.ABORTED, GoalStatus.PREEMPTED
# What each kind changes in a goal, and the status and code with which it must end.
KINDS: dict[str, Callable] = {
    "valid": lambda c, t: ({}, GoalStatus.SUCCEEDED, RESULT.SUCCESSFUL),
    "stop": lambda c, t: ({"points": []}, GoalStatus.SUCCEEDED, RESULT.SUCCESSFUL),
    "cancelled": lambda c, t: ({}, _PREEMPTED, RESULT.SUCCESSFUL),
    "replaced": lambda c, t: ({}, _PREEMPTED, RESULT.SUCCESSFUL),
    "names": lambda c, t: ({"joint_names": [*c.arm.names[:5], "NOPE"]}, _REJECTED, RESULT.INVALID_JOINTS),
    "missing": lambda c, t: ({"joint_names": c.arm.names[:5]}, _REJECTED, RESULT.INVALID_JOINTS),
    "nan": lambda c, t: ({"points": c.goal([np.nan] * 6, t).trajectory.points}, _REJECTED, RESULT.INVALID_GOAL),
    "limits": lambda c, t: ({"points": c.goal([9.0] * 6, t).trajectory.points}, _REJECTED, RESULT.INVALID_GOAL),
    "sizes": lambda c, t: ({"points": c.goal([0.0] * 5, t).trajectory.points}, _REJECTED, RESULT.INVALID_GOAL),
    "times": lambda c, t: (_points_twice(c, t), _REJECTED, RESULT.INVALID_GOAL),
    "late": lambda c, t: (
        {"header": rospy.Header(stamp=rospy.Time(c.sim.now_s - t - 0.5))}, _REJECTED, RESULT.OLD_HEADER_TIMESTAMP
    ),
    "path": lambda c, t: (_tight(c, "path_tolerance"), _ABORTED, RESULT.PATH_TOLERANCE_VIOLATED),
    "goal": lambda c, t: (
        _tight(c, "goal_tolerance", goal_time_tolerance=rospy.Duration(0.05)), _ABORTED, RESULT.GOAL_TOLERANCE_VIOLATED
    ),
}  # fmt: skip


def goals_session(client: Client, count: int) -> dict:
    """`count` random goals of every kind, and memory from a fifth of them on to the end [MB]."""
    rng, wrong, memory = np.random.default_rng(7), [], []
    client.wait(5.0)  # so that a goal can be late
    for _ in range(count):
        kind = str(rng.choice(list(KINDS)))
        end = random_goal(client, kind, rng)
        if end:
            wrong.append(end)
        memory.append(_resident_mb())
    tenth = max(count // 10, 1)
    sim = client.sim
    return {
        "wrong": len(wrong),
        "wrong_ends": wrong[:10],
        "memory_begin_mb": float(np.median(memory[2 * tenth : 3 * tenth])),
        "memory_end_mb": float(np.median(memory[-tenth:])),
        "beyond_set_points": sim.beyond_set_points,
        "beyond_measured": sim.beyond_measured,
        "steps": sim.steps,
    }


def office_session(client: Client, runs: int) -> dict:
    """Real-time factor and processor use of the whole node while the arm sways, 4 simulated seconds a run."""
    here = client.arm.set_point.position
    there = np.clip(here + 0.3, *([getattr(j, n) for j in client.arm.joints] for n in ("lower", "upper")))
    rospy.Subscriber("/camera/depth/points", rospy.AnyMsg, lambda _: None)
    factors, cpu = [], []
    for _ in range(runs):
        start = (client.sim.now_s, time.perf_counter(), time.process_time())
        for target in (there, here):
            client.send(client.goal(target, 2.0)).end()
        wall = time.perf_counter() - start[1]
        factors.append((client.sim.now_s - start[0]) / wall)
        cpu.append((time.process_time() - start[2]) / wall)
    return {"factors": factors, "cpu": cpu}


def cloud_times(sim: Simulator, runs: int) -> list[float]:
    """[ms] of 640x480 clouds with the robot's noise, from the render to the message on its way to a subscriber."""
    config = dataclasses.replace(sim.cameras["hand_camera"].config, width=640, height=480, topic="/large")
    camera = RosCamera(DepthCamera(config, sim.robot))
    arrived: queue.Queue = queue.Queue()
    rospy.Subscriber("/large/depth/points", rospy.AnyMsg, arrived.put)
    time.sleep(1.0)
    times = []
    for _ in range(10 * runs + 5):
        start = time.perf_counter()
        camera.publish(sim.scene, rospy.Time(1))
        times.append(1e3 * (time.perf_counter() - start))
        arrived.get(timeout=10.0)
    return times[5:]  # the first ones compile shaders


def _resident_mb() -> float:
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def measure(kind: str, count: int) -> dict:
    """Run a session; the node owns this thread, the client another one."""
    upload(load_robot("hubo"))
    rospy.set_param("/use_sim_time", True)
    rospy.init_node("hubo_sim", disable_signals=True)
    office = kind == "office"
    config = SimConfig(real_time_factor=0.0, free_running_sensors=office, self_collision=office)
    sim = Watched(robot_spec(), load_world("office" if office else "empty"), config)
    session, result = (office_session if office else goals_session), {}

    def run_client() -> None:
        try:
            result.update(session(Client(sim), count))
        finally:
            ended.set()

    ended = threading.Event()
    threading.Thread(target=run_client, daemon=True).start()
    SimNode(sim, config).run(ended.is_set)
    if office:
        result |= {"cloud_ms": cloud_times(sim, count), "egl": sim.scene.uses_egl}
    rospy.signal_shutdown("measured")
    if not result:
        raise RuntimeError("the client failed")
    return result


def main() -> None:
    """Print the measurements."""
    with RosSession():
        print(json.dumps(measure(sys.argv[1], int(sys.argv[2]))), flush=True)


if __name__ == "__main__":
    main()
