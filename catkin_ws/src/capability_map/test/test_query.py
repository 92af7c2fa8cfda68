"""Queries against slow, obvious oracles in numpy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capability_map import CapabilityMapError, _core, check, placement, shapes
from capability_map._core import fit_shapes, spiral_points
from capability_map.drawing.geometry import cut_rows, index_colors, shape_triangles, spikes, two_rows


def views(cap, count: int, seed: int):
    return check.random_views(cap, count, seed)


def oracle_nearest(cap, position, direction) -> float:
    center = position + cap.radius * direction
    apart = np.abs(cap.centres - center)
    inside = np.flatnonzero((apart <= cap.radius).all(axis=1))
    if len(inside) == 0:
        return 0.0
    return float(cap.valid[inside[0], np.argmax(-cap.directions @ direction)])


def turn_onto(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """The smallest rotation (3, 3) that takes one unit vector to another."""
    v, c = np.cross(source, target), source @ target
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + cross + cross @ cross / (1.0 + c)


def oracle_interpolated(cap, position, direction) -> float:
    """Trilinear over all spheres by their distance; over the directions by how far the cosine is above the least."""
    least = np.cos(1.5 * np.sqrt(4.0 * np.pi / len(cap.directions)))
    shoulder, pivot = cap.data.reach_center_m, cap.data.pivot_m
    total = weights = 0.0
    for k, stored in enumerate(-cap.directions):
        weight = max(0.0, direction @ stored - least)
        weights += weight
        tips = (
            position - pivot * direction + pivot * stored,
            shoulder + turn_onto(direction, stored) @ (position - shoulder),
        )
        for tip in tips if weight > 0.0 else ():
            away = np.abs(cap.centres - (tip + cap.radius * stored)) / (2.0 * cap.radius)
            total += 0.5 * weight * (np.clip(1.0 - away, 0.0, None).prod(axis=1) @ cap.valid[:, k])
    return total / weights


def test_nearest_is_the_bit_of_the_sphere_around_p_plus_r_d(cap):
    positions, directions = views(cap, 2000, 0)
    expected = [oracle_nearest(cap, p, d) for p, d in zip(positions, directions, strict=True)]
    assert np.array_equal(cap.query(positions, directions, interpolate=False), expected)


def test_interpolation_weighs_cells_and_directions(cap):
    positions, directions = views(cap, 300, 1)
    expected = [oracle_interpolated(cap, p, d) for p, d in zip(positions, directions, strict=True)]
    assert np.allclose(cap.query(positions, directions), expected, atol=1e-6)


def test_a_sphere_point_itself_answers_with_its_bit(cap):
    sphere, point = np.indices(cap.valid.shape).reshape(2, -1)
    positions = cap.centres[sphere] + cap.radius * cap.directions[point]
    answers = cap.query(positions, -cap.directions[point], interpolate=False)
    assert np.array_equal(answers, cap.valid.reshape(-1))


def test_poses_and_views_agree_and_roll_does_not_count(cap):
    positions, directions = views(cap, 50, 2)
    assert np.array_equal(
        cap.query_poses(poses_along(positions, directions)), cap.query(positions, directions)
    )
    assert np.array_equal(
        cap.reachable(positions, directions), cap.query(positions, directions) >= cap.threshold
    )


QUERIES = {
    "interpolated": lambda cap, p, d: cap.query(p, d),
    "nearest": lambda cap, p, d: cap.query(p, d, interpolate=False),
    "poses": lambda cap, p, d: cap.query_poses(poses_along(p, d)),
    "reachable": lambda cap, p, d: cap.reachable(p, d),
    "covered": lambda cap, p, d: cap.covered(p, d),
    "covered, thesis": lambda cap, p, d: cap.covered(p, d, "cover_all"),
    "sphere rows": lambda cap, p, d: cap.sphere_rows(p, d),
    "seeds": lambda cap, p, d: np.column_stack(cap.seeds(p, d)),
    "placements": lambda cap, p, d: placement.placements(cap, np.eye(4)[None], p, d),
}


def poses_along(positions, directions) -> np.ndarray:
    T = np.tile(np.eye(4), (len(positions), 1, 1))
    T[:, :3, 3], T[:, :3, 2] = positions, directions
    return T


@pytest.mark.parametrize("name", QUERIES)
@pytest.mark.parametrize("length", [7.0, 1e-9, 1e-160, 1e160, 1e300, 2.0**-1060])
def test_the_length_of_a_direction_counts_in_no_query(cap, name, length):
    positions, directions = views(cap, 400, 7)
    directions = np.round(directions * 64.0)  # so that the shortest are not rounded on their way
    keep = np.abs(directions).max(axis=1) > 0.0
    answers = QUERIES[name](cap, positions[keep], directions[keep])
    scaled = QUERIES[name](cap, positions[keep], length * directions[keep])
    same = np.isclose(scaled, answers, atol=1e-5, equal_nan=True)
    assert same.mean() > 0.99  # a view on the edge of a sphere may change sides by rounding
    assert np.isfinite(answers).any()


@pytest.mark.parametrize("name", QUERIES)
@pytest.mark.parametrize(
    ("position", "direction", "told"),
    [
        ((0, 0, 0), (0, 0, 0), r"view 2: direction \(0, 0, 0\)"),
        ((0, 0, 0), (0, np.nan, 1), r"view 2: direction \(0, nan, 1\)"),
        ((0, 0, 0), (np.inf, 0, 1), r"view 2: direction \(inf, 0, 1\)"),
        ((0, -np.inf, 0), (0, 0, 1), r"view 2: position \(0, -inf, 0\)"),
        ((np.nan, 0, 0), (0, 0, 1), r"view 2: position \(nan, 0, 0\)"),
    ],
)
def test_no_query_answers_what_is_no_view(cap, name, position, direction, told):
    positions, directions = views(cap, 4, 8)
    positions[2], directions[2] = position, direction
    if name == "placements":  # base poses turn views, which leaves of them what it leaves
        told = "view 2: "
    with pytest.raises(ValueError, match=told):
        QUERIES[name](cap, positions, directions)


@given(st.lists(st.tuples(*[st.floats(allow_nan=True, allow_infinity=True)] * 6), min_size=0, max_size=20))
@settings(max_examples=200, deadline=None)
def test_any_numbers_get_an_answer_between_0_and_1_or_are_refused(cap, rows):
    numbers = np.array(rows, float).reshape(-1, 6)
    good = np.isfinite(numbers).all(axis=1) & (numbers[:, 3:] != 0.0).any(axis=1)
    for interpolate in (True, False):
        answers = cap.query(numbers[good, :3], numbers[good, 3:], interpolate)
        assert answers.shape == (good.sum(),)
        assert ((answers >= 0.0) & (answers <= 1.0 + 1e-6)).all()
        if not good.all():
            with pytest.raises(ValueError, match=f"view {int(np.argmin(good))}: "):
                cap.query(numbers[:, :3], numbers[:, 3:], interpolate)


def test_wrong_shapes_are_refused(cap):
    with pytest.raises(ValueError, match=r"\(N, 3\)"):
        cap.query(np.zeros((2, 3)), np.zeros((3, 3)))
    with pytest.raises(CapabilityMapError, match=r"\(N, 4, 4\)"):
        cap.query_poses(np.eye(4))


def test_index_is_the_share_of_valid_points(cap):
    assert np.allclose(cap.index(), [100.0 * row.sum() / len(row) for row in cap.valid])
    assert (cap.index() > 0.0).all()


def test_seeds_hold_nearly_the_view(cap, arm):
    positions, directions = views(cap, 300, 3)
    held = cap.query(positions, directions) > 0.9
    assert held.sum() > 5
    q, angles = cap.seeds(positions[held], directions[held])
    known = np.isfinite(angles)
    assert known.mean() > 0.9
    T = arm.model().tip_pose("arm", q[known])
    spacing = np.sqrt(4.0 * np.pi / len(cap.directions))
    assert np.median(np.linalg.norm(T[:, :3, 3] - positions[held][known], axis=1)) < 3.0 * cap.radius
    assert np.median(angles[known]) < spacing
    q, angles = cap.seeds(np.full((1, 3), 100.0), np.array([[0.0, 0.0, 1.0]]))
    assert np.isnan(q).all() and np.isnan(angles).all()


def test_base_poses_are_those_from_which_all_views_can_be_held(cap):
    positions, directions = views(cap, 400, 4)
    keep = np.flatnonzero(cap.reachable(positions, directions))[:2]
    identity_first = np.concatenate(
        [np.eye(4)[None], placement.base_grid(np.linspace(-3, 3, 7), np.zeros(1), np.zeros(1))]
    )
    table = placement.placements(cap, identity_first, positions[keep], directions[keep])
    for b, T in enumerate(identity_first):
        local = (positions[keep] - T[:3, 3]) @ T[:3, :3]
        assert np.array_equal(table[b], cap.query(local, directions[keep] @ T[:3, :3]))
    rows, worst = placement.base_poses_for(cap, identity_first, positions[keep], directions[keep])
    assert 0 in rows
    assert (np.diff(worst) <= 0).all()
    assert set(rows) == set(np.flatnonzero(table.min(axis=1) >= cap.threshold))
    with pytest.raises(CapabilityMapError, match=r"\(B, 4, 4\)"):
        placement.placements(cap, np.eye(4), positions, directions)


def test_turning_robot_and_views_together_changes_nothing(cap):
    positions, directions = views(cap, 100, 5)
    T = placement.base_grid(np.array([0.4]), np.array([-0.2]), np.array([0.9]), z_m=0.3)
    world = positions @ T[0, :3, :3].T + T[0, :3, 3]
    answers = placement.placements(cap, T, world, directions @ T[0, :3, :3].T)
    assert np.allclose(answers[0], cap.query(positions, directions), atol=1e-4)


# Shapes ----------------------------------------------------------------------------------------------------------


def cap_flags(outward, axis, opening):
    return np.arccos(np.clip(outward @ axis, -1, 1)) <= opening


def test_clean_shapes_are_recognised():
    outward = spiral_points(400)
    axis = np.array([0.6, 0.0, 0.8])
    angle = np.arccos(np.clip(outward @ axis, -1, 1))
    folded = np.minimum(angle, np.pi - angle)
    valid = np.stack([angle < 0.7, folded < 0.6, folded > 1.1, np.zeros(400, bool), np.ones(400, bool)])
    for least_error in (False, True):
        fitted = fit_shapes(outward, valid, least_error)
        assert fitted["type"].tolist() == [1, 2, 3, 0, 1]
        assert (fitted["error_percent"] < 6.0).all()
        assert np.abs(fitted["axis"][0] @ axis) > 0.99
        assert fitted["error_percent"][3] == 0.0
        assert fitted["error_percent"][4] == 0.0


def test_least_error_is_the_best_opening_of_all():
    outward = spiral_points(150)
    random = np.random.default_rng(0)
    for _ in range(20):
        axis = random.normal(size=3)
        valid = cap_flags(outward, axis / np.linalg.norm(axis), random.uniform(0.3, 2.0)) ^ (
            random.random(150) < 0.1
        )
        if not valid.any():
            continue
        best = fit_shapes(outward, valid[None], True)
        covering = fit_shapes(outward, valid[None], False)
        assert best["error_percent"][0] <= covering["error_percent"][0] + 1e-5
        kind, a = best["type"][0], best["axis"][0].astype(float)
        angle = np.arccos(np.clip(outward @ a, -1, 1))
        folded = np.minimum(angle, np.pi - angle)
        tries = np.linspace(-0.01, np.pi + 0.01, 2000)
        covers = {
            1: angle[None] <= tries[:, None],
            2: folded[None] <= tries[:, None],
            3: folded[None] >= tries[:, None],
        }
        errors = np.minimum(100.0, 100.0 * (covers[int(kind)] != valid).sum(axis=1) / valid.sum())
        assert best["error_percent"][0] <= errors.min() + 1e-3


def test_covering_shapes_cover_every_valid_point(cap):
    sphere, point = np.nonzero(cap.valid)
    assert shapes.covered(cap.data.shapes, "cover_all", sphere, cap.directions[point]).all()


def test_reports_name_both_rules(cap):
    text = shapes.report(cap.data.shapes)
    assert "cover_all" in text and "least_error" in text


def test_spiral_points_are_spread_evenly():
    points = spiral_points(200)
    assert np.allclose(np.linalg.norm(points, axis=1), 1.0)
    assert np.linalg.norm(points.mean(axis=0)) < 0.01
    cosines = points @ points.T - 2.0 * np.eye(200)
    nearest = np.arccos(cosines.max(axis=1))
    assert nearest.min() > 0.5 * np.median(nearest)
    with pytest.raises(ValueError, match="at least 4"):
        spiral_points(3)


def test_pictures_and_markers_share_geometry_that_fits_the_map(cap):
    rows = cut_rows(cap, 2)
    assert len(rows) > 0
    lines, owners = spikes(cap, rows)
    assert len(lines) == 2 * cap.valid[rows].sum() == 2 * len(owners)
    triangles, owners = shape_triangles(cap, rows)
    assert len(triangles) == 3 * len(owners)
    away = np.linalg.norm(triangles.reshape(-1, 3, 3) - cap.centres[owners][:, None], axis=2)
    assert away.max() <= cap.radius * 1.001


def test_two_rows_lie_above_each_other_at_the_shoulder(cap):
    rows = cap.centres[two_rows(cap)]
    assert np.abs(rows[:, 1] - cap.data.reach_center_m[1]).max() <= cap.radius * (1.0 + 1e-9)
    assert len(np.unique(rows[:, 2].round(9))) in (
        2,
        3,
        4,
    )  # a layer on each side where the shoulder lies between two


def test_the_colours_of_the_index_grow_darker_with_it():
    colors = index_colors(np.linspace(0.0, 40.0, 33), alpha=0.5)
    assert colors.shape == (33, 4)
    assert (colors[:, 3] == 0.5).all()
    linear = np.where(
        colors[:, :3] <= 0.04045, colors[:, :3] / 12.92, ((colors[:, :3] + 0.055) / 1.055) ** 2.4
    )
    assert (np.diff(linear @ [0.2126, 0.7152, 0.0722]) < 0).all()
    assert index_colors(np.zeros(2)).shape == (2, 4)
    assert len(index_colors(np.zeros(0))) == 0


def test_check_scores_count_right():
    row = check.score("m", np.array([1, 1, 0, 0], bool), np.array([1, 0, 1, 0], bool))
    assert (row.accuracy, row.found, row.false_positives) == (0.5, 0.5, 0.5)


def test_a_map_agrees_with_fresh_kinematics_where_it_is_sure(cap, arm):
    positions, directions = check.random_views(cap, 3000, 6)
    truth = check.fresh_truth(cap, arm, positions, directions, 5.0)
    answers = cap.query(positions, directions)
    assert truth[answers > 0.99].mean() > 0.9
    assert truth[answers < 0.01].mean() < 0.02


def test_the_threshold_balances_the_errors():
    random = np.random.default_rng(0)
    truth = random.random(5000) < 0.3
    answer = np.clip(np.where(truth, 0.75, 0.25) + random.normal(scale=0.1, size=5000), 0.0, 1.0)
    assert 0.4 <= check.best_threshold(answer, truth) <= 0.6
    assert check.best_threshold(answer, np.ones(5000, bool)) is None
    assert check.best_threshold(answer, np.zeros(5000, bool)) is None


def test_more_bits_than_memory_should_hold_are_refused():
    grid = _core.SphereGrid(np.zeros(3), 0.1, np.array([200, 200, 200], np.int32))
    directions = np.random.default_rng(0).normal(size=(4096, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    with pytest.raises(ValueError, match="8000000 cells with 4096 directions need more than 512 MiB"):
        _core.CapabilityQuery(
            grid, directions, np.full(8_000_000, -1, np.int32), np.zeros(0, np.uint64), 0.0, np.zeros(3)
        )
