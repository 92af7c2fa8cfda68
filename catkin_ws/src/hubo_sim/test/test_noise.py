"""Each defect of the depth camera alone."""

import numpy as np
import pytest

from fv_common.schema import from_mapping
from hubo_sim.sensors.noise import DepthNoise, NoiseConfig
from hubo_sim.sensors.render import Pinhole

CAMERA = Pinhole(160, 120, np.radians(58.0), np.radians(45.0))
EDGE = (np.where(np.arange(160) < 80, 1.0, 2.0) * np.ones((120, 1))).astype(np.float32)
OFF = {name: {"enabled": False} for name in ("axial", "lateral", "grazing", "mixed_pixels")}


def noisy(depth, scan=0, seed=0, **parts):
    config = OFF | {name: {"enabled": True, **values} for name, values in parts.items()}
    noise = DepthNoise(from_mapping(NoiseConfig, config, "noise"), CAMERA, seed)
    return noise.apply(depth.astype(np.float32), scan)


def test_everything_off_changes_nothing():
    assert np.array_equal(noisy(EDGE), EDGE)


@pytest.mark.parametrize("depth_m", [0.5, 1.5, 3.0])
def test_axial_noise_has_the_published_spread(depth_m):
    error = noisy(np.full((120, 160), depth_m), axial={}) - depth_m
    wanted = 0.0012 + 0.0019 * (depth_m - 0.4) ** 2
    assert error.std() == pytest.approx(wanted, rel=0.05)
    assert abs(error.mean()) < 0.05 * wanted


def test_no_return_stays_no_return():
    assert np.isnan(
        noisy(np.full((120, 160), np.nan), axial={}, lateral={}, mixed_pixels={}, grazing={})
    ).all()


def test_lateral_jitter_is_felt_at_edges_only():
    changed = noisy(EDGE, lateral={"sigma_px": 0.8}) != EDGE
    assert changed[:, 78:82].any()
    assert not changed[:, :74].any() and not changed[:, 86:].any()


def test_mixed_pixels_lie_between_both_sides_of_an_edge():
    out = noisy(EDGE, mixed_pixels={"share": 0.5})
    between = (out > 1.0) & (out < 2.0)
    assert 0.3 < between[:, 79].mean() < 0.7
    assert not np.delete(between, 79, axis=1).any()


def test_grazing_surfaces_give_no_return():
    rays = CAMERA.rays()
    tilt = np.radians(85.0)
    depth = 1.0 / (np.cos(tilt) * rays[..., 2] + np.sin(tilt) * rays[..., 0])
    depth[depth <= 0] = np.nan
    lost = np.isnan(noisy(depth, grazing={"max_incidence_deg": 80.0})) & ~np.isnan(depth)
    angle = np.degrees(
        np.arccos((np.cos(tilt) + np.sin(tilt) * rays[..., 0]) / np.linalg.norm(rays, axis=-1))
    )
    inner = np.zeros(depth.shape, bool)
    inner[2:-2, 2:-2] = True
    assert lost[inner & (angle > 82.0) & (angle < 89.0) & ~np.isnan(depth)].mean() > 0.9
    assert lost[inner & (angle < 78.0)].mean() < 0.01


def test_same_seed_and_scan_repeat_and_others_differ():
    first = noisy(EDGE, scan=3, seed=1, axial={})
    assert np.array_equal(first, noisy(EDGE, scan=3, seed=1, axial={}))
    assert not np.array_equal(first, noisy(EDGE, scan=4, seed=1, axial={}))
    assert not np.array_equal(first, noisy(EDGE, scan=3, seed=2, axial={}))
