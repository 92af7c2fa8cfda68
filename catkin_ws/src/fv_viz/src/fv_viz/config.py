"""Typed configuration of the nodes, read with hubo_description.schema.from_mapping.

The YAML files in config/ show the same names, defaults and meanings.
"""

from __future__ import annotations

import dataclasses
from typing import Any

from fv_viz.drawing import colors


@dataclasses.dataclass(frozen=True)
class VizConfig:
    """What the marker node draws and how. Lengths in metres, alphas in 0..1."""

    block_voxels: int = 32
    height_scale: str = "height"
    utility_scale: str = "green_red"
    utility_levels: int = 8
    utility_floor: float = 0.05
    frontier_alpha: float = 0.4
    free_alpha: float = 0.25
    unknown_alpha: float = 0.3
    void_alpha: float = 0.7
    beside_void_alpha: float = 0.25
    ellipsoid_alpha: float = 0.35
    roof_m: float = 0.1
    max_dots: int = 50_000
    max_view_scores: int = 5
    view_size_m: float = 0.12
    ghosts: int = 5

    def __post_init__(self) -> None:
        shares = [field.name for field in dataclasses.fields(self) if field.name.endswith("_alpha")]
        for name in (*shares, "utility_floor"):
            _require(0.0 <= getattr(self, name) <= 1.0, name, getattr(self, name), "a number in 0..1")
        for name in ("height_scale", "utility_scale"):
            choices = ", ".join(colors.SCALES)
            _require(getattr(self, name) in colors.SCALES, name, getattr(self, name), f"one of {choices}")
        _require(4 <= self.block_voxels <= 256, "block_voxels", self.block_voxels, "an integer in 4..256")
        _require(
            1 <= self.utility_levels <= 250, "utility_levels", self.utility_levels, "an integer in 1..250"
        )
        _require(self.max_view_scores >= 0, "max_view_scores", self.max_view_scores, "0 or more")
        _require(self.max_dots >= 0, "max_dots", self.max_dots, "0 or more")
        _require(self.roof_m >= 0.0, "roof_m", self.roof_m, "a length [m], 0 or more")
        _require(self.view_size_m > 0.0, "view_size_m", self.view_size_m, "a positive length [m]")
        _require(self.ghosts >= 0, "ghosts", self.ghosts, "0 or more")


@dataclasses.dataclass(frozen=True)
class ScreenshotConfig:
    """How pictures are taken. Times in seconds, sizes in pixels."""

    out_dir: str = "."
    config: str = ""
    width: int = 1280
    height: int = 960
    timeout_s: float = 45.0
    start_timeout_s: float = 90.0
    settle_s: float = 6.0
    view_yaw_deg: float = -140.0
    view_pitch_deg: float = 42.0
    view_cut: float = 0.3
    log: str = ""

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            _require(160 <= getattr(self, name) <= 8192, name, getattr(self, name), "pixels in 160..8192")
        for name in ("timeout_s", "start_timeout_s", "settle_s"):
            _require(getattr(self, name) > 0.0, name, getattr(self, name), "a positive time [s]")
        _require(abs(self.view_pitch_deg) < 90.0, "view_pitch_deg", self.view_pitch_deg, "degrees in -90..90")
        _require(self.view_cut >= 0.0, "view_cut", self.view_cut, "0 or more")


def _require(condition: bool, name: str, value: Any, wanted: str) -> None:
    if not condition:
        raise ValueError(f"parameter {name!r} must be {wanted}, got {value!r}")
