"""What decides a capability map's content."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated

from capability_map.errors import CapabilityMapError
from fv_common.errors import ConfigError, told_as
from fv_common.schema import (
    AtLeastOne,
    Config,
    NotNegative,
    Positive,
    Range,
    Vector3,
    from_mapping,
    read_mapping,
)


@dataclasses.dataclass(frozen=True)
class BuildParameters(Config):
    """Settings of a build; `config/build.yaml` holds the same names with their defaults.

    :param radius_m: sphere radius [m]; None: the arm's length divided by `radii_per_arm_length`.
    :param radii_per_arm_length: sphere radii in one arm length (thesis: 30).
    :param points: points on each sphere (thesis: 200).
    :param roll_step_deg: largest step between tried rolls about the tip's z [degrees] (thesis: 30). Unused where
        the last joint turns about z: there one call of the inverse kinematics stands for every roll.
    :param roll_search: look between these steps where a joint limit was missed by little; false: the thesis's stepping.
    :param arm_angle_step_deg: step of the redundant angle of arms with more than 6 joints [degrees].
    :param direction_tolerance_deg: how far the viewing direction may miss, only for arms with fewer than 6 joints
        [degrees]; None: the angular radius of one sphere point's share of the sphere.
    :param self_collision: refuse configurations in which the robot touches itself.
    :param self_collision_padding_m: each link grows by this much for that check [m].
    :param symmetry: where quarter turns of the first joint change nothing (building/symmetry.py), decide one cell
        of four and turn it to the others; false: decide every cell, over the same directions.
    :param box_min_m, box_max_m: box to fill with spheres, base frame [m]; None: the cube of two arm lengths around
        the shoulder.
    :param max_cells: refuse larger grids.
    :param max_memory_mb: refuse maps that would need more memory while building [MB].
    """

    radius_m: Annotated[float | None, Range(above=0)] = None
    radii_per_arm_length: Positive = 30.0
    points: Annotated[int, Range(12, 10_000)] = 200
    roll_step_deg: Positive = 5.0
    roll_search: bool = True
    arm_angle_step_deg: Positive = 5.0
    direction_tolerance_deg: Annotated[float | None, Range(0, below=90)] = None
    self_collision: bool = True
    self_collision_padding_m: NotNegative = 0.0
    symmetry: bool = True
    box_min_m: Vector3 | None = None
    box_max_m: Vector3 | None = None
    max_cells: AtLeastOne = 2_000_000
    max_memory_mb: Positive = 2000.0

    def __post_init__(self) -> None:
        super().__post_init__()
        low, high = self.box_min_m, self.box_max_m
        if (low is None) != (high is None):
            raise ConfigError("box_min_m and box_max_m belong together: give both or neither")
        if low and high and not all(a < b for a, b in zip(low, high, strict=True)):
            raise ConfigError(f"empty box: box_min_m {low}, box_max_m {high}")

    @classmethod
    @told_as(CapabilityMapError)
    def from_mapping(cls, values: object, where: str = "build parameters") -> BuildParameters:
        """Build from a mapping such as a YAML file's; an unknown key is an error that lists the valid ones."""
        return from_mapping(cls, values, where)

    @classmethod
    @told_as(CapabilityMapError)
    def from_yaml(cls, path: Path) -> BuildParameters:
        """Read a YAML file of the form of `config/build.yaml`."""
        return cls.from_mapping(read_mapping(path), str(path))
