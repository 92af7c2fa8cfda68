"""The parameters of explore_node."""

import dataclasses
from pathlib import Path

import pytest
import yaml

from fv_common.schema import from_mapping
from fv_exploration.explore_config import ExploreConfig

SHIPPED = Path(__file__).parents[1] / "config" / "exploration.yaml"


def test_the_shipped_file_has_every_member_with_its_default():
    assert yaml.safe_load(SHIPPED.read_text()) == dataclasses.asdict(ExploreConfig())


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({"mapp": {}}, "mapp"),
        ({"map": {"resolution": 0.05}}, "map: .*resolution"),
        ({"map": {"resolution_m": 5.0}}, "map: .*resolution_m"),
        ({"map": {"resolution_m": "5 cm"}}, "map: .*resolution_m"),
        ({"map": {"prob_hit": 1.5}}, "map: .*prob_hit"),
        ({"views": {"shortlist": 0}}, "views: .*shortlist"),
        ({"views": {"shortlist": 2.5}}, "views: .*shortlist"),
        ({"scan": {"cloud_topic": ""}}, "scan: .*cloud_topic"),
        ({"motion": {"plan_budget_s": float("nan")}}, "motion: .*plan_budget_s"),
        ({"evaluation": {"min_fit": 0.0}}, "evaluation: .*min_fit"),
        ({"motion": {"max_plans": 300}}, "motion: .*max_plans is 300; valid: a whole number, 1 to 200"),
        ({"policy": 3}, "policy"),
        ({"policy_parameters": [1]}, "policy_parameters"),
        ({"stop": 3}, "stop"),
    ],
)
def test_what_is_wrong_is_named(values, named):
    with pytest.raises(ValueError, match=named):
        from_mapping(ExploreConfig, values, "config")


def test_whole_numbers_are_taken_where_a_number_is_wanted():
    assert from_mapping(ExploreConfig, {"stop": {"max_seconds": 60}}, "config").stop.max_seconds == 60.0
