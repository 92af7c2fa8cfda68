"""Parameters of the exploration, validated when they are made; hubo_description.schema.from_mapping reads them.

Names, units and defaults are those of ``config/exploration.yaml``; a test holds the two together.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any


def _require(condition: bool, key: str, value: Any, valid: str) -> None:
    if not condition:
        raise ValueError(f"{key} is {value!r}; valid: {valid}")


def _require_positive(config: Any, *names: str) -> None:
    for name in names:
        value = getattr(config, name)
        _require(math.isfinite(value) and value > 0, name, value, "a number above 0")


def _require_not_negative(config: Any, *names: str) -> None:
    for name in names:
        value = getattr(config, name)
        _require(math.isfinite(value) and value >= 0, name, value, "0 or a number above")


@dataclass(frozen=True)
class MapSettings:
    """The occupancy map (OctoMap's terms)."""

    resolution_m: float = 0.05
    prob_hit: float = 0.7
    prob_miss: float = 0.4
    clamp_min: float = 0.12
    clamp_max: float = 0.97
    occupancy_threshold: float = 0.5

    def __post_init__(self) -> None:
        _require(0.005 <= self.resolution_m <= 0.5, "resolution_m", self.resolution_m, "0.005 to 0.5")
        for name in ("prob_hit", "prob_miss", "clamp_min", "clamp_max", "occupancy_threshold"):
            value = getattr(self, name)
            _require(0.0 < value < 1.0, name, value, "a probability between 0 and 1")


@dataclass(frozen=True)
class ScanSettings:
    """How a cloud is taken and filtered."""

    cloud_topic: str = "/camera/depth/points"
    trigger_service: str = ""
    rest_speed_rad_s: float = 0.01
    rest_s: float = 0.3
    timeout_s: float = 10.0
    self_filter_padding_m: float = 0.03
    no_return_clear_m: float = 0.0

    def __post_init__(self) -> None:
        _require(bool(self.cloud_topic), "cloud_topic", self.cloud_topic, "the name of a topic")
        _require_positive(self, "rest_speed_rad_s", "rest_s", "timeout_s")
        _require_not_negative(self, "self_filter_padding_m", "no_return_clear_m")


@dataclass(frozen=True)
class StartSettings:
    """What is known before the first scan."""

    body_padding_m: float = 0.05

    def __post_init__(self) -> None:
        _require_not_negative(self, "body_padding_m")


@dataclass(frozen=True)
class EvaluationSettings:
    """Void clusters."""

    min_fit: float = 0.5
    utility_rays: int = 1_000_000

    def __post_init__(self) -> None:
        _require_not_negative(self, "utility_rays")
        _require(0.0 < self.min_fit <= 1.0, "min_fit", self.min_fit, "above 0, at most 1")


@dataclass(frozen=True)
class ViewSettings:
    """Candidate views and what they are worth."""

    utility_voxels: int = 400
    suppression_radius_m: float = 0.08
    sampled: int = 2000
    min_reachability: float = 0.5
    waist_step_deg: float = 15.0
    ray_columns: int = 24
    ray_rows: int = 18
    return_cell_m: float = 0.1
    known_weight: float = 0.5
    min_gain_m3: float = 0.008
    shortlist: int = 24
    spread_m: float = 0.08
    spread_deg: float = 15.0
    scan_s: float = 3.0
    linear_m_s: float = 0.25
    angular_deg_s: float = 40.0
    doubt_m: float = 0.2
    doubt_deg: float = 25.0

    def __post_init__(self) -> None:
        _require_positive(
            self,
            "waist_step_deg",
            "ray_columns",
            "ray_rows",
            "min_gain_m3",
            "shortlist",
            "scan_s",
            "linear_m_s",
            "angular_deg_s",
            "return_cell_m",
        )
        _require_not_negative(self, "utility_voxels", "sampled", "suppression_radius_m", "known_weight")
        _require(
            self.utility_voxels + self.sampled > 0, "sampled", self.sampled, "above 0, or utility_voxels"
        )
        _require(0 < self.min_reachability <= 1, "min_reachability", self.min_reachability, "above 0, to 1")


@dataclass(frozen=True)
class MotionSettings:
    """What the planner is asked for."""

    group: str = ""
    planner: str = ""
    plan_budget_s: float = 5.0
    position_tolerance_m: float = 0.02
    angle_tolerance_deg: float = 5.0
    max_rounds: int = 6
    max_plans: int = 12
    good_share: float = 0.6

    def __post_init__(self) -> None:
        _require_positive(
            self, "plan_budget_s", "position_tolerance_m", "angle_tolerance_deg", "max_rounds", "max_plans"
        )
        _require(
            self.max_plans <= 200,
            "max_plans",
            self.max_plans,
            "1 to 200",
        )
        _require(0 < self.good_share <= 1, "good_share", self.good_share, "above 0, to 1")


@dataclass(frozen=True)
class StopSettings:
    """Budgets."""

    max_views: int = 0
    max_seconds: float = 0.0
    max_failed_motions: int = 5

    def __post_init__(self) -> None:
        _require_not_negative(self, "max_views", "max_seconds")
        _require_positive(self, "max_failed_motions")


@dataclass(frozen=True)
class ExploreConfig:
    """Everything that explore_node reads."""

    map: MapSettings = field(default_factory=MapSettings)
    scan: ScanSettings = field(default_factory=ScanSettings)
    start: StartSettings = field(default_factory=StartSettings)
    evaluation: EvaluationSettings = field(default_factory=EvaluationSettings)
    views: ViewSettings = field(default_factory=ViewSettings)
    motion: MotionSettings = field(default_factory=MotionSettings)
    stop: StopSettings = field(default_factory=StopSettings)
    policy: str = "frontier_void"
    policy_parameters: dict[str, Any] = field(default_factory=dict)
    snapshot_service: str = ""
