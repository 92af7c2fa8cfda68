"""Configuration: the YAML shows the dataclass's names and defaults, wrong keys are named."""

import dataclasses
from pathlib import Path

import pytest
import yaml

from fv_common.schema import from_mapping
from fv_viz.config import ScreenshotConfig, VizConfig

FOLDER = Path(__file__).parent.parent / "config"


@pytest.mark.parametrize(("name", "kind"), [("viz", VizConfig), ("screenshot", ScreenshotConfig)])
def test_the_yaml_shows_every_name_and_default(name, kind):
    shown = yaml.safe_load((FOLDER / f"{name}.yaml").read_text())
    assert shown == dataclasses.asdict(kind())
    assert from_mapping(kind, shown, "parameters") == kind()


@pytest.mark.parametrize(
    ("params", "word"),
    [
        ({"ghost": 3}, "ghost"),
        ({"ghosts": "3"}, "ghosts"),
        ({"ghosts": -1}, "ghosts"),
        ({"free_alpha": 1.5}, "free_alpha"),
        ({"utility_scale": "rainbow"}, "utility_scale"),
        ({"view_size_m": 0}, "view_size_m"),
        ({"block_voxels": True}, "block_voxels"),
    ],
)
def test_a_bad_parameter_is_named(params, word):
    with pytest.raises(ValueError, match=word):
        from_mapping(VizConfig, params, "parameters")


def test_an_integer_will_do_for_a_length():
    assert from_mapping(VizConfig, {"view_size_m": 1}, "parameters").view_size_m == 1.0
