"""Capability maps as HDF5 files: the schema, writing, and reading with every doubt checked.

A file starts with a 512-byte user block, one text line `capability_map 2 sha256 <hex>`, the hash of all bytes behind
it. It is checked before the HDF5 library sees the file: a truncated or altered file is a clear error, never a crash.
README.md lists the schema.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np

from capability_map.errors import CapabilityMapError
from capability_map.shapes import RULES
from fv_common.files import write_whole

SCHEMA_VERSION = 2
DEFAULT_THRESHOLD = 0.4  # of a map that nobody calibrated
_BLOCK = 512
_MOST_CELLS = 20_000_000  # ten times what a build makes unless told otherwise
_MOST_SHRUNK = 1100  # a byte in the file may stand for 1032 by deflate, never for more
_ANY_VERSION = b"capability_map "
_MAGIC = _ANY_VERSION + f"{SCHEMA_VERSION} sha256 ".encode()


@dataclass
class MapData:
    """The content of a map file. S spheres with a valid point, N directions, V valid points, J joints."""

    robot: str
    group: str
    base_frame: str
    tip_frame: str
    urdf_sha256: str
    backend: str  # which inverse kinematics decided, and why
    parameters: dict  # BuildParameters as a mapping
    statistics: dict  # seconds, ik_calls, collision_checks, points_skipped, ...
    joint_names: list[str]
    joint_limits: np.ndarray  # (J, 2) lower, upper [rad or m]
    reach_center_m: np.ndarray  # (3,) shoulder, base frame
    arm_length_m: float
    pivot_m: float  # wrist's place on the viewing axis, behind the tip
    grid_origin_m: np.ndarray  # (3,) smallest corner
    grid_size: np.ndarray  # (3,) int32 cells
    radius_m: float
    outward: np.ndarray  # (N, 3) n-vectors
    cells: np.ndarray  # (S,) int64, ascending
    bits: np.ndarray  # (S, ceil(N / 64)) uint64
    witnesses: np.ndarray  # (V, J) uint16, share of the joint's range
    manipulability: np.ndarray  # (V,) float16
    threshold: float = DEFAULT_THRESHOLD  # an interpolated answer at or above it counts as reachable
    shapes: dict[str, np.ndarray] = field(default_factory=dict)  # see shapes.py
    symmetry: str = (
        "not recorded"  # of the first joint: how the build used it, or why not; older maps lack it
    )


_TEXTS = ("robot", "group", "base_frame", "tip_frame", "urdf_sha256", "backend")
_NUMBERS = {"arm_length_m": "m", "pivot_m": "m", "radius_m": "m", "threshold": "1"}  # and their units
_ARRAYS = {  # name: (path in the file, dtype, unit)
    "joint_limits": ("joints/limits", "f8", "rad or m"),
    "reach_center_m": ("reach_center", "f8", "m, base frame"),
    "grid_origin_m": ("grid/origin", "f8", "m, base frame"),
    "grid_size": ("grid/size", "i4", "cells"),
    "outward": ("directions/outward", "f8", "unit vectors, base frame"),
    "cells": ("spheres/cell", "i8", "cell number, z fastest"),
    "bits": ("spheres/bits", "u8", "bit k of a row: direction k is valid"),
    "witnesses": ("points/witness", "u2", "65535ths of the joint's range above its lower limit"),
    "manipulability": ("points/manipulability", "f2", "Yoshikawa, m and rad mixed"),
}


def save(path: Path, data: MapData) -> None:
    """Write a map; the file appears under its name only when it is complete.

    :raises CapabilityMapError: the folder cannot be written.
    """
    image = io.BytesIO()
    with h5py.File(image, "w", userblock_size=_BLOCK) as file:
        _write(file, data)
    content = image.getvalue()
    line = _MAGIC + hashlib.sha256(content[_BLOCK:]).hexdigest().encode() + b"\n"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, line.ljust(_BLOCK, b"\0") + content[_BLOCK:])
    except OSError as err:
        raise CapabilityMapError(f"cannot write {path}: {err}") from err


def _write(file: h5py.File, data: MapData) -> None:
    file.attrs["schema"] = "capability_map"
    file.attrs["schema_version"] = SCHEMA_VERSION
    for name in _TEXTS:
        file.attrs[name] = getattr(data, name)
    for name, unit in _NUMBERS.items():
        file.attrs[name] = float(getattr(data, name))
        file.attrs[f"{name}.unit"] = unit
    file.attrs["symmetry"] = data.symmetry
    file.attrs["parameters"] = json.dumps(data.parameters, sort_keys=True)
    file.attrs["statistics"] = json.dumps(data.statistics, sort_keys=True)
    file.attrs["joint_names"] = json.dumps(data.joint_names)
    for name, (where, dtype, unit) in _ARRAYS.items():
        _write_array(file, where, np.asarray(getattr(data, name), dtype), unit)
    for name, values in data.shapes.items():
        _write_array(file, f"shapes/{name}", values, "see README.md")


def _write_array(file: h5py.File, where: str, values: np.ndarray, unit: str) -> None:
    large = values.size > 1000
    dataset = file.create_dataset(
        where, data=values, **({"compression": 4, "shuffle": True} if large else {})
    )
    dataset.attrs["unit"] = unit


def load(path: Path) -> MapData:
    """Read and check a map.

    :raises CapabilityMapError: no such file, not a map, truncated or altered, of another schema, or its parts do not
        fit each other.
    """
    content = _verified(path)
    try:
        with h5py.File(io.BytesIO(content), "r") as file:
            data = _read(file, len(content))
    except CapabilityMapError as err:
        raise CapabilityMapError(f"{path}: {err}") from err
    except Exception as err:  # h5py raises nearly every kind of error on a file of a foreign form
        raise CapabilityMapError(f"{path} is not a capability map of schema {SCHEMA_VERSION}: {err}") from err
    _check(path, data)
    return data


def _verified(path: Path) -> bytes:
    try:
        with Path(path).open("rb") as file:
            content = file.read(_BLOCK)
            _check_magic(path, content)
            content += file.read()
    except OSError as err:
        raise CapabilityMapError(f"cannot read capability map {path}: {err.strerror}") from err
    told = content[len(_MAGIC) : len(_MAGIC) + 64]
    found = hashlib.sha256(content[_BLOCK:]).hexdigest().encode()
    if told != found or len(content) <= _BLOCK:
        raise CapabilityMapError(f"{path} is damaged: its content does not fit its checksum; build it again")
    return content


def _check_magic(path: Path, start: bytes) -> None:
    """Before the rest of another file, of whatever size, is read."""
    if start.startswith(_MAGIC):
        return
    if start.startswith(_ANY_VERSION):
        version = start[len(_ANY_VERSION) :].split(b" ", 1)[0].decode(errors="replace")
        raise CapabilityMapError(
            f"{path} is not a capability map of schema {SCHEMA_VERSION} but {version[:20]!r}; build it again"
        )
    raise CapabilityMapError(f"{path} is not a capability map (no `{_MAGIC.decode().strip()}` line in front)")


def _check_size(name: str, item: h5py.Dataset | h5py.Group, file_bytes: int) -> None:
    """Before memory is taken for what a header promises."""
    if isinstance(item, h5py.Dataset) and item.size * item.dtype.itemsize > _MOST_SHRUNK * file_bytes:
        raise CapabilityMapError(f"dataset {name} promises more numbers than a file of this size can hold")


def _read(file: h5py.File, size: int) -> MapData:
    if file.attrs.get("schema") != "capability_map" or int(file.attrs["schema_version"]) != SCHEMA_VERSION:
        raise CapabilityMapError(
            f"schema {file.attrs.get('schema')} {file.attrs.get('schema_version')}, wanted {SCHEMA_VERSION}"
        )
    file.visititems(lambda name, item: _check_size(name, item, size))
    arrays = {name: np.asarray(file[where], dtype) for name, (where, dtype, _) in _ARRAYS.items()}
    return MapData(
        **{name: str(file.attrs[name]) for name in _TEXTS},
        **{name: float(file.attrs[name]) for name in _NUMBERS},
        **{name: json.loads(file.attrs[name]) for name in ("parameters", "statistics", "joint_names")},
        **arrays,
        shapes={
            name: np.asarray(values, "i4" if name.endswith("_type") else "f8")
            for name, values in file.get("shapes", {}).items()
        },
        symmetry=str(file.attrs.get("symmetry", MapData.symmetry)),
    )


def _check(path: Path, data: MapData) -> None:
    points, joints, spheres = len(data.outward), len(data.joint_names), len(data.cells)
    valid = int(np.unpackbits(data.bits.view(np.uint8)).sum()) if data.bits.size else 0
    shapes = {
        "joint_limits": (joints, 2),
        "reach_center_m": (3,),
        "grid_origin_m": (3,),
        "grid_size": (3,),
        "outward": (points, 3),
        "cells": (spheres,),
        "bits": (spheres, (points + 63) // 64),
        "witnesses": (valid, joints),
        "manipulability": (valid,),
    }
    for name, shape in shapes.items():
        if getattr(data, name).shape != shape:
            raise CapabilityMapError(f"{path}: {name} is {getattr(data, name).shape}, wanted {shape}")
    finite = all(
        np.isfinite(getattr(data, name)).all() for name in ("outward", "joint_limits", "grid_origin_m")
    )
    cells = math.prod(data.grid_size.tolist())
    if (data.grid_size > 0).all() and cells > _MOST_CELLS:
        raise CapabilityMapError(f"{path}: its grid has {cells} cells; valid: up to {_MOST_CELLS}")
    ordered = bool((np.diff(data.cells) > 0).all()) and (
        spheres == 0 or 0 <= data.cells[0] <= data.cells[-1] < cells
    )
    if not finite or not (np.isfinite(data.radius_m) and data.radius_m > 0.0) or (data.grid_size < 1).any():
        raise CapabilityMapError(f"{path}: its grid, directions or joint limits are not finite and positive")
    if not 0.0 < data.threshold <= 1.0:
        raise CapabilityMapError(f"{path}: its threshold {data.threshold} is not in (0, 1]")
    if not ordered:
        raise CapabilityMapError(f"{path}: its cells are not ascending numbers of its grid")
    _check_shapes(path, data, spheres)
    if len(data.urdf_sha256) != 64:
        raise CapabilityMapError(f"{path}: its URDF hash is no SHA-256")


def _check_shapes(path: Path, data: MapData, spheres: int) -> None:
    wanted = {f"{rule}_{name}" for rule in RULES for name in ("type", "axis", "opening_rad", "error_percent")}
    if set(data.shapes) != wanted:
        raise CapabilityMapError(f"{path}: shapes are {sorted(data.shapes)}, wanted {sorted(wanted)}")
    for name, values in data.shapes.items():
        shape = (spheres, 3) if name.endswith("_axis") else (spheres,)
        if values.shape != shape or not np.isfinite(values).all():
            raise CapabilityMapError(
                f"{path}: shapes/{name} is {values.shape}, wanted {shape} of finite numbers"
            )
