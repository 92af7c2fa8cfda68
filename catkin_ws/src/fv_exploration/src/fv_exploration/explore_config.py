"""Parameters of the exploration, validated when they are made; fv_common.schema.from_mapping reads them.

Names, units and defaults are those of ``config/exploration.yaml``; a test holds the two together.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any

from fv_common.errors import ConfigError
from fv_common.schema import AtLeastOne, Config, Count, Name, NotNegative, Positive, Range

Probability = Annotated[float, Range(above=0, below=1)]
SomeShare = Annotated[float, Range(above=0, high=1)]


@dataclass(frozen=True)
class MapSettings(Config):
    """The occupancy map (OctoMap's terms)."""

    resolution_m: Annotated[float, Range(0.005, 0.5)] = 0.05
    prob_hit: Probability = 0.7
    prob_miss: Probability = 0.4
    clamp_min: Probability = 0.12
    clamp_max: Probability = 0.97
    occupancy_threshold: Probability = 0.5


@dataclass(frozen=True)
class ScanSettings(Config):
    """How a cloud is taken and filtered."""

    cloud_topic: Name = "/camera/depth/points"
    trigger_service: str = ""
    rest_speed_rad_s: Positive = 0.01
    rest_s: Positive = 0.3
    timeout_s: Positive = 10.0
    self_filter_padding_m: NotNegative = 0.03
    no_return_clear_m: NotNegative = 0.0


@dataclass(frozen=True)
class StartSettings(Config):
    """What is known before the first scan."""

    body_padding_m: NotNegative = 0.05


@dataclass(frozen=True)
class EvaluationSettings(Config):
    """Void clusters."""

    min_fit: SomeShare = 0.5
    utility_rays: Count = 1_000_000


@dataclass(frozen=True)
class ViewSettings(Config):
    """Candidate views and what they are worth."""

    utility_voxels: Count = 400
    suppression_radius_m: NotNegative = 0.08
    sampled: Count = 2000
    min_reachability: SomeShare = 0.5
    waist_step_deg: Positive = 15.0
    ray_columns: AtLeastOne = 24
    ray_rows: AtLeastOne = 18
    return_cell_m: Positive = 0.1
    known_weight: NotNegative = 0.5
    min_gain_m3: Positive = 0.008
    shortlist: AtLeastOne = 24
    spread_m: NotNegative = 0.08
    spread_deg: NotNegative = 15.0
    scan_s: Positive = 3.0
    linear_m_s: Positive = 0.25
    angular_deg_s: Positive = 40.0
    doubt_m: NotNegative = 0.2
    doubt_deg: NotNegative = 25.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.utility_voxels + self.sampled == 0:
            raise ConfigError("sampled is 0; valid: above 0, or utility_voxels above 0")


@dataclass(frozen=True)
class MotionSettings(Config):
    """What the planner is asked for."""

    group: str = ""
    planner: str = ""
    plan_budget_s: Positive = 5.0
    position_tolerance_m: Positive = 0.02
    angle_tolerance_deg: Positive = 5.0
    max_rounds: AtLeastOne = 6
    max_plans: Annotated[int, Range(1, 200)] = 12
    good_share: SomeShare = 0.6


@dataclass(frozen=True)
class StopSettings(Config):
    """Budgets."""

    max_views: Annotated[int, Range(0, 2**32 - 1)] = 0  # as much as an Explore goal holds
    max_seconds: NotNegative = 0.0
    max_failed_motions: AtLeastOne = 5


@dataclass(frozen=True)
class ExploreConfig(Config):
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
