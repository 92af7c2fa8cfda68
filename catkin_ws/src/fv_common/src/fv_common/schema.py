"""YAML mappings into dataclasses; each error names the file, the key, the value, and what would be valid.

A field's annotation says once what is valid: ``min_fit: Annotated[float, Range(above=0, high=1)] = 0.5``; README.md has
an example.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
import re
import types
import typing
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, TypeVar

from fv_common.errors import ConfigError
from fv_common.yaml_file import read_yaml

T = TypeVar("T")
_ROS_NAME = re.compile(r"[A-Za-z_]\w*(/[A-Za-z_]\w*)*", re.ASCII)
UNITS = ("m", "mm", "cm", "rad", "deg", "s", "ms", "hz", "px")  # suffixes of keys
_WORDS = {float: "a number", int: "a whole number", str: "a text", bool: "true or false", list: "a list"}


class Rule(typing.Protocol):
    """What a value must be beyond its type; stands in an Annotated beside it."""

    def admits(self, value: typing.Any) -> bool:
        """Whether the value, which has the right type already, is valid."""

    def words(self, kind: str) -> str:
        """What is valid, of values whose type is told as ``kind``."""


@dataclasses.dataclass(frozen=True)
class Range:
    """Numbers from ``low`` to ``high``, ends included, and ``above`` and ``below`` others, which are not."""

    low: float = -math.inf
    high: float = math.inf
    above: float = -math.inf
    below: float = math.inf
    unit: str = ""

    def admits(self, value: float) -> bool:
        """Whether a number is in the range."""
        above, below = value > self.above or math.isinf(self.above), value < self.below
        return self.low <= value <= self.high and above and below

    def words(self, kind: str) -> str:
        """Such as ``a number, 0 to 1 [m]``."""
        unit = f" [{self.unit}]" if self.unit else ""
        if math.isfinite(self.low) and math.isfinite(self.high):
            return f"{kind}, {self.low:.15g} to {self.high:.15g}{unit}"
        ends = {f"{self.low:.15g} or more": self.low, f"above {self.above:.15g}": self.above}
        ends |= {f"at most {self.high:.15g}": self.high, f"below {self.below:.15g}": self.below}
        return ", ".join([kind, *(text for text, end in ends.items() if math.isfinite(end))]) + unit


class OneOf:
    """One of some names."""

    def __init__(self, *names: str) -> None:
        self.names = names

    def admits(self, value: str) -> bool:
        """Whether it is one of them."""
        return value in self.names

    def words(self, _kind: str) -> str:
        """The names."""
        return f"one of {', '.join(self.names)}"


class NotEmpty:
    """A text or a list with something in it."""

    def admits(self, value: typing.Sized) -> bool:
        """Whether there is something in it."""
        return len(value) > 0

    def words(self, kind: str) -> str:
        """That it must not be empty."""
        return f"{kind}, not empty"


Positive = Annotated[float, Range(above=0)]
NotNegative = Annotated[float, Range(0)]
Share = Annotated[float, Range(0, 1)]
LARGEST_WHOLE = 2**31 - 1  # as much as the parameter server holds
Count = Annotated[int, Range(0, LARGEST_WHOLE)]
AtLeastOne = Annotated[int, Range(1, LARGEST_WHOLE)]
Seed = Count
Name = Annotated[str, NotEmpty()]
Vector3 = tuple[float, float, float]


class Config:
    """Base of dataclasses whose values are checked however they are made.

    :raises ConfigError: on construction, for a value that its annotation refuses.
    """

    def __post_init__(self) -> None:
        for name, hint in _hints(type(self)).items():
            _convert(hint, getattr(self, name), name)


def read_mapping(path: Path) -> dict[str, object]:
    """Return the mapping in a YAML file.

    :raises ConfigError: the file is missing, is no YAML (or grows too large), or holds no mapping.
    """
    return require_mapping(read_yaml(path), str(path))


def require_mapping(data: object, where: str) -> dict[str, typing.Any]:
    """Return data if it is a mapping with string keys.

    :raises ConfigError: otherwise.
    """
    if not isinstance(data, dict) or not all(isinstance(key, str) for key in data):
        raise ConfigError(f"{where}: expected a mapping with names as keys, got {data!r:.80}")
    return data


def require_ros_name(name: str, where: str) -> None:
    """Raise a ConfigError for a name that ROS would not take for a topic or a parameter."""
    if not _ROS_NAME.fullmatch(name):
        raise ConfigError(
            f"{where}: '{name}' is no name in ROS; valid: letters, digits and _, in parts that begin with a letter or "
            "_ and are joined by /"
        )


def reject_unknown(keys: Iterable[str], valid: Iterable[str], where: str) -> None:
    """Raise a ConfigError for the first key that is not valid; it lists the valid keys.

    A key that differs from a valid one by its unit suffix alone (``min_range`` for ``min_range_m``) is named as such.
    """
    valid = list(valid)
    for key in keys:
        if key not in valid:
            raise ConfigError(
                f"{where}: unknown key '{key}'{_hint(key, valid)}; valid keys: {', '.join(valid)}"
            )


def _hint(key: str, valid: list[str]) -> str:
    """Return what the writer may have meant: the same name with the right unit, else the most similar one."""
    stem = _without_unit(key)
    for name in valid:
        if _without_unit(name) == stem:
            return f" (did you mean '{name}'? the unit is part of the key)"
    close = difflib.get_close_matches(key, valid, n=1)
    return f" (did you mean '{close[0]}'?)" if close else ""


def _without_unit(key: str) -> str:
    stem, _, unit = key.rpartition("_")
    return stem if stem and unit in UNITS else key


def from_mapping(cls: type[T], data: object, where: str) -> T:
    """Build the dataclass cls from a mapping; nested dataclasses, lists and vectors follow its annotations.

    :param where: what the mapping is, for messages, e.g. ``sensors.yaml: hand_camera``.
    :raises ConfigError: unknown, missing or ill-typed key, or a value that its annotation or cls itself refuses.
    """
    mapping, hints = require_mapping(data, where), _hints(cls)
    reject_unknown(mapping, hints, where)
    for field in dataclasses.fields(cls):  # type: ignore[arg-type]
        if field.init and field.name not in mapping and not _has_default(field):
            raise ConfigError(f"{where}: missing key '{field.name}'; valid keys: {', '.join(hints)}")
    values = {key: _convert(hints[key], value, f"{where}: {key}") for key, value in mapping.items()}
    try:
        return cls(**values)
    except ValueError as err:
        raise ConfigError(f"{where}: {err}") from err


def number(value: object, where: str, valid: Range | None = None) -> float:
    """Return a finite number within a range.

    :raises ConfigError: it is none; the text begins with ``where``.
    """
    return float(_convert(Annotated[float, valid or Range()], value, where))


def _hints(cls: type) -> dict[str, typing.Any]:
    """The annotations of a dataclass's fields by the names that its constructor takes."""
    hints = typing.get_type_hints(cls, include_extras=True)
    return {field.name: hints[field.name] for field in dataclasses.fields(cls) if field.init}


def _has_default(field: dataclasses.Field[typing.Any]) -> bool:
    return field.default is not dataclasses.MISSING or field.default_factory is not dataclasses.MISSING


def _convert(hint: typing.Any, value: object, where: str, said: typing.Any = None) -> typing.Any:
    """Return value as the annotated type. Errors as from_mapping.

    :param said: all that is said of the value where the hint is a part of that; for messages.
    """
    kind, args, said = typing.get_origin(hint), typing.get_args(hint), said or hint
    if kind is Annotated:
        result = _convert(args[0], value, where, said)
        if result is not None and not hint.__metadata__[0].admits(result):
            raise _refused(said, value, where)
        return result
    if kind in (typing.Union, types.UnionType):
        return None if value is None else _convert(_alternative(args, value), value, where, said)
    if dataclasses.is_dataclass(hint):
        kind = typing.cast(type, hint)
        return value if isinstance(value, kind) else from_mapping(kind, value, where)
    if kind is dict:
        items = require_mapping(value, where).items()
        return {key: _convert(args[1], part, f"{where}: {key}") for key, part in items}
    if kind in (list, tuple):
        return _convert_sequence(hint, value, where, said)
    if hint in (object, typing.Any) or (hint in (int, str, bool) and type(value) is hint):
        return value
    if hint is float and _is_number(value):
        return float(typing.cast(float, value))
    raise _refused(said, value, where)


def _convert_sequence(hint: typing.Any, value: object, where: str, said: typing.Any) -> typing.Any:
    kind, args = typing.get_origin(hint), typing.get_args(hint)
    if not isinstance(value, list | tuple) or (kind is tuple and len(value) != len(args)):
        raise _refused(said, value, where)
    hints = args if kind is tuple else args * len(value)
    return kind(_convert(hints[k], part, f"{where}[{k}]") for k, part in enumerate(value))


def _is_number(value: object) -> bool:
    """Whether it is one that a float can hold; True and False are none."""
    whole = isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**1023
    return whole or (isinstance(value, float) and math.isfinite(value))


def _refused(hint: typing.Any, value: object, where: str) -> ConfigError:
    return ConfigError(f"{where} is {value!r:.80}; valid: {_valid(hint)}")


def _valid(hint: typing.Any) -> str:
    """What an annotation admits, in words."""
    kind, args = typing.get_origin(hint), typing.get_args(hint)
    if kind is Annotated:
        return str(hint.__metadata__[0].words(_valid(args[0])))
    if kind in (typing.Union, types.UnionType):
        return " or ".join(_valid(arg) for arg in args if arg is not type(None))
    if kind is tuple:
        return f"a list of {len(args)}, each {_valid(args[0])}"
    return _WORDS.get(kind or hint, f"a {getattr(hint, '__name__', hint)}")


def _alternative(args: tuple[typing.Any, ...], value: object) -> typing.Any:
    """Which of a union's types a value is to be: for a list one of lists, else the first one."""
    given = [arg for arg in args if arg is not type(None)]
    lists = [arg for arg in given if typing.get_origin(arg) in (list, tuple)]
    return lists[0] if lists and isinstance(value, list | tuple) else given[0]
