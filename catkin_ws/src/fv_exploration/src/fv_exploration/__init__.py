"""Frontier-void exploration: occupancy map, frontiers, voids, utility and view gain.

Everything here works without ROS; lengths are metres, angles radians, and points are in the map frame unless their name
says otherwise. Modules that need ROS are imported by name (``fv_exploration.ros.conversions``).

>>> import numpy as np
>>> from fv_exploration import Evaluator, MapConfig, OccupancyMap, ScanConfig
>>> grid = OccupancyMap(MapConfig(resolution_m=0.1))
>>> result = grid.insert_scan(np.array([[1.0, 0.0, 0.0], [np.nan] * 3]), np.eye(4), ScanConfig(max_range_m=3.0))
>>> grid.counts()["occupied"]
1
>>> Evaluator(grid).update().frontier.shape[1]
3
"""

from fv_exploration._core import (
    Evaluation,
    EvaluationConfig,
    Evaluator,
    FilterConfig,
    InputError,
    InsertResult,
    MapConfig,
    MapFileError,
    OccupancyMap,
    OutsideKeysError,
    PinholeCamera,
    ReturnChance,
    ScanConfig,
    Utility,
    ViewGains,
    accumulate_utility,
    best_views,
    cluster_voids,
    filter_cloud,
    read_utility_tree,
    view_gain,
    write_color_tree,
    write_utility_tree,
)

__all__ = [
    "Evaluation",
    "EvaluationConfig",
    "Evaluator",
    "FilterConfig",
    "InputError",
    "InsertResult",
    "MapConfig",
    "MapFileError",
    "OccupancyMap",
    "OutsideKeysError",
    "PinholeCamera",
    "ReturnChance",
    "ScanConfig",
    "Utility",
    "ViewGains",
    "accumulate_utility",
    "best_views",
    "cluster_voids",
    "filter_cloud",
    "read_utility_tree",
    "view_gain",
    "write_color_tree",
    "write_utility_tree",
]
