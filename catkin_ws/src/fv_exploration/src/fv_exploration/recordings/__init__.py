"""Recorded clouds without ROS: PCD files, OctoMap scan graphs, rosbags with TF."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fv_exploration.recordings.bag import bag_scans
from fv_exploration.recordings.errors import (
    RecordingError,
    RecordingWarning,
    Warn,
    one_line,
    python_warning,
)
from fv_exploration.recordings.pcd import pcd_scan
from fv_exploration.recordings.scan_graph import graph_scans

__all__ = ["RecordedScan", "RecordingError", "RecordingWarning", "read_scans"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RecordedScan:
    """One recorded cloud.

    :param points_sensor: (N, 3) [m], sensor frame; NaN rows had no return.
    :param T_map_sensor: (4, 4), takes sensor-frame points to the frame of the recording.
    """

    points_sensor: Array
    T_map_sensor: Array


def read_scans(
    path: Path | str, topic: str = "", map_frame: str = "", warn: Warn = python_warning
) -> Iterator[RecordedScan]:
    """All scans of a file, by its ending: .pcd, .graph, .bag or a folder that is a bag.

    :param topic: of the clouds in a bag; empty: its only cloud topic.
    :param map_frame: of a bag's TF; empty: the root of the tree that the cloud's frame is in.
    :param warn: called with one line for whatever was left out or replaced.
    :raises RecordingError: naming the file and what is wrong with it.
    """
    path = Path(path)
    try:
        for points, transform in _scans(path, topic, map_frame, lambda text: warn(f"{path}: {text}")):
            yield RecordedScan(points, transform)
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from error
    except OSError as error:
        raise RecordingError(f"{path}: {error.strerror or one_line(error)}") from error
    except MemoryError as error:
        raise RecordingError(f"{path}: does not fit into the memory") from error


def _scans(path: Path, topic: str, map_frame: str, warn: Warn) -> Iterator[tuple[Array, Array]]:
    ending = path.suffix.lower()
    if not path.exists():
        raise RecordingError("there is no such file")
    if ending in (".bag", ".mcap", ".db3") or path.is_dir():
        yield from bag_scans(path, topic, map_frame, warn)
        return
    if topic or map_frame:
        warn("is no bag: a cloud topic or a frame of the map is not used")
    if ending == ".pcd":
        yield pcd_scan(path.read_bytes(), warn)
    elif ending == ".graph":
        yield from graph_scans(path.read_bytes(), warn)
    else:
        raise RecordingError("unknown ending; valid: .pcd, .graph, .bag")
