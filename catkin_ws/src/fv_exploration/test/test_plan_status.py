"""The planner's answers as the explorer knows them."""

import pytest
from fv_msgs.msg import PlanMotionResult

from fv_exploration.robot import PlanStatus


def test_the_statuses_are_those_of_the_message():
    numbers = {name: value for name, value in vars(PlanMotionResult).items() if name.isupper()}
    assert numbers.pop("NO_RESULT") == 0
    assert {status.name: status.value for status in PlanStatus} == numbers


@pytest.mark.parametrize(
    "status", [PlanStatus.NO_PATH, PlanStatus.NO_IK_SOLUTION, PlanStatus.GOALS_IN_COLLISION]
)
def test_answers_about_the_views_leave_hope_for_others(status):
    assert not status.hopeless
