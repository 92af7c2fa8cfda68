"""Where files are: the package's own folders, pybullet_data, and other ROS packages."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from hubo_sim.bullet import pybullet_data
from hubo_sim.errors import SimError


def package_folder() -> Path:
    """The package's share folder: beside the sources in a devel space, below share/ once installed."""
    here = Path(__file__).resolve()
    for folder in here.parents:
        for candidate in (folder, folder / "share" / "hubo_sim"):
            if (candidate / "worlds").is_dir() and (candidate / "package.xml").is_file():
                return candidate
    raise SimError(f"the folder of package hubo_sim was not found above {here}")


def worlds_folder() -> Path:
    """Folder of the worlds that come with the package."""
    return package_folder() / "worlds"


def cache_folder() -> Path:
    """Folder for computed truths: $FV_DATA/ground_truth, else data/ground_truth in the workspace root."""
    if os.environ.get("FV_DATA"):
        return Path(os.environ["FV_DATA"]) / "ground_truth"
    for folder in package_folder().parents:
        if (folder / "catkin_ws").is_dir():
            return folder / "data" / "ground_truth"
    return Path.home() / ".cache" / "hubo_sim" / "ground_truth"


def resolve_file(value: Any, where: str, folder: Path | None = None) -> str:
    """Absolute path of 'pybullet_data:<path>', 'package://<pkg>/<path>', 'file://<path>' or a plain path.

    folder: what a relative path is relative to; default the working directory. Raises SimError, beginning with
    `where`, when there is no such file.
    """
    if not isinstance(value, str) or not value:
        raise SimError(f"{where}: file must be a path, got {value!r}")
    if value.startswith("pybullet_data:"):
        path = Path(pybullet_data.getDataPath()) / value.split(":", 1)[1]
    elif value.startswith("package://"):
        path = _in_package(value[len("package://") :], where)
    else:
        path = (folder or Path()) / (value[len("file://") :] if value.startswith("file://") else value)
    if not path.is_file():
        raise SimError(f"{where}: no such file: {value}")
    return str(path.resolve())


def _in_package(rest: str, where: str) -> Path:
    """File of another ROS package."""
    import rospkg  # only needed for package:// files, and slow to import

    package, _, inside = rest.partition("/")
    try:
        return Path(rospkg.RosPack().get_path(package)) / inside
    except rospkg.ResourceNotFound as err:
        raise SimError(f"{where}: no such ROS package: {package}") from err
