"""Reading of a run folder, complete or not."""

from __future__ import annotations

import csv
import dataclasses
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from fv_common.transforms import transform

TIMES = ("scan", "integrate", "evaluate", "choose", "plan", "move", "screenshot")
SCENE = (".mp4", ".webm", ".gif", ".png", ".jpg")
FINISHED = "finished"  # stem of the last picture
CLASSES = ("occupied", "free", "frontier", "void")


@dataclasses.dataclass
class RunData:
    """What a run left behind.

    run: run.json; columns: metrics.csv, name -> (N,) with NaN for empty cells; points: class -> (K, 3) [m];
    since: view at which each voxel became known, with `first_key` (3,) and `view` (X, Y, Z); poses: T_map_camera
    (V, 4, 4) of the executed views; pictures in order; scene: picture and video of the simulated world; missing: one
    line for each thing that is not there.
    """

    folder: Path
    run: dict[str, Any] = dataclasses.field(default_factory=dict)
    columns: dict[str, np.ndarray] = dataclasses.field(default_factory=dict)
    points: dict[str, np.ndarray] = dataclasses.field(default_factory=dict)
    resolution: float = 0.0
    since: dict[str, np.ndarray] = dataclasses.field(default_factory=dict)
    poses: np.ndarray = dataclasses.field(default_factory=lambda: np.empty((0, 4, 4)))
    pictures: list[Path] = dataclasses.field(default_factory=list)
    scene: list[Path] = dataclasses.field(default_factory=list)
    missing: list[str] = dataclasses.field(default_factory=list)

    @property
    def name(self) -> str:
        """World, robot and seed, or the folder's name."""
        known = [str(self.run[key]) for key in ("world", "robot") if key in self.run]
        seed = [f"seed {self.run['seed']}"] if "seed" in self.run else []
        return ", ".join(known + seed) or self.folder.name

    @property
    def truth(self) -> dict[str, Any]:
        """What the comparison with the true scene found; empty without one."""
        truth = self.run.get("truth")
        return truth if isinstance(truth, dict) else {}

    @property
    def settled(self) -> bool:
        """Whether what the camera can observe at all was found in full; False: explored shares are upper bounds."""
        return self.truth.get("observable_settled") is not False

    def column(self, name: str) -> np.ndarray:
        """A column of metrics.csv; all NaN when the file does not have it."""
        length = len(next(iter(self.columns.values()), ()))
        return self.columns.get(name, np.full(length, np.nan))


def load(folder: Path) -> RunData:
    """Read a run folder.

    Raises FileNotFoundError when the folder does not exist or holds none of a run's files.
    """
    if not folder.is_dir():
        raise FileNotFoundError(f"no run folder {folder}")
    data = RunData(folder)
    readers = (
        ("run.json", _read_run),
        ("metrics.csv", _read_metrics),
        ("map_points.npz", _read_points),
        ("known_since.npz", _read_since),
        ("views.json", _read_views),
    )
    for name, reader in readers:
        try:
            reader(data, folder / name)
        except FileNotFoundError:
            data.missing.append(f"{name} is not there")
        except (
            OSError,
            ValueError,
            KeyError,
            TypeError,
            AttributeError,
            zipfile.BadZipFile,
            csv.Error,
        ) as error:
            data.missing.append(f"{name} cannot be used: {type(error).__name__}: {error}")
    data.pictures = sorted(
        (folder / "screenshots").glob("*.png"), key=lambda path: (path.stem == FINISHED, path.name)
    )
    if not data.pictures:
        data.missing.append("no pictures in screenshots/")
    data.scene = sorted(path for path in folder.glob("scene.*") if path.suffix in SCENE)
    if len(data.missing) == len(readers) + 1:
        raise FileNotFoundError(f"{folder} holds nothing of a run: {'; '.join(data.missing)}")
    return data


def _read_run(data: RunData, path: Path) -> None:
    run = json.loads(path.read_text())
    if not isinstance(run, dict):
        raise ValueError("not a JSON object")
    data.run = run


def _read_metrics(data: RunData, path: Path) -> None:
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    if not rows:
        raise ValueError("no rows")
    data.columns = {name: np.array([_number(row.get(name)) for row in rows]) for name in rows[0] if name}


def _number(text: str | None) -> float:
    try:
        return float(text or "nan")
    except ValueError:
        return float("nan")


def _read_points(data: RunData, path: Path) -> None:
    with np.load(path) as file:
        resolution = float(file["resolution"])
        if not resolution > 0.0:
            raise ValueError(f"resolution {resolution}")
        points = {name: _finite(file[name]) for name in CLASSES if name in file}
    data.points, data.resolution = points, resolution
    data.missing += [f"map_points.npz has no {name} voxels array" for name in CLASSES if name not in points]


def _finite(points: np.ndarray) -> np.ndarray:
    points = np.asarray(points, dtype=np.float32).reshape(-1, 3)
    return points[np.isfinite(points).all(axis=1)]


def _read_since(data: RunData, path: Path) -> None:
    with np.load(path) as file:
        data.since = {"first_key": np.asarray(file["first_key"], dtype=int), "view": np.asarray(file["view"])}


def _read_views(data: RunData, path: Path) -> None:
    """Poses as 4 x 4 matrices, or position and quaternion x y z w."""
    poses = [_matrix(np.asarray(view["pose"], dtype=float)) for view in json.loads(path.read_text())]
    data.poses = np.array(poses).reshape(-1, 4, 4)


def _matrix(pose: np.ndarray) -> np.ndarray:
    if pose.size == 16:
        return pose.reshape(4, 4)
    if pose.size != 7:
        raise ValueError(f"a pose of {pose.size} numbers")
    return transform(pose[:3], pose[3:])
