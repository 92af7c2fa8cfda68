"""Where capability maps are kept."""

from __future__ import annotations

import os
from pathlib import Path


def data_folder() -> Path:
    """Return `$FV_DATA`, or else `data` beside `catkin_ws`, or in the current folder when installed elsewhere."""
    if os.environ.get("FV_DATA"):
        return Path(os.environ["FV_DATA"])
    for parent in Path(__file__).resolve().parents:
        if parent.name == "catkin_ws":
            return parent.parent / "data"
    return Path.cwd() / "data"


def default_map_path(robot: str, group: str) -> Path:
    """Return `capability_maps/<robot>_<group>.h5` in the data folder."""
    return data_folder() / "capability_maps" / f"{robot}_{group}.h5"
