"""Computations in a process apart."""

import math
import operator
import time

import pytest

from hubo_sim.background import run_apart
from hubo_sim.errors import SimError
from hubo_sim.robot_source import load_robot_spec


def never() -> bool:
    return False


def test_an_answer_comes_back():
    assert run_apart(math.sqrt, 2.0, never) == math.sqrt(2.0)


def test_a_robot_whose_model_was_read_already_is_read_again_there():
    spec = load_robot_spec("youbot_arm")
    assert run_apart(operator.attrgetter("model.link_names"), spec, never) == spec.model.link_names


def test_what_the_function_refuses_is_told():
    with pytest.raises(SimError, match="math domain error"):
        run_apart(math.sqrt, -1.0, never)


def test_a_process_that_dies_is_no_answer():
    with pytest.raises(SimError, match="without an answer"):
        run_apart(exit, 3, never)


def test_a_stop_ends_it():
    start = time.monotonic()
    with pytest.raises(SimError, match="stopped"):
        run_apart(time.sleep, 600.0, lambda: time.monotonic() - start > 1.0)
