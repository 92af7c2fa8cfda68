"""From ranked views to one motion, on planners that say what the test wants."""

import math

import numpy as np
import pytest
from small_world import Source, Utility, situation

from fv_exploration.audience import Announced, Step
from fv_exploration.explore_config import ExploreConfig, MotionSettings, ViewSettings
from fv_exploration.motion_choice import MotionSearch, Start
from fv_exploration.robot import ExplorationError, Plan, PlanStatus
from fv_exploration.strategy import Candidates, Ranking
from fv_exploration.strategy.frontier_void import FrontierVoid
from fv_exploration.view_worth import ViewWorth

VIEWS = ViewSettings(utility_voxels=20, sampled=400, shortlist=8)


class Told:
    """An audience that remembers what was done."""

    def __init__(self):
        self.texts = []

    def activity(self, text):
        self.texts.append(text)


class Planner:
    """Answers as it is told: a status, or the joint ``elbow`` where a motion to the first view ends; then the last."""

    def __init__(self, *answers):
        self.answers, self.asked = list(answers), []

    def plan(self, poses, scores, map_sequence, seed):
        self.asked.append((poses, scores, map_sequence, seed))
        answer = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
        if isinstance(answer, PlanStatus):
            return Plan(answer, f"it says {answer.name}")
        return Plan(PlanStatus.SUCCESS, "", 0, len(self.asked), joints={"elbow": answer})


def search(planner, ranking=None, refused=None, views=VIEWS, **motion):
    ranking = ranking or FrontierVoid().choose(situation())
    config = ExploreConfig(views=views, motion=MotionSettings(**motion))
    judge = ViewWorth(Source(), views)
    announced = Announced(Told(), Step())
    start = Start({"elbow": 1.0}, 7, 100)
    return MotionSearch(ranking, start, planner, judge, config, [] if refused is None else refused, announced)


def never():
    return False


def test_goals_are_ranked_reachable_and_spread():
    goals = search(Planner(0.0)).goals()
    assert 0 < len(goals) <= 8
    assert (np.diff(goals.scores) <= 0).all()
    assert (goals.reachability >= 0.5).all()
    assert (goals.gain_m3 >= VIEWS.min_gain_m3).all()
    assert (goals.poses[:, 0, 2] > 0).all()


def test_a_view_that_nothing_hides_is_taken_at_once():
    planner = Planner(0.0)
    motion = search(planner).run(never)
    assert len(planner.asked) == 1
    assert planner.asked[0][2:] == (7, 100), "the map and the seed of the start"
    assert np.array_equal(motion.pose, planner.asked[0][0][0])
    assert motion.score == pytest.approx(planner.asked[0][1][0])


def test_a_view_that_is_hidden_by_half_stands_back_for_one_that_is_not():
    planner = Planner(0.5, 0.0)
    decided = search(planner)
    motion = decided.run(never)
    assert [asked[3] for asked in planner.asked] == [100, 101]
    assert motion.plan.motion == 2
    assert not any(np.array_equal(motion.pose, pose) for pose in planner.asked[0][0][:1])


def test_of_views_that_are_all_hidden_alike_the_best_is_taken():
    planner = Planner(0.8)
    motion = search(planner, max_plans=3).run(never)
    assert len(planner.asked) == 3
    assert motion.plan.motion == 1


def test_views_that_the_robot_hides_whole_are_counted_and_not_taken():
    decided = search(Planner(1.0))
    assert decided.run(never) is None
    assert decided.record.hidden > 3


def test_refused_views_and_their_like_are_not_planned_to_again():
    refused = []
    first = search(Planner(PlanStatus.NO_PATH), refused=refused, max_rounds=1)
    assert first.run(never) is None
    assert first.record.refused == len(refused) == 8
    assert first.record.last_refusal == "it says NO_PATH"
    spread_rad = math.radians(VIEWS.spread_deg)
    for pose in search(Planner(0.0), refused=refused).goals().poses:
        for old in refused:
            angle = np.arccos(np.clip(old[:3, 2] @ pose[:3, 2], -1, 1))
            assert np.linalg.norm(old[:3, 3] - pose[:3, 3]) > VIEWS.spread_m or angle > spread_rad
    again = search(Planner(0.0), refused=[]).goals()
    assert np.array_equal(again.poses[0], refused[0]), "forgotten, they are goals again"


def test_the_planner_is_asked_so_often_and_no_more():
    planner = Planner(PlanStatus.NO_IK_SOLUTION)
    assert search(planner, max_rounds=3).run(never) is None
    assert len(planner.asked) == 3


@pytest.mark.parametrize("status", [status for status in PlanStatus if status.hopeless])
def test_an_answer_that_is_not_about_the_views_ends_it(status):
    planner = Planner(status)
    with pytest.raises(ExplorationError, match=f"cannot move: it says {status.name}"):
        search(planner).run(never)
    assert len(planner.asked) == 1


def test_a_motion_that_was_found_is_taken_when_no_other_can_be_planned():
    motion = search(Planner(0.8, PlanStatus.START_IN_COLLISION)).run(never)
    assert motion.plan.motion == 1


def test_who_stops_gets_what_there_is():
    asked = []
    planner = Planner(0.8)
    motion = search(planner).run(lambda: len(asked) > 1 or bool(asked.append(1)))
    assert len(planner.asked) == 2
    assert motion.plan.motion == 1


def test_what_the_strategy_has_not_asked_is_judged_before_it_is_planned_to():
    """A strategy with a measure of its own, which likes a view best that shows nothing."""
    ranked = (
        FrontierVoid().choose(situation(Utility([[0.2, 0, 0]], [1.0], [[1, 0, 0]]), sampled=0)).candidates
    )
    back = ranked.poses[0].copy()
    back[:3, :3] = back[:3, :3] @ np.diag([-1.0, 1.0, -1.0])
    views = Candidates(np.array([back, ranked.poses[0]]), worth=[50.0, 1.0], cost_s=[1.0, 1.0])
    planner = Planner(0.5)
    decided = search(planner, Ranking(views))
    motion = decided.run(never)
    assert [len(asked[0]) for asked in planner.asked] == [1]
    assert np.array_equal(motion.pose, ranked.poses[0])
    assert motion.score == pytest.approx(0.5), "half of it is hidden, so half of its own measure is left"
    assert motion.gain_m3 == pytest.approx(ranked.gain_m3[0] / 2)
    assert decided.record.funnel.worth_it == 1


def test_nothing_to_see_is_no_plan():
    ranking = FrontierVoid().choose(situation())
    back = ranking.candidates.poses.copy()
    back[:, :3, 2] = [-1.0, 0.0, 0.0]
    planner = Planner(0.0)
    decided = search(planner, Ranking(Candidates(back, np.ones(len(back)), np.ones(len(back)))))
    assert decided.run(never) is None
    assert planner.asked == []
    assert decided.record.funnel.worth_it == 0
    assert decided.record.funnel.reachable == len(back)
