"""The camera that frames points."""

import numpy as np
import pytest

from fv_viz.drawing import framing


def on_screen(points, camera):
    """Picture coordinates (N, 2), -1..1 in height, of points seen by an orbit camera; plain look-at mathematics."""
    distance, yaw, pitch, *focus = camera[:6]
    away = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)])
    eye = np.array(focus) + distance * away
    right = np.cross(-away, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, -away)
    rays = points - eye
    depth = rays @ -away
    assert (depth > 0).all()
    return np.column_stack([rays @ right, rays @ up]) / depth[:, None] / np.tan(np.deg2rad(22.5))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("aspect", [0.7, 1.0, 1.6])
def test_all_points_are_inside_and_touch_two_opposite_sides(seed, aspect):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(40, 3)) * rng.uniform(0.2, 4.0, 3) + rng.uniform(-5, 5, 3)
    camera = framing.orbit(points, rng.uniform(-3, 3), rng.uniform(-1.4, 1.4), aspect)
    seen = on_screen(points, camera) / [aspect, 1.0]
    extent = np.sort(np.ptp(seen, axis=0))
    assert np.abs(seen).max() <= framing.MARGIN + 1e-9
    assert extent[1] == pytest.approx(2 * framing.MARGIN)


def test_the_cut_is_measured_from_the_middle():
    points = framing.corners([0, 0, 0], [2, 2, 2])
    camera = framing.orbit(points, 0.3, 0.2, 1.3, cut_m=0.5)
    assert camera[0] - camera[6] == pytest.approx(0.5)
    assert framing.orbit(points, 0.3, 0.2, 1.3)[6] == 0.01


def test_a_single_point_still_has_a_camera():
    assert framing.orbit(np.ones((1, 3)), 0.0, 0.5, 1.3)[0] > 0.0
