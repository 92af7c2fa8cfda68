"""What views are worth, and what is learned from those that showed something else."""

import math

import numpy as np
import pytest
from small_world import Source, situation

from fv_exploration.explore_config import ViewSettings
from fv_exploration.strategy.frontier_void import FrontierVoid
from fv_exploration.view_geometry import upright_poses
from fv_exploration.view_worth import DISAPPOINTING_SHARE, ViewWorth

AHEAD = upright_poses(np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0]]))


def test_space_outside_the_hull_counts_less_than_a_void():
    expected = ViewWorth(Source(), ViewSettings(known_weight=0.25)).expect(AHEAD)
    assert expected.void_m3[0] == pytest.approx(0.5)
    assert expected.unknown_m3[0] == pytest.approx(1.0)
    assert expected.gain_m3[0] == pytest.approx(0.5 + 0.25 * 0.5)


def test_what_the_robot_covers_is_taken_off_the_gain_of_a_view():
    judge = ViewWorth(Source(), ViewSettings())
    gain = float(judge.expect(AHEAD).gain_m3[0])
    assert judge.gain_at(AHEAD[0], {"elbow": 0.0}) == pytest.approx(gain)
    assert judge.gain_at(AHEAD[0], {"elbow": 0.75}) == pytest.approx(gain / 4)


@pytest.mark.parametrize("share", [-0.1, 0.0, 0.3])
def test_views_like_one_that_disappointed_are_believed_as_far_as_that_one(share):
    settings = ViewSettings()
    judge = ViewWorth(Source(), settings)
    asked = situation(judge=judge)
    before = FrontierVoid().choose(asked).candidates
    assert not judge.note_gain(before.poses[0], 1.0, share)
    after = judge.expect(before.poses).gain_m3
    for pose, old, new in zip(before.poses, before.gain_m3, after, strict=True):
        near = np.linalg.norm(before.poses[0][:3, 3] - pose[:3, 3]) <= settings.doubt_m
        angle = math.acos(np.clip(before.poses[0][:3, 2] @ pose[:3, 2], -1, 1))
        alike = near and angle <= math.radians(settings.doubt_deg)
        assert new == pytest.approx(old * (max(share, 0.0) if alike else 1.0))


@pytest.mark.parametrize(("expected_m3", "real_m3"), [(1.0, DISAPPOINTING_SHARE), (0.2, 3.0), (0.0, 0.0)])
def test_a_view_that_kept_its_promise_casts_no_doubt(expected_m3, real_m3):
    judge = ViewWorth(Source(), ViewSettings())
    before = judge.expect(AHEAD).gain_m3
    assert judge.note_gain(AHEAD[0], expected_m3, real_m3)
    assert np.array_equal(judge.expect(AHEAD).gain_m3, before)
