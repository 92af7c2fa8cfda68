#!/usr/bin/env python3
"""The planner node under a simulated clock that starts late, stands still, and jumps back."""

import sys
import threading
import time
from pathlib import Path

import rospy
import rostest
from actionlib import CommState
from fv_msgs.msg import ExecuteMotionResult
from rosgraph_msgs.msg import Clock

sys.path.insert(0, str(Path(__file__).resolve().parent))
from planner_case import PlannerCase, Status, answer, wait_for


class FakeClock:
    """/clock at 100 Hz and wall speed from when it is started; may be set or held."""

    def __init__(self) -> None:
        self._pub = rospy.Publisher("/clock", Clock, queue_size=10)
        self.now_s = 0.0
        self.runs = False
        threading.Thread(target=self._tick_forever, daemon=True).start()

    def _tick_forever(self) -> None:
        while not rospy.is_shutdown():
            if self.runs:
                self.now_s += 0.01
                self._pub.publish(Clock(rospy.Time.from_sec(self.now_s)))
            time.sleep(0.01)


class ClockTest(PlannerCase):
    """One test: its parts build on each other, for a clock starts only once."""

    @classmethod
    def setUpClass(cls) -> None:
        cls.clock = FakeClock()
        super().setUpClass()

    def test_late_start_stand_still_and_jump_back(self) -> None:
        self._plans_before_the_clock_starts()
        self._a_wait_for_a_map_lasts_as_long_as_the_clock_says()
        self._a_jump_back_stops_a_motion_and_the_next_one_is_done()

    def _plans_before_the_clock_starts(self) -> None:
        plan = self.plan(goal_name="home")
        self.assertEqual(plan.status, Status.SUCCESS, plan.message)
        self.clock.now_s = 1000.0  # joint states that came at time 0 are old now; new ones come soon
        self.clock.runs = True
        wait_for(lambda: rospy.get_time() > 1000.0, "the clock's start")
        wait_for(lambda: self.plan(goal_name="home").status == Status.SUCCESS, "a plan on new joint states")

    def _a_wait_for_a_map_lasts_as_long_as_the_clock_says(self) -> None:
        self.clock.runs = False
        handle = self.planner.send_goal(self.goal(goal_name="home", min_map_sequence=self.map.sequence + 1))
        time.sleep(3.0)  # of wall time, more than map_wait_s
        self.assertNotEqual(handle.get_comm_state(), CommState.DONE)
        self.clock.runs = True
        result = answer(handle)
        self.assertEqual(result.status, Status.MAP_TOO_OLD, result.message)
        handle = self.planner.send_goal(self.goal(goal_name="home", min_map_sequence=self.map.sequence + 1))
        self.map.publish()  # in time
        self.assertEqual(answer(handle).status, Status.SUCCESS)

    def _a_jump_back_stops_a_motion_and_the_next_one_is_done(self) -> None:
        self.robot.slowdown = 20.0
        handle = self.start(self.plan(goal_name="home"))
        self.wait_until_moving()
        self.clock.now_s = 5.0
        result = answer(handle)
        self.assertEqual(result.status, ExecuteMotionResult.CONTROLLER_FAILED, result.message)
        self.assertIn("clock", result.message)
        wait_for(lambda: rospy.get_time() < 100.0, "the clock's jump")
        self.robot.slowdown = 1.0
        self.robot.place(self.ready)
        self.publish_map()
        plan = self.plan(goal_name="home")
        self.assertEqual(plan.status, Status.SUCCESS, plan.message)
        # the controllers are SimpleActionServers here: they drop goals that are older than the last one
        self.clock.now_s = 2000.0
        wait_for(lambda: rospy.get_time() > 2000.0, "the clock's jump")
        self.robot.place({})  # joint states of now
        result = answer(self.start(plan))
        self.assertEqual((result.status, result.message), (ExecuteMotionResult.SUCCESS, "executed"))


if __name__ == "__main__":
    rospy.init_node("planner_clock_rostest")
    rostest.rosrun("ompl_planner", "planner_clock", ClockTest)
