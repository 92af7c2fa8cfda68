"""Typed configuration of the nodes, read with fv_common.schema.from_mapping.

The YAML files in config/ show the same names, defaults and meanings.
"""

from __future__ import annotations

import dataclasses
from typing import Annotated

from fv_common.schema import Config, Count, NotNegative, OneOf, Positive, Range, Share
from fv_viz.drawing import colors

Scale = Annotated[str, OneOf(*colors.SCALES)]
Pixels = Annotated[int, Range(160, 8192)]


@dataclasses.dataclass(frozen=True)
class VizConfig(Config):
    """What the marker node draws and how. Lengths in metres, alphas in 0..1."""

    block_voxels: Annotated[int, Range(4, 256)] = 32
    height_scale: Scale = "height"
    utility_scale: Scale = "green_red"
    utility_levels: Annotated[int, Range(1, 250)] = 8
    utility_floor: Share = 0.05
    frontier_alpha: Share = 0.4
    free_alpha: Share = 0.25
    unknown_alpha: Share = 0.3
    void_alpha: Share = 0.7
    beside_void_alpha: Share = 0.25
    ellipsoid_alpha: Share = 0.35
    roof_m: NotNegative = 0.1
    max_dots: Count = 50_000
    max_view_scores: Count = 5
    view_size_m: Positive = 0.12
    ghosts: Count = 5


@dataclasses.dataclass(frozen=True)
class ScreenshotConfig(Config):
    """How pictures are taken. Times in seconds, sizes in pixels."""

    out_dir: str = "."
    config: str = ""
    width: Pixels = 1280
    height: Pixels = 960
    timeout_s: Positive = 45.0
    start_timeout_s: Positive = 90.0
    settle_s: Positive = 6.0
    view_yaw_deg: float = -140.0
    view_pitch_deg: Annotated[float, Range(above=-90, below=90)] = 42.0
    view_cut: NotNegative = 0.3
    log: str = ""
