"""The simulator as a ROS node: one thread owns the physics, the ROS callbacks queue for it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass

import rospy

from hubo_sim.config import SimConfig
from hubo_sim.errors import SimError
from hubo_sim.recorder import Recorder
from hubo_sim.ros.cameras import RosCamera
from hubo_sim.ros.controllers import RosController
from hubo_sim.ros.conversions import time_from_ns
from hubo_sim.ros.pacer import Pacer
from hubo_sim.ros.requests import RequestQueue, wait_for
from hubo_sim.ros.sensors import RosSensor
from hubo_sim.ros.services import WorldServices
from hubo_sim.ros.state import StatePublishers
from hubo_sim.ros.truth import TruthService
from hubo_sim.simulator import Simulator

_IDLE_WAIT_S = 0.004  # how long an idle loop waits for a request before it moves the clock on


@dataclass
class _TriggeredScan:
    camera: RosCamera
    done: Future
    first_step: int


@dataclass
class _StepOrder:
    wanted: int
    done: Future
    taken: int = 0


class SimNode:
    """Steps a Simulator by docs/interfaces.md, 'Simulated time', and speaks ROS for it."""

    def __init__(self, sim: Simulator, config: SimConfig) -> None:
        self.sim, self.config = sim, config
        self.requests = RequestQueue()
        self.paused = False
        self._pacer = Pacer(config.real_time_factor)
        self._recorder = Recorder(sim, config.video, config.video_rate_hz) if config.video else None
        self._scans: list[_TriggeredScan] = []
        self._step_orders: list[_StepOrder] = []
        self._grace_end_s = 0.0  # wall time
        self._last_moving_step = 0
        self._state = StatePublishers(sim, config)
        self.controllers = [
            RosController(name, controller, self.requests.post, self.requests.ask, lambda: sim.now_s)
            for name, controller in sim.controllers.items()
        ]
        self.sensors = [RosSensor(sensor) for sensor in sim.sensors.values()]
        self.cameras = [RosCamera(camera) for camera in sim.cameras.values()]

    def run(self, stop: Callable[[], bool] = rospy.is_shutdown) -> None:
        """Own the physics until `stop` says so. Call from the thread that made the Simulator."""
        self._publish_due()
        self.publish_base_transform()
        opener = threading.Thread(target=self._open, daemon=True)  # needs /clock, which this thread makes
        opener.start()
        self._pacer.restart(self.sim.clock_ns)
        try:
            while not stop():
                self.spin_once()
        finally:
            if self._recorder:
                self._recorder.close()

    def spin_once(self) -> None:
        """Serve requests, then either one physics step or a moment of sleep."""
        if self._wants_physics():
            self.requests.serve(self._pacer.ahead_s(self.sim.clock_ns))
            if self._pacer.ahead_s(self.sim.clock_ns) <= 0.0:
                self._step()
            time.sleep(0.0)  # lets the ROS threads have Python's lock, which a busy loop would hold
        elif self._step_orders:
            self.requests.serve(0.0)
            self._take_ordered_step()
        else:
            self.requests.serve(_IDLE_WAIT_S)
            self._sleep()
        self._begin_goals()
        self._serve_scans()
        self._publish_due()

    def publish_base_transform(self) -> None:
        """Tie the robot's base link to the world."""
        self._state.publish_base_transform()

    def pause(self) -> None:
        """Stop physics and the clock; goals are refused until unpause. A second call does nothing."""
        self._set_paused(True)

    def unpause(self) -> None:
        """Go on where pause stopped."""
        self._set_paused(False)

    def reset(self) -> None:
        """Robot, world, contacts and noise as at the start; active goals are aborted, the clock goes on."""
        for controller in self.controllers:
            controller.drop_pending("the simulation was reset")
        for camera in self.cameras:
            camera.scans = 0
        for sensor in self.sensors:
            sensor.readings = 0
        self.sim.reset()
        self._last_moving_step = self.sim.steps
        self.publish_base_transform()

    def request_steps(self, count: int) -> float:
        """Take physics steps while paused and wait for them; simulated time afterwards [s].

        Raises SimError when the simulation is not paused, or is unpaused before they are all taken.
        """
        order = _StepOrder(count, Future())
        self.requests.ask(lambda: self._accept_steps(order))
        return order.done.result()

    def request_scan(self, camera: RosCamera) -> rospy.Time:
        """Wait for a scan at rest; its stamp. Raises RuntimeError with the reason when it cannot be."""
        done: Future = Future()
        self.requests.post(lambda: self._scans.append(_TriggeredScan(camera, done, self.sim.steps)))
        return wait_for(done, 60.0)

    def _accept_steps(self, order: _StepOrder) -> None:
        if not self.paused:
            raise SimError("the simulation is not paused: call pause_physics first")
        self._step_orders.append(order)

    def _take_ordered_step(self) -> None:
        """One physics step although paused, with everything published that is due."""
        for order in [order for order in self._step_orders if order.taken == order.wanted]:
            self._step_orders.remove(order)
            order.done.set_result(self.sim.now_s)
        if self._step_orders:
            self._step_orders[0].taken += 1
            self._step()

    def _set_paused(self, paused: bool) -> None:
        self.paused = paused
        for order in self._step_orders if not paused else ():
            order.done.set_exception(SimError(f"unpaused after {order.taken} of {order.wanted} steps"))
        self._step_orders = self._step_orders if paused else []
        for controller in self.controllers:
            controller.accepts = not paused
        self._pacer.restart(self.sim.clock_ns)

    def _open(self) -> None:
        for controller in self.controllers:
            controller.on_accepted = self._on_accepted
            controller.open()
        for camera in self.cameras:
            camera.open(self.request_scan)
        WorldServices(self).open()
        TruthService(self.sim, self.requests.ask, self.config.world_frame).open()
        renderer = "EGL" if self.sim.scene.uses_egl else "TinyRenderer"
        rospy.loginfo("hubo_sim: world %s, drawn by %s, ready", self.sim.world.name, renderer)

    def _on_accepted(self) -> None:
        self._grace_end_s = time.monotonic() + self.config.goal_grace_s

    def _wants_physics(self) -> bool:
        if self.paused:
            return False
        if not self.config.lockstep or self.sim.is_moving:
            return True
        settle_steps = self.config.settle_timeout_s * self.config.physics_rate_hz
        return not self.sim.at_rest and self.sim.steps - self._last_moving_step <= settle_steps

    def _step(self) -> None:
        self.sim.step()
        if self._recorder:
            self._recorder.after_step()
        if self.sim.is_moving:
            self._last_moving_step = self.sim.steps
        for sensor in self.sensors:
            if (self.config.scans_run_free or not sensor.is_heavy) and sensor.is_due(self.sim.now_s):
                sensor.publish(self.sim.scene, time_from_ns(self.sim.clock_ns))
        if self.config.scans_run_free:
            for camera in self.cameras:
                if camera.is_due(self.sim.now_s):
                    self._publish_scan(camera)

    def _sleep(self) -> None:
        """No physics: the clock goes on at wall speed, unless the simulation is paused."""
        if self.paused:
            self._pacer.restart(self.sim.clock_ns)
        else:
            self.sim.sleep_until(self._pacer.wall_clock_ns(self.sim.clock_ns))

    def _begin_goals(self) -> None:
        """Start accepted goals: in lockstep from rest only, all together, once the grace is over."""
        if not any(controller.pending for controller in self.controllers):
            return
        waits = self.config.lockstep and not self.sim.is_moving
        if waits and (self._wants_physics() or time.monotonic() < self._grace_end_s):
            return
        self._pacer.restart(self.sim.clock_ns)
        for controller in self.controllers:
            controller.begin_pending()
        self._last_moving_step = self.sim.steps

    def _serve_scans(self) -> None:
        if not self._scans:
            return
        if self.sim.at_rest and not self.paused:
            for scan in self._scans:
                if scan.done.set_running_or_notify_cancel():  # else nobody waits for it any more
                    self.sim.sleep_until(self._state.next_joints_ns)
                    scan.done.set_result(self._publish_scan(scan.camera))
            self._scans = []
            return
        for scan in [scan for scan in self._scans if self._is_late(scan)]:
            self._scans.remove(scan)
            if not scan.done.set_running_or_notify_cancel():
                continue
            reason = (
                "paused" if self.paused else f"the robot did not rest within {self.config.settle_timeout_s} s"
            )
            scan.done.set_exception(RuntimeError(reason))

    def _is_late(self, scan: _TriggeredScan) -> bool:
        waited_s = (self.sim.steps - scan.first_step) / self.config.physics_rate_hz
        return self.paused or waited_s > self.config.settle_timeout_s or not self._wants_physics()

    def _publish_scan(self, camera: RosCamera) -> rospy.Time:
        """Clock and joint states of this moment, then the scan of it."""
        stamp = self._state.publish_now()
        camera.publish(self.sim.scene, stamp)
        return stamp

    def _publish_due(self) -> None:
        self._state.publish_due()
        for controller in self.controllers:
            controller.publish_due(time_from_ns(self.sim.clock_ns))
