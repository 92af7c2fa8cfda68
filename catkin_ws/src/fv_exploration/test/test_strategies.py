"""Strategies by name, anybody's own, and what the loop computes for each."""

import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest
from flying_camera import FlyingCamera, make
from small_world import situation

from fv_exploration.outcome import Reason
from fv_exploration.strategy import STRATEGIES, Candidates, Ranking, Strategy, load_strategy
from fv_exploration.strategy.frontier_void import FrontierVoid

EXAMPLE = Path(__file__).parents[4] / "examples" / "nearest_frontier.py"
PAGE = Path(__file__).parents[4] / "docs" / "own_strategy.md"
OWN = """
from dataclasses import dataclass
from fv_exploration.strategy import Strategy

@dataclass
class Tuned(Strategy):
    drawn: int = 3
    near_m: float = 0.5

    def __post_init__(self):
        if self.near_m < 0:
            raise ValueError(f"near_m is {self.near_m}; valid: 0 or a number above")

    def choose(self, situation): ...

class Plain:
    def choose(self, situation): ...

class Needy(Plain):
    def __init__(self, what): ...

class Lost: ...

choose = Plain().choose
"""


@pytest.fixture
def own_module(tmp_path, monkeypatch):
    """A module of a user's on the Python path: returns its name."""
    (tmp_path / "some_lab").mkdir()
    (tmp_path / "some_lab" / "views.py").write_text(textwrap.dedent(OWN))
    (tmp_path / "some_lab" / "broken.py").write_text("import no_such_thing_anywhere\n")
    monkeypatch.syspath_prepend(tmp_path)
    yield "some_lab.views"
    for name in [name for name in sys.modules if name.partition(".")[0] == "some_lab"]:
        del sys.modules[name]


@pytest.fixture
def nearest_frontier(monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLE.parent)
    yield load_strategy("nearest_frontier:NearestFrontier", {})
    del sys.modules["nearest_frontier"]


def test_ours_are_found_by_name():
    assert isinstance(load_strategy("frontier_void", {}), FrontierVoid)
    for name in STRATEGIES:
        assert callable(load_strategy(name, {}).choose)


def test_a_class_of_ones_own_is_found_and_its_fields_are_its_parameters(own_module):
    assert load_strategy(f"{own_module}:Plain", {})
    tuned = load_strategy(f"{own_module}:Tuned", {"near_m": 1})
    assert (tuned.drawn, tuned.near_m, tuned.uses_utility) == (3, 1.0, False)
    assert tuned is not load_strategy(f"{own_module}:Tuned", {}), "each exploration has its own"


@pytest.mark.parametrize(
    ("policy", "said"),
    [
        ("greedy", "policy is 'greedy'; valid: frontier_void"),
        ("", "policy is ''"),
        (":Plain", "policy is ':Plain'"),
        ("some_lab.views:", "policy is 'some_lab.views:'"),
        ("no_lab.views:Plain", "No module named 'no_lab'"),
        ("some_lab.broken:Plain", "No module named 'no_such_thing_anywhere'"),
        ("some_lab.views:Absent", "has no class Absent with a method choose"),
        ("some_lab.views:Lost", "has no class Lost with a method choose"),
        ("some_lab.views:choose", "has no class choose with a method choose"),
        ("some_lab.views:Needy", "policy_parameters of some_lab.views:Needy: TypeError"),
    ],
)
def test_what_is_no_strategy_is_refused_in_one_line(own_module, policy, said):
    with pytest.raises(ValueError, match="policy") as caught:
        load_strategy(policy, {})
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("policy", "parameters", "said"),
    [
        ("frontier_void", {"drawn": 3}, "unknown key 'drawn'; valid: none"),
        ("some_lab.views:Tuned", {"dawn": 3}, "unknown key 'dawn' (did you mean 'drawn'?)"),
        ("some_lab.views:Tuned", {"drawn": 2.5}, "drawn is 2.5; valid: a whole number"),
        ("some_lab.views:Tuned", {"near_m": -1.0}, "near_m is -1.0; valid: 0 or a number above"),
    ],
)
def test_parameters_that_it_does_not_take_are_refused_by_name(own_module, policy, parameters, said):
    with pytest.raises(ValueError, match=f"policy_parameters of {policy}") as caught:
        load_strategy(policy, parameters)
    assert said in str(caught.value)


class Counting:
    """Stands before an evaluator and counts what is asked of it."""

    def __init__(self, evaluator):
        self._evaluator, self.asked = evaluator, {"update": 0, "utility": 0}

    def __getattr__(self, name):
        if name in self.asked:
            self.asked[name] += 1
        return getattr(self._evaluator, name)


class Ahead(Strategy):
    """One view, where the camera stands; remembers what it was given."""

    def __init__(self, **columns):
        self.columns, self.given = columns, []

    def choose(self, situation):
        self.given.append(situation)
        columns = {"poses": situation.T_map_sensor[None], "worth": [1.0], "cost_s": [1.0], **self.columns}
        return Ranking(Candidates(**columns))


@pytest.mark.parametrize("uses_utility", [False, True])
def test_the_utility_is_computed_only_for_a_strategy_that_uses_it(uses_utility):
    strategy = Ahead()
    strategy.uses_utility = uses_utility
    exploration, _, listener = make(FlyingCamera(), strategy=strategy, max_views=2)
    exploration._evaluator = counting = Counting(exploration._evaluator)
    exploration.run()
    scans = len(listener.steps)
    assert counting.asked == {"update": scans, "utility": scans * uses_utility}
    assert all((given.utility is not None) == uses_utility for given in strategy.given)


def test_a_strategy_is_given_where_the_robot_is_and_a_generator_of_its_own_for_each_decision():
    strategy = FrontierVoid()
    given = []
    choose = strategy.choose
    states = set()

    def note(situation):
        given.append(situation)
        states.add(situation.random.bit_generator.state["state"]["state"])
        return choose(situation)

    strategy.choose = note
    robot = FlyingCamera()
    make(robot, strategy=strategy, max_views=3)[0].run()
    assert all(
        np.array_equal(g.T_map_sensor, pose) for g, pose in zip(given[1:], robot.visited, strict=False)
    )
    assert len(states) == len(given) == 3


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"poses": np.eye(3)[None]}, "poses are (1, 3, 3); valid: (N, 4, 4)"),
        ({"poses": np.full((1, 4, 4), np.nan)}, "a pose is no rigid transform"),
        ({"poses": np.diag([2.0, 2.0, 2.0, 1.0])[None]}, "a pose is no rigid transform"),
        ({"poses": np.diag([-1.0, 1.0, 1.0, 1.0])[None]}, "a pose is no rigid transform"),
        ({"worth": [np.inf]}, "worth is not finite"),
        ({"worth": [1.0, 2.0]}, "worth is (2,); valid: (1,)"),
        ({"cost_s": [0.0]}, "cost_s is not above 0"),
        ({"gain_m3": [1.0, 2.0]}, "gain_m3 is (2,)"),
    ],
)
def test_an_answer_that_no_loop_can_go_on_with_is_a_failure_with_its_name(columns, said):
    outcome = make(FlyingCamera(), strategy=Ahead(**columns))[0].run()
    assert outcome.reason is Reason.FAILED
    assert outcome.message.startswith("policy 'frontier_void' broke: ValueError: ")
    assert said in outcome.message


@pytest.mark.parametrize(
    ("choose", "said"),
    [
        (lambda situation: 1 / 0, "ZeroDivisionError"),
        (lambda situation: [situation.T_map_sensor], "choose returned a list; valid: a Ranking"),
        (lambda situation: None, "choose returned a NoneType"),
    ],
)
def test_a_strategy_that_breaks_is_a_failure_that_keeps_the_map_and_where_it_broke(choose, said):
    strategy = FrontierVoid()
    strategy.choose = choose
    outcome = make(FlyingCamera(), strategy=strategy)[0].run()
    assert outcome.reason is Reason.FAILED
    assert said in outcome.message
    assert outcome.known_share > 0
    assert outcome.error.__cause__.__traceback__ is not None


def test_the_example_explores_the_room(nearest_frontier):
    exploration, _, listener = make(FlyingCamera(), strategy=nearest_frontier, max_views=100)
    exploration._evaluator = counting = Counting(exploration._evaluator)
    outcome = exploration.run()
    assert outcome.reason is Reason.COMPLETE
    assert outcome.views >= 3
    assert outcome.known_share > 0.8
    assert counting.asked["utility"] == 0
    shares = [step.known_share for step in listener.steps]
    assert shares == sorted(shares)


def test_the_example_ranks_by_time_alone_and_looks_at_frontiers(nearest_frontier):
    class Evaluated:
        frontier = np.array([[0.6, 0.0, 0.0], [0.6, 0.1, 0.0]])

    found = nearest_frontier.choose(situation(evaluation=Evaluated())).candidates
    assert len(found) > 10
    assert np.array_equal(found.scores, 1 / found.cost_s)
    for pose in found.poses:
        ahead = Evaluated.frontier - pose[:3, 3]
        distances = np.linalg.norm(ahead, axis=1, keepdims=True)
        looked_at = np.isclose(ahead / distances, pose[:3, 2]).all(axis=1)
        assert (looked_at & (distances[:, 0] >= 0.3) & (distances[:, 0] <= 1.5)).any()
    Evaluated.frontier = np.empty((0, 3))
    assert len(nearest_frontier.choose(situation(evaluation=Evaluated())).candidates) == 0


def test_the_page_shows_the_example_as_it_is():
    assert f"```python\n{EXAMPLE.read_text()}```" in PAGE.read_text()
    assert len(EXAMPLE.read_text().splitlines()) < 40
