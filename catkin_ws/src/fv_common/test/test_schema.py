"""Mappings into dataclasses: what annotations say is what is taken, and each error says what would have been."""

import dataclasses
import math
from pathlib import Path
from typing import Annotated, Any

import pytest

from fv_common.errors import ConfigError, UserError, told_as
from fv_common.schema import (
    AtLeastOne,
    Config,
    Name,
    OneOf,
    Positive,
    Range,
    Seed,
    Share,
    from_mapping,
    number,
    read_mapping,
)


@dataclasses.dataclass(frozen=True)
class Lens(Config):
    fov_deg: Annotated[float, Range(low=0, below=180, unit="deg")]
    center_m: tuple[float, Positive, float] = (0.0, 1.0, 0.0)


@dataclasses.dataclass(frozen=True)
class Camera(Config):
    lens: Lens
    renderer: Annotated[str, OneOf("auto", "egl")] = "auto"
    rounds: Annotated[int, Range(1, 100)] = 1
    share: Share = 1.0
    chance: Annotated[float, Range(above=0, below=1)] = 0.5
    radius_m: Annotated[float | None, Range(above=0)] = None
    scale: Positive | tuple[Positive, Positive] = 1.0
    topic: Name = "/points"
    on: bool = True
    free: float = 0.0
    names: list[Name] = dataclasses.field(default_factory=list)
    gains: dict[str, dict[str, Positive]] = dataclasses.field(default_factory=dict)
    anything: object = None
    any_value: Any = None
    min_range_m: float = 0.0
    max_range_m: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.min_range_m >= self.max_range_m:
            raise ValueError(
                f"needs min_range_m < max_range_m, got {self.min_range_m} and {self.max_range_m}"
            )


GOOD = {"lens": {"fov_deg": 60}}


def test_types_follow_the_annotations():
    camera = from_mapping(
        Camera,
        {
            **GOOD,
            "names": ("a", "b"),
            "gains": {"j": {"p": 3}},
            "radius_m": None,
            "anything": [{}],
            "any_value": "x",
        },
        "file.yaml",
    )
    assert camera == Camera(
        Lens(60.0), names=["a", "b"], gains={"j": {"p": 3.0}}, anything=[{}], any_value="x"
    )
    assert type(camera.lens.fov_deg) is float and type(camera.gains["j"]["p"]) is float
    assert from_mapping(Camera, {**GOOD, "radius_m": 2}, "").radius_m == 2.0
    assert from_mapping(Camera, {**GOOD, "scale": [1, 2]}, "").scale == (1.0, 2.0)


BAD = {
    "unknown key": (
        {"ronuds": 3},
        r"unknown key 'ronuds' \(did you mean 'rounds'\?\); valid keys: lens, renderer",
    ),
    "unit of a key": (
        {"radius": 3},
        r"unknown key 'radius' \(did you mean 'radius_m'\? the unit is part of the key",
    ),
    "text for number": ({"share": "much"}, r"share is 'much'; valid: a number, 0 to 1$"),
    "bool for number": ({"free": True}, r"free is True; valid: a number$"),
    "bool for whole number": ({"rounds": True}, r"rounds is True; valid: a whole number, 1 to 100$"),
    "part of a whole number": ({"rounds": 2.5}, r"rounds is 2.5; valid: a whole number, 1 to 100$"),
    "number for bool": ({"on": 1}, r"on is 1; valid: true or false$"),
    "number for text": ({"topic": 1}, r"topic is 1; valid: a text, not empty$"),
    "empty text": ({"topic": ""}, r"topic is ''; valid: a text, not empty$"),
    "choice": ({"renderer": "Egl"}, r"renderer is 'Egl'; valid: one of auto, egl$"),
    "type of a choice": ({"renderer": 3}, r"renderer is 3; valid: one of auto, egl$"),
    "nan": ({"share": math.nan}, r"share is nan; valid: a number, 0 to 1$"),
    "inf": ({"free": math.inf}, r"free is inf; valid: a number$"),
    "more than a float holds": ({"free": 10**400}, r"free is 10+; valid: a number$"),
    "below": ({"rounds": 0}, r"rounds is 0; valid"),
    "beyond": ({"rounds": 101}, r"rounds is 101; valid"),
    "open end": ({"chance": 1}, r"chance is 1; valid: a number, above 0, below 1$"),
    "other open end": ({"chance": 0}, r"chance is 0; valid"),
    "mixed ends": (
        {"lens": {"fov_deg": 180}},
        r"lens: fov_deg is 180; valid: a number, 0 or more, below 180 \[deg\]$",
    ),
    "optional": ({"radius_m": 0}, r"radius_m is 0; valid: a number, above 0$"),
    "neither of two": (
        {"scale": "x"},
        r"scale is 'x'; valid: a number, above 0 or a list of 2, each a number, above 0$",
    ),
    "second of two": ({"scale": [1, 0]}, r"scale\[1\] is 0; valid: a number, above 0$"),
    "part of a vector": (
        {"lens": {"fov_deg": 1, "center_m": [0, 0, 0]}},
        r"lens: center_m\[1\] is 0; valid: a number, above 0$",
    ),
    "length of a vector": (
        {"lens": {"fov_deg": 1, "center_m": [0, 1]}},
        r"lens: center_m is \[0, 1\]; valid: a list of 3, each a number$",
    ),
    "part of a list": ({"names": ["a", ""]}, r"names\[1\] is ''; valid: a text, not empty$"),
    "no list": ({"names": "a"}, r"names is 'a'; valid: a list$"),
    "deep in a mapping": ({"gains": {"j": {"p": -1}}}, r"gains: j: p is -1; valid: a number, above 0$"),
    "no mapping": ({"gains": 3}, r"gains: expected a mapping"),
    "missing": ({"lens": {}}, r"lens: missing key 'fov_deg'; valid keys: fov_deg, center_m$"),
    "two keys that do not fit": ({"min_range_m": 2}, r"needs min_range_m < max_range_m, got 2.0 and 1.0$"),
}


@pytest.mark.parametrize(("given", "words"), BAD.values(), ids=BAD)
def test_what_is_wrong_is_named_with_what_is_valid(given, words):
    with pytest.raises(ConfigError, match=rf"^file\.yaml: {words}"):
        from_mapping(Camera, GOOD | given, "file.yaml")


def test_a_config_made_by_hand_is_checked_too():
    with pytest.raises(ConfigError, match=r"^rounds is 0; valid: a whole number, 1 to 100$"):
        Camera(Lens(1.0), rounds=0)


@pytest.mark.parametrize("value", [0, 1, 0.25])
def test_ends_are_included(value):
    assert from_mapping(Camera, GOOD | {"share": value}, "").share == value


def test_numbers_and_seeds():
    assert number(3, "x") == 3.0
    with pytest.raises(ConfigError, match=r"^x: y is 3; valid: a number, at most 2$"):
        number(3, "x: y", Range(high=2))

    @dataclasses.dataclass
    class Draw(Config):
        seed: Seed = 0
        rounds: AtLeastOne = 1

    with pytest.raises(ConfigError, match=r"seed is 2147483648; valid: a whole number, 0 to 2147483647"):
        Draw(2**31)


def test_a_package_may_promise_one_kind_of_error():
    class Own(UserError):
        pass

    @told_as(Own)
    def load() -> None:
        number("x", "file.yaml: size_m")

    with pytest.raises(Own, match=r"^file.yaml: size_m is 'x'; valid: a number$"):
        load()


def test_a_file_without_a_mapping_is_named(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text("- 1\n")
    with pytest.raises(ConfigError, match=r"a\.yaml: expected a mapping with names as keys, got \[1\]$"):
        read_mapping(path)


def test_the_example_of_the_readme_does_what_it_says():
    readme = (Path(__file__).parents[1] / "README.md").read_text()
    (example,) = [text.split("```")[0] for text in readme.split("```python\n")[1:]]
    exec(example, {"__name__": "example"})
