"""Where capability maps are kept."""

from __future__ import annotations

import os
from pathlib import Path


def workspace_root() -> Path:
    """Return the folder that holds `catkin_ws`, or the current folder when this package was installed elsewhere."""
    for parent in Path(__file__).resolve().parents:
        if parent.name == "catkin_ws":
            return parent.parent
    return Path.cwd()


def default_map_path(robot: str, group: str) -> Path:
    """Return `<root>/data/capability_maps/<robot>_<group>.h5`; root is `$FV_DATA`, or else the workspace's."""
    root = Path(os.environ.get("FV_DATA") or workspace_root())
    return root / "data" / "capability_maps" / f"{robot}_{group}.h5"
