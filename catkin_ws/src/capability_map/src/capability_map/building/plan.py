"""What a build will do, worked out and checked before it starts."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math

import numpy as np

from capability_map._core import ProbeOptions, SphereGrid, cells_in_reach, spiral_points
from capability_map.building.symmetry import (
    Symmetry,
    cells_to_decide,
    first_joint_symmetry,
    quarter_turn_points,
)
from capability_map.errors import CapabilityMapError
from capability_map.parameters import BuildParameters
from capability_map.robots import Arm

METHOD_VERSION = 9  # grows when equal parameters lead to another map


@dataclasses.dataclass(frozen=True)
class BuildPlan:
    """Grid, directions and cells of a build, with the settings that every worker needs. Pickles."""

    arm: Arm
    parameters: BuildParameters
    base_frame: str
    tip_frame: str
    disabled_pairs: tuple[tuple[str, str], ...]  # of the SRDF, sorted
    joint_names: tuple[str, ...]
    joint_limits: np.ndarray  # (J, 2)
    reach_center_m: np.ndarray  # (3,)
    arm_length_m: float
    pivot_m: float
    origin_m: np.ndarray  # (3,)
    size: tuple[int, int, int]
    radius_m: float
    outward: np.ndarray  # (N, 3)
    cells: np.ndarray  # (C,) cells within the proven reach
    symmetry: Symmetry
    decided: np.ndarray  # (D,) those of the cells that are computed; the symmetry makes the others from them

    def grid(self) -> SphereGrid:
        """Return the grid as the C++ core knows it."""
        return SphereGrid(self.origin_m, self.radius_m, list(self.size))

    def probe_options(self) -> ProbeOptions:
        """Return the settings of ViewProbe."""
        return probe_options(self.parameters, len(self.joint_names))

    @property
    def key(self) -> str:
        """Hash of everything that decides the map's content: equal keys, equal maps."""
        content = [
            METHOD_VERSION,
            self.arm.urdf_sha256,
            self.base_frame,
            self.tip_frame,
            [list(pair) for pair in self.disabled_pairs],
            {
                name: value
                for name, value in dataclasses.asdict(self.parameters).items()
                if name != "symmetry"
            },
        ]
        if self.symmetry.axis is not None:
            content.append(["quarter turns", self.symmetry.axis, self.symmetry.shared])
        text = json.dumps(content, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


def probe_options(parameters: BuildParameters, joints: int) -> ProbeOptions:
    """Return the settings of ViewProbe for an arm of so many joints.

    With fewer than 6 the direction may miss, by default by the radius of a cap of one N-th of the sphere.
    """
    options = ProbeOptions()
    options.roll_step_rad = math.radians(parameters.roll_step_deg)
    options.roll_search = parameters.roll_search
    options.arm_angle_step_rad = math.radians(parameters.arm_angle_step_deg)
    options.self_collision = parameters.self_collision
    options.self_collision_padding_m = parameters.self_collision_padding_m
    if joints < 6:
        share_rad = math.acos(1.0 - 2.0 / parameters.points)
        given = parameters.direction_tolerance_deg
        options.direction_tolerance_rad = share_rad if given is None else math.radians(given)
    return options


def plan_build(arm: Arm, parameters: BuildParameters) -> BuildPlan:
    """Work out grid and cells.

    :raises CapabilityMapError: the group is no chain, the arm has no length, or the grid would be too large.
    """
    from fv_robot_model.ik import SerialChain

    try:
        model = arm.model()
        chain = SerialChain.of_group(model, arm.group)
    except ValueError as err:
        raise CapabilityMapError(f"group {arm.group}: {err}") from err
    center, length = chain.reach_bound()
    if length < 1e-3:
        raise CapabilityMapError(f"group {arm.group}: the arm is only {length} m long; nothing to map")
    radius = parameters.radius_m or length / parameters.radii_per_arm_length
    if not radius <= length:
        raise CapabilityMapError(f"radius {radius:g} m is longer than the arm; valid: up to {length:.3f} m")
    low, high = _box(parameters, center, length)
    size = _grid_size(parameters, radius, low, high)
    origin = 0.5 * (low + high) - radius * np.array(size)
    grid = SphereGrid(origin, radius, list(size))
    cells = np.array(cells_in_reach(grid, center, length), np.int64)
    symmetry = first_joint_symmetry(model, arm.group, parameters, grid)
    return BuildPlan(
        arm=arm,
        parameters=parameters,
        base_frame=chain.base_frame,
        tip_frame=chain.tip_frame,
        disabled_pairs=tuple(sorted(tuple(pair) for pair in model.disabled_pairs)),
        joint_names=tuple(chain.joint_names),
        joint_limits=chain.limits,
        reach_center_m=center,
        arm_length_m=length,
        pivot_m=wrist_pivot(chain),
        origin_m=origin,
        size=size,
        radius_m=radius,
        outward=_directions(parameters.points, symmetry),
        cells=cells,
        symmetry=symmetry,
        decided=cells_to_decide(symmetry, cells, size),
    )


def _directions(count: int, symmetry: Symmetry) -> np.ndarray:
    return spiral_points(count) if symmetry.axis is None else quarter_turn_points(count, symmetry.axis)


def _box(parameters: BuildParameters, center: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray]:
    if parameters.box_min_m is None:
        return center - length, center + length
    return np.array(parameters.box_min_m), np.array(parameters.box_max_m)


def _grid_size(parameters: BuildParameters, radius: float, low: np.ndarray, high: np.ndarray):
    """Return the number of cells along each axis, after checking what they will cost."""
    counts = np.ceil((high - low) / (2.0 * radius) - 1e-9)
    cells = float(np.prod(counts))
    if not cells <= parameters.max_cells:
        raise CapabilityMapError(
            f"radius {radius:g} m makes {cells:.3g} cells, more than max_cells {parameters.max_cells}; "
            f"choose a larger radius or a smaller box"
        )
    # Per point of the grid: its flag, and, for the half that may be valid, 8 float32 joints, packed and unpacked.
    megabytes = cells * parameters.points * (1.0 + 0.5 * 0.52 * 8 * 6) / 1e6
    if megabytes > parameters.max_memory_mb:
        raise CapabilityMapError(
            f"{cells:.0f} cells of {parameters.points} points need about {megabytes:.0f} MB, more than "
            f"max_memory_mb {parameters.max_memory_mb:g}; choose a larger radius, fewer points or a smaller box"
        )
    return tuple(max(1, int(count)) for count in counts)


def wrist_pivot(chain) -> float:
    """Return how far behind the tip, along its z axis, the wrist acts [m].

    It is the point of the z axis nearest to the last joint axis that is not parallel to z: what the arm can hold
    depends on where that point must be, far more than on where the tip must be.
    """
    T = chain.T_zero
    tip, z = T[:3, 3], T[:3, 2]
    for axis, point in zip(chain.axes[::-1], chain.points[::-1], strict=True):
        normal = np.cross(z, axis)
        if normal @ normal < 1e-6:
            continue
        along = np.cross(point - tip, axis) @ normal / (normal @ normal)
        return float(-along)
    return 0.0
