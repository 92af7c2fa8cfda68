"""Trajectory maths alone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hubo_sim.control.spline import JointSample, Spline, evaluate, segment

SMALL = st.floats(-5.0, 5.0)
STATE = st.tuples(SMALL, SMALL, SMALL)


def sample_of(state):
    return JointSample(*(np.array([v]) for v in state))


@settings(deadline=None)
@given(start=STATE, end=STATE, duration=st.floats(0.05, 20.0), order=st.sampled_from([1, 3, 5]))
def test_segment_meets_what_its_order_promises(start, end, duration, order):
    coefficients = segment(duration, sample_of(start), sample_of(end), order)
    count = {1: 1, 3: 2, 5: 3}[order]
    for state, t in ((start, 0.0), (end, duration)):
        got = evaluate(coefficients, t)
        for value, wanted in zip([got.position, got.velocity, got.acceleration][:count], state, strict=False):
            assert value[0] == pytest.approx(wanted, abs=1e-6 * (1 + 1 / duration**2))


@settings(deadline=None)
@given(start=STATE, end=STATE, duration=st.floats(0.5, 5.0), order=st.sampled_from([1, 3, 5]))
def test_velocity_and_acceleration_are_the_derivatives(start, end, duration, order):
    coefficients = segment(duration, sample_of(start), sample_of(end), order)
    t, h = 0.4 * duration, 1e-5
    before, here, after = (evaluate(coefficients, x) for x in (t - h, t, t + h))
    scale = 1.0 + np.abs(coefficients).max()
    assert here.velocity[0] == pytest.approx(
        (after.position - before.position)[0] / (2 * h), abs=1e-5 * scale
    )
    assert here.acceleration[0] == pytest.approx(
        (after.velocity - before.velocity)[0] / (2 * h), abs=1e-3 * scale
    )


def through(times, positions, velocities=None, accelerations=None, start=0.0):
    points = {"position": np.array(positions, float)[:, None]}
    if velocities is not None:
        points["velocity"] = np.array(velocities, float)[:, None]
    if accelerations is not None:
        points["acceleration"] = np.array(accelerations, float)[:, None]
    return Spline.through(start, sample_of((0.0, 0.0, 0.0)), np.array(times, float), points)


def test_positions_alone_give_straight_lines():
    spline = through([1.0, 3.0], [1.0, 0.0])
    assert spline.sample(0.5).position[0] == pytest.approx(0.5)
    assert spline.sample(2.0).position[0] == pytest.approx(0.5)
    assert spline.sample(2.0).velocity[0] == pytest.approx(-0.5)


def test_velocities_give_a_continuous_velocity():
    spline = through([1.0, 2.0], [1.0, 2.0], [1.0, 0.0])
    jump = spline.sample(1.0 + 1e-9).velocity - spline.sample(1.0 - 1e-9).velocity
    assert jump[0] == pytest.approx(0.0, abs=1e-6)


def test_accelerations_give_a_continuous_acceleration():
    spline = through([1.0, 2.0], [1.0, 2.0], [1.0, 0.0], [0.5, 0.0])
    jump = spline.sample(1.0 + 1e-9).acceleration - spline.sample(1.0 - 1e-9).acceleration
    assert jump[0] == pytest.approx(0.0, abs=1e-5)


def test_rests_at_the_last_point_after_the_end():
    spline = through([1.0], [2.0], [3.0])
    late = spline.sample(1.5)
    assert (late.position[0], late.velocity[0]) == (pytest.approx(2.0), 0.0)


def test_stays_at_the_first_state_before_the_start():
    assert through([5.0], [1.0], start=4.0).sample(1.0).position[0] == 0.0


def test_stop_comes_to_rest_in_its_time_without_turning_back():
    start = sample_of((1.0, 2.0, 0.0))
    spline = Spline.stop(10.0, start, 0.5)
    positions = [spline.sample(t).position[0] for t in np.linspace(10.0, 11.0, 101)]
    assert np.all(np.diff(positions) >= -1e-9)
    assert positions[-1] == pytest.approx(1.5)
    assert spline.sample(10.5).velocity[0] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_stop_is_what_even_deceleration_gives_step_by_step(seed):
    random = np.random.default_rng(seed)
    count, duration = 4, random.uniform(0.1, 2.0)
    velocity = random.uniform(-3.0, 3.0, count) * [1.0, 1.0, 1.0, 0.0]
    start = JointSample(random.uniform(-1.0, 1.0, count), velocity, np.zeros(count))
    limits = start.position - random.uniform(0, 1, count), start.position + random.uniform(0, 1, count)
    spline = Spline.stop(5.0, start, duration, limits)
    room = np.where(start.velocity > 0, limits[1] - start.position, start.position - limits[0])
    slowing = np.maximum(np.abs(start.velocity) / duration, start.velocity**2 / (2.0 * room))
    position, velocity, step = start.position.copy(), start.velocity.copy(), 1e-4
    for k in range(round(2.2 / step)):
        if k % 500 == 0:
            assert spline.sample(5.0 + k * step).position == pytest.approx(position, abs=2e-3)
        velocity = np.sign(velocity) * np.maximum(np.abs(velocity) - slowing * step, 0.0)
        position = position + velocity * step
    assert np.all(spline.sample(9.0).velocity == 0.0)
    assert np.all(spline.sample(9.0).position >= limits[0] - 1e-12)
    assert np.all(spline.sample(9.0).position <= limits[1] + 1e-12)


def test_followed_by_keeps_the_old_one_until_the_new_one_starts():
    joined = through([2.0], [2.0]).followed_by(
        Spline.through(1.0, sample_of((1.0, 1.0, 0.0)), np.array([3.0]), {"position": np.array([[5.0]])})
    )
    assert joined.sample(0.5).position[0] == pytest.approx(0.5)
    assert joined.sample(2.0).position[0] == pytest.approx(3.0)


def test_followed_by_rests_in_a_gap():
    joined = through([1.0], [1.0]).followed_by(
        Spline.through(5.0, sample_of((1.0, 0.0, 0.0)), np.array([6.0]), {"position": np.array([[2.0]])})
    )
    assert joined.sample(3.0).position[0] == pytest.approx(1.0)
    assert joined.sample(3.0).velocity[0] == 0.0
    assert joined.sample(5.5).position[0] == pytest.approx(1.5)
