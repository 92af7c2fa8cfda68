"""Properties that hold for every shape, searched by hypothesis."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from fv_robot_model import Shape, sphere_cover

SIZE = st.floats(0.01, 2.0)
COORDINATE = st.floats(-3.0, 3.0)
POINT = st.tuples(COORDINATE, COORDINATE, COORDINATE)


@st.composite
def hulls(draw: st.DrawFn) -> Shape:
    """Hull of a few points that are not nearly in one plane."""
    points = np.array(draw(st.lists(POINT, min_size=4, max_size=12)))
    assume(np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[2] > 1e-2)
    return Shape.convex_hull(points)


SHAPES = st.one_of(
    st.builds(lambda x, y, z: Shape.box([x, y, z]), SIZE, SIZE, SIZE),
    st.builds(Shape.cylinder, SIZE, SIZE),
    st.builds(Shape.sphere, SIZE),
    hulls(),
)


@settings(max_examples=300, deadline=None)
@given(SHAPES, POINT, POINT)
def test_distance_changes_no_faster_than_the_point_moves(shape: Shape, a: tuple, b: tuple) -> None:
    distances = shape.signed_distance([a, b])
    assert abs(distances[0] - distances[1]) <= np.linalg.norm(np.subtract(a, b)) + 1e-9


@settings(max_examples=300, deadline=None)
@given(SHAPES, POINT)
def test_closest_point_lies_in_the_shape_at_the_distance(shape: Shape, p: tuple) -> None:
    near = shape.closest_point([p])
    assert shape.signed_distance(near)[0] <= 1e-7
    assert np.linalg.norm(near[0] - p) == pytest.approx(max(shape.signed_distance([p])[0], 0.0), abs=1e-7)


@settings(max_examples=300, deadline=None)
@given(SHAPES, POINT, st.floats(0.0, 0.5))
def test_padded_contains_what_lies_within_the_padding(shape: Shape, p: tuple, padding_m: float) -> None:
    if shape.signed_distance([p])[0] <= padding_m:
        assert shape.padded(padding_m).signed_distance([p])[0] <= 1e-7


@settings(max_examples=200, deadline=None)
@given(SHAPES, POINT, st.floats(0.1, 3.0))
def test_cover_contains_the_shape(shape: Shape, p: tuple, max_radius_m: float) -> None:
    inside = shape.closest_point([p])[0]
    balls = sphere_cover(shape, max_radius_m)
    assert (balls[:, 3] <= max_radius_m + 1e-12).all()
    assert (np.linalg.norm(balls[:, :3] - inside, axis=1) <= balls[:, 3] + 1e-9).any()


@settings(max_examples=200, deadline=None)
@given(SHAPES, POINT)
def test_bounding_sphere_contains_the_shape(shape: Shape, p: tuple) -> None:
    center, radius = shape.bounding_sphere()
    assert np.linalg.norm(shape.closest_point([p])[0] - center) <= radius + 1e-9


@settings(max_examples=100, deadline=None)
@given(SIZE, SIZE, SIZE, POINT)
def test_a_box_is_the_hull_of_its_corners(x: float, y: float, z: float, p: tuple) -> None:
    corners = np.array([[i, j, k] for i in (-x, x) for j in (-y, y) for k in (-z, z)]) / 2.0
    hull = Shape.convex_hull(corners)
    assert hull.signed_distance([p])[0] == pytest.approx(
        Shape.box([x, y, z]).signed_distance([p])[0], abs=1e-7
    )


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
def test_sizes_that_are_none_are_refused(bad: float) -> None:
    for make in (Shape.sphere, lambda r: Shape.cylinder(r, 1.0), lambda r: Shape.box([1.0, r, 1.0])):
        with pytest.raises(ValueError, match="finite and positive"):
            make(bad)


def test_points_without_a_hull_are_refused() -> None:
    for points in (np.zeros((0, 3)), np.zeros((10, 3)), np.eye(3), np.full((5, 3), np.nan)):
        with pytest.raises(ValueError, match="hull"):
            Shape.convex_hull(points)
