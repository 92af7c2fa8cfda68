"""Worlds as YAML files: what stands where, where the robot stands, and what volume is to be explored."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hubo_description import RobotDescriptionError
from hubo_description.files import read_yaml_file
from hubo_sim.config import from_mapping, number
from hubo_sim.errors import SimError
from hubo_sim.paths import resolve_file, worlds_folder
from hubo_sim.transforms import from_rpy
from hubo_sim.worlds.kinds import KINDS, generate

_THIN = 1e-6  # [m] smallest size, and smallest scale
SHAPES = ("box", "cylinder", "sphere", "mesh", "urdf", "sdf")
_SHAPE_KEYS = {
    "box": ("size_m",),
    "cylinder": ("radius_m", "length_m"),
    "sphere": ("radius_m",),
    "mesh": ("file", "scale"),
    "urdf": ("file", "scale"),
    "sdf": ("file", "scale"),
}


_FAR = 1e6  # [m] or [deg]: beyond, coordinates lose the digits that physics needs


def vector(value: Any, name: str, size: int = 3, low: float = -_FAR, high: float = _FAR) -> np.ndarray:
    """`value` as a float vector (size,) within [low, high], else SimError."""
    if not isinstance(value, (list, tuple, np.ndarray)) or len(value) != size:
        raise SimError(f"{name} must be {size} numbers, got {value!r}")
    return np.array([number(v, name, low, high) for v in value])


@dataclass(frozen=True)
class Bounds:
    """Axis-aligned exploration volume, world frame [m]."""

    min_m: Any
    max_m: Any

    def __post_init__(self) -> None:
        object.__setattr__(self, "min_m", vector(self.min_m, "min_m"))
        object.__setattr__(self, "max_m", vector(self.max_m, "max_m"))
        if not np.all(self.min_m < self.max_m):
            raise SimError(f"min_m {self.min_m.tolist()} must be below max_m {self.max_m.tolist()}")


@dataclass(frozen=True)
class RobotPlace:
    """Where the robot's floor point stands in the world and where it looks."""

    position_m: Any = (0.0, 0.0, 0.0)
    yaw_deg: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "position_m", vector(self.position_m, "position_m"))
        number(self.yaw_deg, "yaw_deg")

    def base_pose(self, base_height_m: float) -> np.ndarray:
        """T_world_base (4, 4) of a robot whose base link is `base_height_m` above its floor point."""
        T = from_rpy(self.position_m, np.radians([0.0, 0.0, self.yaw_deg]))
        T[2, 3] += base_height_m
        return T


@dataclass(frozen=True)
class ViewPoint:
    """Camera of the scene's picture: horizontal field of view and where it stands, world frame."""

    eye_m: Any = (2.5, -2.5, 2.0)
    target_m: Any = (0.0, 0.0, 0.8)
    fov_deg: float = 60.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "eye_m", vector(self.eye_m, "eye_m"))
        object.__setattr__(self, "target_m", vector(self.target_m, "target_m"))
        number(self.fov_deg, "fov_deg", 5.0, 150.0)


@dataclass(frozen=True)
class WorldObject:
    """One object: a shape (see SHAPES) with a pose, a colour and, unless fixed, a mass."""

    name: str
    shape: str
    size: dict[str, Any]
    T_world_object: np.ndarray
    color: tuple[float, float, float, float]
    fixed: bool
    mass_kg: float


@dataclass(frozen=True)
class World:
    """A world file's content."""

    name: str
    description: str
    bounds: Bounds
    robot: RobotPlace = field(default_factory=RobotPlace)
    camera: ViewPoint = field(default_factory=ViewPoint)
    objects: tuple[WorldObject, ...] = ()


@dataclass(frozen=True)
class _ObjectEntry:
    """Keys of one object in a world file; exactly one of the shapes must be given."""

    name: str
    position_m: Any = (0.0, 0.0, 0.0)
    rpy_deg: Any = (0.0, 0.0, 0.0)
    color: Any = (0.7, 0.7, 0.7)
    fixed: bool = True
    mass_kg: float = 0.5
    box: Any = None
    cylinder: Any = None
    sphere: Any = None
    mesh: Any = None
    urdf: Any = None
    sdf: Any = None


def list_worlds() -> list[str]:
    """Names of the worlds that come with the package, sorted."""
    return sorted(path.stem for path in worlds_folder().glob("*.yaml"))


def load_world(name_or_path: str) -> World:
    """A world by name, by path of a YAML file, or as KIND:SEED (see worlds.kinds); without :SEED it is 0.

    Raises SimError in one line.
    """
    kind, colon, seed = name_or_path.partition(":")
    if colon or kind in KINDS:
        return _generated(kind, seed if colon else "0")
    is_path = name_or_path.endswith((".yaml", ".yml"))
    path = Path(name_or_path) if is_path else worlds_folder() / f"{name_or_path}.yaml"
    if not path.is_file():
        seeded = [f"{kind}:SEED" for kind in KINDS]
        raise SimError(
            f"unknown world {name_or_path!r}; valid: {', '.join([*list_worlds(), *seeded])}, or a path to a .yaml"
        )
    try:
        content = read_yaml_file(path)
    except RobotDescriptionError as err:
        raise SimError(str(err)) from err
    return parse_world(content, path.stem, str(path))


def _generated(kind: str, seed: str) -> World:
    if kind not in KINDS:
        raise SimError(f"unknown kind of world {kind!r}; valid: {', '.join(KINDS)}")
    if not (seed.isascii() and seed.isdigit()):
        raise SimError(f"world {kind}:{seed}: the seed must be a non-negative integer")
    return parse_world(generate(kind, int(seed)), f"{kind}_{seed}", f"{kind}:{seed}")


def parse_world(content: Any, name: str, where: str) -> World:
    """Check a world file's content. Raises SimError that starts with `where` and names the bad key."""
    if not isinstance(content, dict):
        raise SimError(f"{where}: a mapping is needed, got {type(content).__name__}")
    known = ("description", "bounds", "robot", "camera", "objects")
    unknown = [key for key in content if key not in known]
    missing = [key for key in ("description", "bounds") if key not in content]
    if unknown or missing:
        problem = (
            f"unknown key {', '.join(map(str, unknown))}" if unknown else f"missing key {', '.join(missing)}"
        )
        raise SimError(f"{where}: {problem}; known: {', '.join(known)}")
    entries = content.get("objects") or []
    if not isinstance(entries, list):
        raise SimError(f"{where}: objects must be a list")
    objects = tuple(parse_object(entry, f"{where}: object {i}") for i, entry in enumerate(entries))
    names = [o.name for o in objects]
    twice = sorted({n for n in names if names.count(n) > 1})
    if twice:
        raise SimError(f"{where}: object name used twice: {', '.join(twice)}")
    return World(
        name=name,
        description=str(content["description"]).strip(),
        bounds=from_mapping(Bounds, content["bounds"], f"{where}: bounds"),
        robot=from_mapping(RobotPlace, content.get("robot") or {}, f"{where}: robot"),
        camera=from_mapping(ViewPoint, content.get("camera") or {}, f"{where}: camera"),
        objects=objects,
    )


def parse_object(content: Any, where: str) -> WorldObject:
    """One object of a world file (see _ObjectEntry for its keys). Raises SimError."""
    entry = from_mapping(_ObjectEntry, content, where)
    where = f"{where} ({entry.name})"
    shapes = [shape for shape in SHAPES if getattr(entry, shape) is not None]
    if len(shapes) != 1:
        raise SimError(f"{where}: exactly one of {', '.join(SHAPES)} is needed, got {shapes or 'none'}")
    if not isinstance(entry.name, str) or not re.fullmatch(r"[\w.-]+", entry.name):
        raise SimError(f"{where}: name must be letters, digits, '_', '-' or '.'")
    color = list(entry.color) if isinstance(entry.color, (list, tuple)) else [None]
    rgba = vector([*color, 1.0] if len(color) == 3 else color, f"{where}: color", 4, 0.0, 1.0)
    return WorldObject(
        name=entry.name,
        shape=shapes[0],
        size=_parse_size(shapes[0], getattr(entry, shapes[0]), where),
        T_world_object=from_rpy(
            vector(entry.position_m, f"{where}: position_m"),
            np.radians(vector(entry.rpy_deg, f"{where}: rpy_deg")),
        ),
        color=tuple(rgba),
        fixed=bool(entry.fixed),
        mass_kg=number(entry.mass_kg, f"{where}: mass_kg", 1e-6, 1e9),
    )


def _parse_size(shape: str, content: Any, where: str) -> dict[str, Any]:
    """The checked sizes of one shape: size_m (3,), radius_m, length_m, or file and scale (3,)."""
    keys = _SHAPE_KEYS[shape]
    if not isinstance(content, dict) or not set(content) <= set(keys):
        raise SimError(f"{where}: {shape} takes the keys {', '.join(keys)}, got {content!r}")
    missing = [key for key in keys if key not in content and key != "scale"]
    if missing:
        raise SimError(f"{where}: {shape} lacks {', '.join(missing)}")
    out: dict[str, Any] = {}
    for key, value in content.items():
        if key == "file":
            out[key] = resolve_file(value, where)
        elif key == "size_m" or (shape == "mesh" and isinstance(value, list)):
            out[key] = vector(value, f"{where}: {key}", low=_THIN)
        else:
            out[key] = number(value, f"{where}: {key}", _THIN, _FAR)
    if shape in ("mesh", "urdf", "sdf"):
        scale = out.setdefault("scale", 1.0)
        out["scale"] = np.broadcast_to(scale, 3).astype(float) if shape == "mesh" else scale
    return out
