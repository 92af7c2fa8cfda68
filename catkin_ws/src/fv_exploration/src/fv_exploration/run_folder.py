"""What an exploration leaves on disk. Files are written beside and renamed, so that none is ever half-written."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from fv_common.files import write_replacing, write_whole
from fv_exploration import Evaluation, OccupancyMap
from fv_exploration.known_since import KnownSince

COLUMNS = (
    "view", "sim_s", "wall_s", "scan_s", "integrate_s", "evaluate_s", "choose_s", "plan_s", "move_s",
    "screenshot_s", "occupied", "free", "unknown", "frontier", "void", "ellipsoids", "frontier_clusters",
    "known_share", "explored_share", "observable_settled", "expected_gain_m3", "real_gain_m3", "path_length_rad",
    "duration_s", "contacts",
)  # fmt: skip
"""Columns of metrics.csv, one row a scan; empty: not known when the row was written.

``view``: a scan from where a motion was cut short has the number of the view before. ``explored_share``: of what the
camera can see at all, as far as that was found; where ``observable_settled`` is 0, more was still being found, and the
share is an upper bound. ``contacts``: physics steps with a contact since the row before, in simulation.
"""


def write_json(path: Path, content: object) -> None:
    """Write JSON, replacing the file as a whole."""
    write_whole(path, json.dumps(content, indent=2) + "\n")


class RunFolder:
    """The files of one exploration.

    :param folder: existing or new.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._rows: list[Mapping[str, float | str]] = []
        self._views: list[Mapping[str, object]] = []
        self._known_since: KnownSince | None = None
        folder.mkdir(parents=True, exist_ok=True)

    @property
    def map_path(self) -> Path:
        return self._folder / "map.ot"

    @property
    def metrics_path(self) -> Path:
        return self._folder / "metrics.csv"

    def add_row(self, row: Mapping[str, float | str]) -> None:
        """Append one view's figures; keys must be among ``COLUMNS``."""
        unknown = set(row) - set(COLUMNS)
        if unknown:
            raise KeyError(f"not a column of metrics.csv: {', '.join(sorted(unknown))}")
        self._rows.append(row)
        write_replacing(self.metrics_path, self._write_rows)

    def add_view(self, view: Mapping[str, object]) -> None:
        """Append the pose and the figures of an executed view to views.json."""
        self._views.append(view)
        write_json(self._folder / "views.json", self._views)

    def note_known(self, view: int, occupancy_map: OccupancyMap) -> None:
        """Remember which voxels the map knows after this view."""
        if self._known_since is None:
            self._known_since = KnownSince(
                occupancy_map.bounds_min, occupancy_map.bounds_max, occupancy_map.resolution_m
            )
        self._known_since.update(view, occupancy_map.classify)

    def write_map(self, occupancy_map: OccupancyMap, evaluation: Evaluation) -> None:
        """map.bt (OctoMap, three classes), map.ot (with probabilities), and the npz files."""
        write_replacing(self._folder / "map.bt", lambda path: occupancy_map.write_bt(str(path)))
        write_replacing(self.map_path, lambda path: occupancy_map.write_ot(str(path)))
        points = {
            "resolution": occupancy_map.resolution_m,
            "free": occupancy_map.voxels("free"),
            "occupied": occupancy_map.voxels("occupied"),
            "frontier": evaluation.frontier,
            "void": evaluation.void,
        }
        write_replacing(self._folder / "map_points.npz", lambda path: np.savez_compressed(path, **points))

        if self._known_since is not None:
            write_replacing(self._folder / "known_since.npz", self._known_since.write)

    def _write_rows(self, path: Path) -> None:
        with path.open("w", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS, restval="")
            writer.writeheader()
            writer.writerows(self._rows)
