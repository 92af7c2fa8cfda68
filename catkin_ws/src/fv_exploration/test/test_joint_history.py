"""Joint positions over time, and whether the joints rest."""

import math

import numpy as np
import pytest

from fv_exploration.ros.joint_history import STALE_S, JointHistory

REST_S, SPEED = 0.3, 0.01


def told(position, seconds=1.0, rate_hz=50.0, name="a", speed=None, history=None, end_s=101.0):
    """A history of one joint at ``position(seconds since the beginning)``, until ``end_s``."""
    history = history or JointHistory()
    for t in np.arange(0.0, seconds + 1e-9, 1.0 / rate_hz):
        speeds = () if speed is None else (speed(t),)
        assert history.add(end_s - seconds + t, [name], [position(t)], speeds) == ""
    return history


def unrest(history, *names):
    return history.unrest(names or ["a"], REST_S, SPEED)


@pytest.mark.parametrize("speed", [None, lambda t: 0.0, lambda t: math.nan])
def test_a_moving_joint_never_rests_whatever_its_publisher_says_of_speeds(speed):
    assert "joint 'a' moves at 0.5" in unrest(told(lambda t: 0.5 * t, speed=speed))


def test_a_joint_that_stands_rests_and_noise_below_the_limit_does_no_harm():
    assert unrest(told(lambda t: 1.0)) == ""
    noise = np.random.default_rng(1)
    assert unrest(told(lambda t: 1.0 + noise.uniform(-1, 1) * 0.4 * SPEED * REST_S)) == ""


def test_a_reported_speed_counts_even_where_positions_stand():
    assert "moves at 0.2" in unrest(told(lambda t: 1.0, speed=lambda t: 0.2))


def test_rest_begins_when_the_motion_has_left_the_window():
    def moved_until(stop_s):
        return told(lambda t: min(t, stop_s))

    assert "moves" in unrest(moved_until(0.8))
    assert unrest(moved_until(0.6)) == ""


@pytest.mark.parametrize("seed", range(20))
def test_rest_equals_the_plain_definition(seed):
    random = np.random.default_rng(seed)
    times = 100 + np.sort(random.uniform(0, 1, 40))
    positions = np.cumsum(random.choice([0.0, 0.0, 0.0, 0.002], 40))
    history = JointHistory()
    for t, position in zip(times, positions, strict=True):
        history.add(t, ["a"], [position])
    before = times[times <= times[-1] - REST_S].max()
    window = positions[times >= before]
    expected = (window.max() - window.min()) / (times[-1] - before) <= SPEED
    assert (unrest(history) == "") == expected


def test_publishers_with_rates_of_their_own_are_kept_apart():
    history = told(lambda t: 0.3, seconds=5.0, rate_hz=500.0)
    told(lambda t: 2.0 + t, seconds=4.0, rate_hz=1.0, name="slow", history=history)
    assert history.newest() == pytest.approx({"a": 0.3, "slow": 6.0})
    assert "joint 'slow' moves at 1" in unrest(history, "a", "slow")
    assert unrest(history, "a") == "", "joints that are not the robot's do not matter"
    positions, gap_s = history.at(99.4)
    assert positions == pytest.approx({"a": 0.3, "slow": 4.0})
    assert gap_s == pytest.approx(0.4)


def test_two_publishers_that_contradict_each_other_are_no_rest():
    history = JointHistory()
    for t in np.arange(100.0, 101.0, 0.01):
        history.add(t, ["a"], [0.0])
        history.add(t + 0.005, ["a"], [1.0])
    assert "moves" in unrest(history)


def test_a_joint_that_is_not_known_to_rest_is_named():
    history = told(lambda t: 0.0, seconds=0.2)
    assert "less than 0.3 s" in unrest(history)
    assert "joint 'b' has not been heard of" in unrest(told(lambda t: 0.0), "a", "b")
    old = told(lambda t: 0.0, name="b", end_s=101.0 - STALE_S - 0.5, history=told(lambda t: 0.0))
    assert "joint 'b' has not been heard of for 2.5 s" in unrest(old, "a", "b")


def test_a_clock_that_jumps_back_begins_anew():
    history = told(lambda t: 5.0)
    told(lambda t: 1.0, end_s=11.0, history=history)
    assert history.newest() == {"a": 1.0}
    assert history.newest_s() == pytest.approx(11.0)
    assert unrest(history) == ""


@pytest.mark.parametrize(
    ("stamp_s", "names", "positions", "said"),
    [
        (1.0, ["a", "b"], [1.0], "2 names with 1 positions"),
        (1.0, ["a"], [], "1 names with 0 positions"),
        (1.0, ["a", "a"], [1.0, 2.0], "named twice"),
        (0.0, ["a"], [1.0], "no stamp"),
        (1.0, ["a"], [math.nan], "position of a is not finite"),
        (1.0, ["a"], [math.inf], "position of a is not finite"),
    ],
)
def test_what_cannot_be_taken_is_said_and_left_out(stamp_s, names, positions, said):
    history = JointHistory()
    assert said in history.add(stamp_s, names, positions)
    assert history.newest() == {}
    assert history.missing(["a"]) == ["a"]


def test_the_rest_of_a_message_with_a_bad_position_is_taken():
    history = JointHistory()
    history.add(1.0, ["a", "b"], [math.nan, 2.0])
    assert history.newest() == {"b": 2.0}
