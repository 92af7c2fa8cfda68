"""What decides a capability map's content."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

from capability_map.errors import CapabilityMapError
from hubo_description import RobotDescriptionError
from hubo_description.schema import from_mapping, read_yaml


@dataclasses.dataclass(frozen=True)
class BuildParameters:
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

    radius_m: float | None = None
    radii_per_arm_length: float = 30.0
    points: int = 200
    roll_step_deg: float = 5.0
    roll_search: bool = True
    arm_angle_step_deg: float = 5.0
    direction_tolerance_deg: float | None = None
    self_collision: bool = True
    self_collision_padding_m: float = 0.0
    symmetry: bool = True
    box_min_m: tuple[float, float, float] | None = None
    box_max_m: tuple[float, float, float] | None = None
    max_cells: int = 2_000_000
    max_memory_mb: float = 2000.0

    def __post_init__(self) -> None:
        """Check every value; raise CapabilityMapError naming the bad one."""
        for name in (
            "radius_m",
            "radii_per_arm_length",
            "roll_step_deg",
            "arm_angle_step_deg",
            "max_memory_mb",
        ):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise CapabilityMapError(f"{name} must be a positive number, not {value}")
        if self.direction_tolerance_deg is not None and not 0.0 <= self.direction_tolerance_deg < 90.0:
            raise CapabilityMapError(
                f"direction_tolerance_deg must be in [0, 90), not {self.direction_tolerance_deg}"
            )
        if not (math.isfinite(self.self_collision_padding_m) and self.self_collision_padding_m >= 0.0):
            raise CapabilityMapError(
                f"self_collision_padding_m must be 0 or more, not {self.self_collision_padding_m}"
            )
        if not 12 <= self.points <= 10_000:
            raise CapabilityMapError(f"points must be between 12 and 10000, not {self.points}")
        if self.max_cells < 1:
            raise CapabilityMapError(f"max_cells must be at least 1, not {self.max_cells}")
        self._check_box()

    def _check_box(self) -> None:
        if (self.box_min_m is None) != (self.box_max_m is None):
            raise CapabilityMapError("box_min_m and box_max_m belong together: give both or neither")
        if self.box_min_m is None:
            return
        for low, high in zip(self.box_min_m, self.box_max_m, strict=True):
            if not (math.isfinite(low) and math.isfinite(high) and low < high):
                raise CapabilityMapError(f"empty box: box_min_m {self.box_min_m}, box_max_m {self.box_max_m}")

    @classmethod
    def from_mapping(cls, values: object, where: str = "build parameters") -> BuildParameters:
        """Build from a mapping such as a YAML file's; an unknown key is an error that lists the valid ones."""
        try:
            return from_mapping(cls, values, where)
        except RobotDescriptionError as err:
            raise CapabilityMapError(str(err)) from err

    @classmethod
    def from_yaml(cls, path: Path) -> BuildParameters:
        """Read a YAML file of the form of `config/build.yaml`."""
        try:
            return cls.from_mapping(read_yaml(path), str(path))
        except RobotDescriptionError as err:
            raise CapabilityMapError(str(err)) from err
