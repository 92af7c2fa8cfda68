"""Quarter turns about the first joint: where they change nothing, one sphere of four is decided for all.

A full turn of the first joint carries every configuration to one that looks the same to an observer who turned along.
The grid of spheres returns to itself after a quarter turn, and so do the directions of `quarter_turn_points`. Where
rolls are searched in steps, the steps do not turn along: what they overlook may then differ from cell to cell.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from capability_map._core import SphereGrid
from capability_map.parameters import BuildParameters

TOLERANCE = 1e-5  # [rad or m] below the step to which configurations are stored; URDFs round pi
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
_POLE_SHARE = (
    0.3  # of a step between the rings left to each pole: covers the sphere as well as the spiral does
)


@dataclasses.dataclass(frozen=True)
class Symmetry:
    """What quarter turns about the first joint do to a grid."""

    axis: (
        int | None
    )  # of the grid, 0 x, 1 y, 2 z, to which the first joint's axis is parallel; None: no symmetry
    sense: float  # +1.0 or -1.0: the joint turns about +axis or -axis
    shared: bool  # one cell of four is decided
    text: str  # how it is used, or why not


def first_joint_symmetry(model, group: str, parameters: BuildParameters, grid: SphereGrid) -> Symmetry:
    """Decide whether quarter turns of a chain's first joint carry the map onto itself.

    :param model: RobotModel. :param group: one of its chains; the grid stands in its base frame.
    """
    from fv_robot_model.ik import SerialChain

    chain = SerialChain.of_group(model, group)
    axis = int(np.argmax(np.abs(chain.axes[0])))
    turning = _links_turning_along(model, group, chain)
    against = (
        _joint_against(chain, turning)
        or _grid_against(chain, axis, grid)
        or _contact_against(model, group, parameters, turning)
        or (f"{parameters.points} points are not divisible by 4" if parameters.points % 4 else None)
    )
    if against:
        return Symmetry(None, 1.0, False, f"not used: {against}")
    text = f"quarter turns of {chain.joint_names[0]} change nothing"
    told = "one cell of four is decided" if parameters.symmetry else "switched off, every cell is decided"
    return Symmetry(axis, float(np.sign(chain.axes[0][axis])), parameters.symmetry, f"{text}; {told}")


def _links_turning_along(model, group: str, chain) -> set[str]:
    """Names of the links that the first joint turns about its axis as one body (not: slides, or mimics otherwise)."""
    limits = [(limit.lower, limit.upper) for limit in model.limits]
    at_rest = np.clip(0.0, *np.array(limits).T)
    turned = at_rest.copy()
    turned[model.group(group).joint_indices[0]] += 1.0
    base = np.linalg.inv(model.forward(at_rest)[model.link_names.index(chain.base_frame)])
    before, after = base @ model.forward(at_rest), base @ model.forward(turned)
    turn = _turn_about(chain.axes[0], chain.points[0], 1.0)
    same = np.abs(turn @ before - after).max(axis=(1, 2)) < TOLERANCE
    return {name for name, along in zip(model.link_names, same, strict=True) if along}


def _turn_about(axis: np.ndarray, point: np.ndarray, angle: float) -> np.ndarray:
    """Return the (4, 4) rotation about a line."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    T = np.eye(4)
    T[:3, :3] += math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross
    T[:3, 3] = point - T[:3, :3] @ point
    return T


def _joint_against(chain, turning: set[str]) -> str | None:
    name = chain.joint_names[0]
    if chain.tip_frame not in turning:
        return f"joint {name} slides"
    degrees = math.degrees(np.ptp(chain.limits[0]))
    if math.radians(degrees) < 2.0 * math.pi - TOLERANCE:
        return f"joint {name} turns {degrees:.1f} degrees, less than a full turn"
    return None


def _grid_against(chain, axis: int, grid: SphereGrid) -> str | None:
    name = chain.joint_names[0]
    if np.linalg.norm(np.cross(chain.axes[0], np.eye(3)[axis])) > TOLERANCE:
        return f"the axis of {name} is not parallel to an axis of the grid"
    center = np.asarray(grid.origin) + grid.radius_m * np.asarray(grid.size)
    if np.linalg.norm(np.cross(center - chain.points[0], chain.axes[0])) > TOLERANCE:
        return f"the axis of {name} misses the centre of the grid"
    if grid.size[(axis + 1) % 3] != grid.size[(axis + 2) % 3]:
        return f"the grid is not square across the axis of {name}"
    return None


def _contact_against(model, group: str, parameters: BuildParameters, turning: set[str]) -> str | None:
    from fv_robot_model import SelfCollision

    if not parameters.self_collision:
        return None
    checker = SelfCollision(model, group=group, padding_m=parameters.self_collision_padding_m)
    for first, second in checker.checked_pairs:
        if (first in turning) != (second in turning):
            return f"{first} may touch {second}, and only one of them turns along"
    return None


def quarter_turn_points(count: int, axis: int) -> np.ndarray:
    """Return (count, 3) nearly equally distributed unit vectors, closed under quarter turns about a grid axis.

    Four golden spirals: vector k + count / 4 is vector k after a quarter turn. For 200 no place of the sphere is more
    than 10.3 degrees from a vector (`spiral_points`: 10.5) and the closest two are 12.3 degrees apart (8.1).

    :param count: divisible by 4, at least 8.
    """
    ring = np.arange(count // 4)
    height = -1.0 + 2.0 * (ring + _POLE_SHARE) / (count // 4 - 1 + 2.0 * _POLE_SHARE)
    across = np.sqrt(1.0 - height**2)
    azimuth = 0.5 * math.pi * (ring * _GOLDEN % 1.0)
    spiral = np.empty((count // 4, 3))
    spiral[:, axis] = height
    spiral[:, (axis + 1) % 3] = across * np.cos(azimuth)
    spiral[:, (axis + 2) % 3] = across * np.sin(azimuth)
    spirals = [spiral]
    for _ in range(3):
        spirals.append(_turned_vectors(spirals[-1], axis))
    return np.concatenate(spirals)


def _turned_vectors(vectors: np.ndarray, axis: int) -> np.ndarray:
    turned = vectors.copy()
    turned[:, (axis + 1) % 3] = -vectors[:, (axis + 2) % 3]
    turned[:, (axis + 2) % 3] = vectors[:, (axis + 1) % 3]
    return turned


def turned_cells(cells: np.ndarray, size: tuple[int, int, int], axis: int, quarters: int) -> np.ndarray:
    """Return where so many quarter turns about the grid's middle take cells (C,)."""
    place = np.stack(np.unravel_index(cells, size), axis=1)
    for _ in range(quarters):
        turned = _turned_vectors(place, axis)
        turned[:, (axis + 1) % 3] += size[(axis + 2) % 3] - 1
        place = turned
    return np.ravel_multi_index(tuple(place.T), size).astype(np.int64)


def cells_to_decide(symmetry: Symmetry, cells: np.ndarray, size: tuple[int, int, int]) -> np.ndarray:
    """Return those of the cells (C,) from which `spread` makes all: the lowest of each orbit."""
    if not symmetry.shared:
        return cells
    lowest = cells.copy()
    for quarters in (1, 2, 3):
        turned = turned_cells(cells, size, symmetry.axis, quarters)
        # Rounding may leave one of four at the brim of the reach out.
        lowest = np.where(np.isin(turned, cells), np.minimum(lowest, turned), lowest)
    return cells[lowest == cells]


@dataclasses.dataclass
class Decided:
    """Decided spheres. C cells, N directions, V valid points (sphere by sphere), J joints."""

    cells: np.ndarray  # (C,)
    valid: np.ndarray  # (C, N) bool
    witnesses: np.ndarray  # (V, J) uint16, share of the joint's range
    manipulability: np.ndarray  # (V,)


def spread(
    symmetry: Symmetry, decided: Decided, cells: np.ndarray, size: tuple[int, int, int], limits: np.ndarray
) -> Decided:
    """Turn decided spheres to the other cells of their orbits.

    :param cells: of the whole map; others are not made. :param limits: (J, 2) of the joints [rad or m].
    """
    if not symmetry.shared:
        return decided
    point = np.full(decided.valid.shape, -1, np.int64)
    point[decided.valid] = np.arange(len(decided.manipulability))
    pieces = [decided]
    for quarters in (1, 2, 3):
        turned = turned_cells(decided.cells, size, symmetry.axis, quarters)
        kept = np.isin(turned, cells) & (turned != decided.cells)
        rows = np.roll(point[kept], quarters * (point.shape[1] // 4), axis=1)
        points = rows[rows >= 0]
        witnesses = decided.witnesses[points]
        angle = symmetry.sense * quarters * 0.5 * math.pi
        witnesses[:, 0] = _shifted(witnesses[:, 0], angle, *limits[0])
        pieces.append(Decided(turned[kept], rows >= 0, witnesses, decided.manipulability[points]))
    return Decided(
        *(
            np.concatenate([getattr(piece, field.name) for piece in pieces])
            for field in dataclasses.fields(Decided)
        )
    )


def _shifted(share: np.ndarray, angle: float, lower: float, upper: float) -> np.ndarray:
    """Add an angle to joint values stored as 65535ths of a range of at least a full turn, and stay within it."""
    steps = (upper - lower) / 65535.0
    above = (share.astype(float) * steps + angle) % (2.0 * math.pi)
    return np.rint(np.minimum(above / steps, 65535.0)).astype(np.uint16)
