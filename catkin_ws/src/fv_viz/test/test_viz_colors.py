"""Colours stay apart for those who see less of them."""

import numpy as np
import pytest

from fv_viz.drawing import colors

# Severe deuteranomaly and protanomaly (severity 1.0), Machado, Oliveira, Fernandes 2009, table 1; linear RGB.
DEUTAN = np.array(
    [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
)
PROTAN = np.array(
    [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
)
NORMAL = np.eye(3)


def lightness(rgb, sight):
    """CIE L* (N,) of sRGB colours (N, 3) as seen."""
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4) @ sight.T
    luminance = np.clip(linear, 0, 1) @ np.array([0.2126, 0.7152, 0.0722])
    return 116 * np.cbrt(np.maximum(luminance, 0.008856)) - 16


@pytest.mark.parametrize("name", list(colors.SCALES))
@pytest.mark.parametrize("sight", [NORMAL, DEUTAN, PROTAN], ids=["normal", "deutan", "protan"])
def test_scales_change_lightness_in_one_direction(name, sight):
    steps = np.diff(lightness(colors.scale(name, np.linspace(0, 1, 33)), sight))
    assert (steps > 0).all() or (steps < 0).all()


def test_utility_runs_from_green_to_red():
    low, high = colors.scale("green_red", np.array([0.0, 1.0]))
    assert low.argmax() == 1
    assert high.argmax() == 0


def test_values_outside_and_nan_are_clipped():
    out = colors.scale("viridis", np.array([-1.0, np.nan, 2.0]))
    np.testing.assert_allclose(out[0], out[1])
    np.testing.assert_allclose(out[2], np.array([253, 231, 37]) / 255, atol=1e-6)


def test_neighbouring_labels_look_different():
    table = colors.distinct(40)
    assert np.linalg.norm(np.diff(table, axis=0), axis=1).min() > 0.3


def test_unknown_names_list_the_known():
    with pytest.raises(KeyError, match="frontier"):
        colors.rgb("nothing")
    with pytest.raises(KeyError, match="viridis"):
        colors.scale("nothing", np.zeros(1))
