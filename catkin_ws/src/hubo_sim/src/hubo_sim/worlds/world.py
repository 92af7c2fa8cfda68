"""Worlds as YAML files: what stands where, where the robot stands, and what volume is to be explored."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from fv_common.errors import ConfigError, told_as
from fv_common.schema import Config, Range, Share, from_mapping
from fv_common.transforms import from_rpy
from fv_common.yaml_file import read_yaml
from hubo_sim.errors import SimError
from hubo_sim.paths import resolve_file, worlds_folder
from hubo_sim.worlds.kinds import KINDS, generate

SHAPES = ("box", "cylinder", "sphere", "mesh", "urdf", "sdf")
FAR = 1e6  # [m] or [deg]: beyond, coordinates lose the digits that physics needs
Coordinate = Annotated[float, Range(-FAR, FAR)]
Coordinates = tuple[Coordinate, Coordinate, Coordinate]
Size = Annotated[float, Range(1e-6, FAR)]


@dataclass(frozen=True)
class Bounds(Config):
    """Axis-aligned exploration volume, world frame [m]."""

    min_m: Coordinates
    max_m: Coordinates

    def __post_init__(self) -> None:
        super().__post_init__()
        if not all(low < high for low, high in zip(self.min_m, self.max_m, strict=True)):
            raise ConfigError(f"min_m {list(self.min_m)} must be below max_m {list(self.max_m)}")

    @property
    def corners(self) -> np.ndarray:
        """(2, 3) lowest and highest corner."""
        return np.array([self.min_m, self.max_m])


@dataclass(frozen=True)
class RobotPlace(Config):
    """Where the robot's floor point stands in the world and where it looks."""

    position_m: Coordinates = (0.0, 0.0, 0.0)
    yaw_deg: float = 0.0

    def base_pose(self, base_height_m: float) -> np.ndarray:
        """T_world_base (4, 4) of a robot whose base link is `base_height_m` above its floor point."""
        T = from_rpy(self.position_m, np.radians([0.0, 0.0, self.yaw_deg]))
        T[2, 3] += base_height_m
        return T


@dataclass(frozen=True)
class ViewPoint(Config):
    """Camera of the scene's picture: horizontal field of view and where it stands, world frame."""

    eye_m: Coordinates = (2.5, -2.5, 2.0)
    target_m: Coordinates = (0.0, 0.0, 0.8)
    fov_deg: Annotated[float, Range(5, 150)] = 60.0


@dataclass(frozen=True)
class _Box(Config):
    size_m: tuple[Size, Size, Size]


@dataclass(frozen=True)
class _Cylinder(Config):
    radius_m: Size
    length_m: Size


@dataclass(frozen=True)
class _Sphere(Config):
    radius_m: Size


@dataclass(frozen=True)
class _Mesh(Config):
    file: str
    scale: Size | tuple[Size, Size, Size] = 1.0


@dataclass(frozen=True)
class _Model(Config):
    file: str
    scale: Size = 1.0


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
class _ObjectEntry(Config):
    """Keys of one object in a world file; exactly one of the shapes must be given."""

    name: str
    position_m: Coordinates = (0.0, 0.0, 0.0)
    rpy_deg: Coordinates = (0.0, 0.0, 0.0)
    color: list[Share] = field(default_factory=lambda: [0.7, 0.7, 0.7])
    fixed: bool = True
    mass_kg: Annotated[float, Range(1e-6, 1e9)] = 0.5
    box: _Box | None = None
    cylinder: _Cylinder | None = None
    sphere: _Sphere | None = None
    mesh: _Mesh | None = None
    urdf: _Model | None = None
    sdf: _Model | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.shapes) != 1:
            given = ", ".join(self.shapes) or "none"
            raise ConfigError(f"exactly one of {', '.join(SHAPES)} is needed, got {given}")
        if not re.fullmatch(r"[\w.-]+", self.name):
            raise ConfigError(f"name is {self.name!r:.80}; valid: letters, digits, '_', '-' or '.'")
        if len(self.color) not in (3, 4):
            raise ConfigError(f"color has {len(self.color)} numbers; valid: 3, or 4 with alpha")

    @property
    def shapes(self) -> list[str]:
        """Which shapes are given."""
        return [shape for shape in SHAPES if getattr(self, shape) is not None]


@dataclass(frozen=True)
class _WorldFile(Config):
    """Keys of a world file; its objects are read one by one."""

    description: object
    bounds: Bounds
    robot: RobotPlace | None = None
    camera: ViewPoint | None = None
    objects: list[object] | None = None


def list_worlds() -> list[str]:
    """Names of the worlds that come with the package, sorted."""
    return sorted(path.stem for path in worlds_folder().glob("*.yaml"))


@told_as(SimError)
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
    return parse_world(read_yaml(path), path.stem, str(path))


def _generated(kind: str, seed: str) -> World:
    if kind not in KINDS:
        raise SimError(f"unknown kind of world {kind!r}; valid: {', '.join(KINDS)}")
    if not (seed.isascii() and seed.isdigit()):
        raise SimError(f"world {kind}:{seed}: the seed must be a non-negative integer")
    return parse_world(generate(kind, int(seed)), f"{kind}_{seed}", f"{kind}:{seed}")


@told_as(SimError)
def parse_world(content: object, name: str, where: str) -> World:
    """Check a world file's content. Raises SimError that starts with `where` and names the bad key."""
    file = from_mapping(_WorldFile, content, where)
    objects = tuple(parse_object(entry, f"{where}: object {i}") for i, entry in enumerate(file.objects or []))
    names = [o.name for o in objects]
    twice = sorted({n for n in names if names.count(n) > 1})
    if twice:
        raise SimError(f"{where}: object name used twice: {', '.join(twice)}")
    return World(
        name=name,
        description=str(file.description).strip(),
        bounds=file.bounds,
        robot=file.robot or RobotPlace(),
        camera=file.camera or ViewPoint(),
        objects=objects,
    )


@told_as(SimError)
def parse_object(content: object, where: str) -> WorldObject:
    """One object of a world file (see _ObjectEntry for its keys). Raises SimError."""
    if isinstance(content, dict) and isinstance(content.get("name"), str):
        where = f"{where} ({content['name']:.80})"
    entry = from_mapping(_ObjectEntry, content, where)
    (shape,) = entry.shapes
    return WorldObject(
        name=entry.name,
        shape=shape,
        size=_size(getattr(entry, shape), where),
        T_world_object=from_rpy(entry.position_m, np.radians(entry.rpy_deg)),
        color=(*entry.color, 1.0)[:4],
        fixed=entry.fixed,
        mass_kg=entry.mass_kg,
    )


def _size(shape: _Box | _Cylinder | _Sphere | _Mesh | _Model, where: str) -> dict[str, Any]:
    """The sizes of one shape: size_m (3,), radius_m, length_m, or file and scale; that of a mesh is (3,)."""
    out = {key: np.array(value) if isinstance(value, tuple) else value for key, value in vars(shape).items()}
    if "file" in out:
        out["file"] = resolve_file(out["file"], where)
    if isinstance(shape, _Mesh):
        out["scale"] = np.broadcast_to(out["scale"], 3).astype(float)
    return out
