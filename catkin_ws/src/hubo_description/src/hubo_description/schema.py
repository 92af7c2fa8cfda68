"""YAML mappings into dataclasses: unknown, missing and ill-typed keys are errors that name the key."""

from __future__ import annotations

import dataclasses
import difflib
import math
import re
import types
import typing
from pathlib import Path

from hubo_description.errors import RobotDescriptionError
from hubo_description.files import read_yaml_file

T = typing.TypeVar("T")
_ROS_NAME = re.compile(r"[A-Za-z_]\w*(/[A-Za-z_]\w*)*", re.ASCII)
UNITS = ("m", "mm", "cm", "rad", "deg", "s", "ms", "hz", "px")  # suffixes of keys


def read_yaml(path: Path) -> dict:
    """Return the mapping in a YAML file.

    :raises RobotDescriptionError: the file is missing, is no YAML (or grows too large), or holds no mapping.
    """
    return require_mapping(read_yaml_file(path), str(path))


def require_mapping(data: object, where: str) -> dict:
    """Return data if it is a mapping with string keys.

    :raises RobotDescriptionError: otherwise.
    """
    if not isinstance(data, dict) or not all(isinstance(key, str) for key in data):
        raise RobotDescriptionError(f"{where}: expected a mapping with names as keys, got {data!r:.80}")
    return data


def require_ros_name(name: str, where: str) -> None:
    """Raise a RobotDescriptionError for a name that ROS would not take for a topic or a parameter."""
    if not _ROS_NAME.fullmatch(name):
        raise RobotDescriptionError(
            f"{where}: '{name}' is no name in ROS; valid: letters, digits and _, in parts that begin with a letter or "
            "_ and are joined by /"
        )


def reject_unknown(keys: typing.Iterable[str], valid: typing.Iterable[str], where: str) -> None:
    """Raise a RobotDescriptionError for the first key that is not valid; it lists the valid keys.

    A key that differs from a valid one by its unit suffix alone (``min_range`` for ``min_range_m``) is named as such.
    """
    valid = list(valid)
    for key in keys:
        if key not in valid:
            raise RobotDescriptionError(
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
    :raises RobotDescriptionError: unknown, missing or ill-typed key, or a value that cls itself refuses.
    """
    mapping = require_mapping(data, where)
    fields = {field.name: field for field in dataclasses.fields(cls) if field.init}
    reject_unknown(mapping, fields, where)
    missing = [name for name, field in fields.items() if name not in mapping and not _has_default(field)]
    if missing:
        raise RobotDescriptionError(f"{where}: missing key '{missing[0]}'; valid keys: {', '.join(fields)}")
    hints = typing.get_type_hints(cls)
    values = {key: convert(hints[key], value, f"{where}: {key}") for key, value in mapping.items()}
    try:
        return cls(**values)
    except ValueError as err:
        raise RobotDescriptionError(f"{where}: {err}") from err


def _has_default(field: dataclasses.Field) -> bool:
    return field.default is not dataclasses.MISSING or field.default_factory is not dataclasses.MISSING


def convert(hint: object, value: object, where: str) -> object:
    """Return value as the annotated type.

    :raises RobotDescriptionError: the value is of another type, or a number is not finite.
    """
    if dataclasses.is_dataclass(hint):
        return from_mapping(hint, value, where)
    origin = typing.get_origin(hint)
    if origin in (typing.Union, types.UnionType):
        inner = [arg for arg in typing.get_args(hint) if arg is not type(None)]
        return None if value is None else convert(inner[0], value, where)
    if origin in (list, tuple):
        return _convert_sequence(hint, value, where)
    if hint is typing.Any:
        return value
    if origin is dict:
        item = typing.get_args(hint)[1]
        return {
            key: convert(item, part, f"{where}: {key}") for key, part in require_mapping(value, where).items()
        }
    return _convert_scalar(hint, value, where)


def _convert_sequence(hint: object, value: object, where: str) -> object:
    args = typing.get_args(hint)
    if not isinstance(value, list | tuple):
        raise RobotDescriptionError(f"{where}: expected a list, got {value!r}")
    if typing.get_origin(hint) is list:
        return [convert(args[0], item, f"{where}[{k}]") for k, item in enumerate(value)]
    if len(value) != len(args):
        raise RobotDescriptionError(f"{where}: expected {len(args)} numbers, got {value!r}")
    return tuple(
        convert(arg, item, f"{where}[{k}]") for k, (arg, item) in enumerate(zip(args, value, strict=True))
    )


def _convert_scalar(hint: object, value: object, where: str) -> object:
    if hint is float and isinstance(value, int | float) and not isinstance(value, bool):
        if not math.isfinite(value):
            raise RobotDescriptionError(f"{where}: expected a finite number, got {value!r}")
        return float(value)
    if hint in (int, str, bool) and type(value) is hint:
        return value
    raise RobotDescriptionError(f"{where}: expected {getattr(hint, '__name__', hint)}, got {value!r}")
