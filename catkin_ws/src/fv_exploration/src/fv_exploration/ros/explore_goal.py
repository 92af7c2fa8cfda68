"""A goal of the explore action, checked: everything that is wrong with it is a ValueError that says what is valid."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from fv_msgs.msg import ExploreGoal
from numpy.typing import NDArray

from fv_exploration.bounds import Bounds, Volume, enclosing_box, require_sensible_size, shown
from fv_exploration.explore_config import ExploreConfig

Array = NDArray[np.float64]


def configured(goal: ExploreGoal, config: ExploreConfig) -> ExploreConfig:
    """The configuration with the goal's budgets and policy, where it has some.

    Parameters belong to the configured policy: another one begins with its own defaults.
    """
    if not (math.isfinite(goal.max_seconds) and goal.max_seconds >= 0):
        raise ValueError(f"max_seconds is {goal.max_seconds}; valid: 0 (no limit) or a number above")
    stop = replace(
        config.stop,
        max_views=goal.max_views or config.stop.max_views,
        max_seconds=goal.max_seconds or config.stop.max_seconds,
    )
    config = replace(config, stop=stop)
    if goal.policy in ("", config.policy):
        return config
    return replace(config, policy=goal.policy, policy_parameters={})


def volume(
    goal: ExploreGoal, map_frame: str, config: ExploreConfig, pose_of: Callable[[str], Array]
) -> Volume:
    """The goal's bounds in the map frame.

    :param pose_of: ``(frame) -> (4, 4)`` pose of a frame in the map frame; asked only for another frame.
    """
    bounds = _corners(goal)
    frame = goal.header.frame_id.lstrip("/")
    own = frame in ("", map_frame)
    with np.errstate(over="ignore", invalid="ignore"):
        found = Volume(bounds) if own else enclosing_box(bounds, pose_of(frame), frame, map_frame)
    require_sensible_size(found.bounds, config)
    return found


def _corners(goal: ExploreGoal) -> Bounds:
    minimum = np.array([goal.bounds.min.x, goal.bounds.min.y, goal.bounds.min.z])
    maximum = np.array([goal.bounds.max.x, goal.bounds.max.y, goal.bounds.max.z])
    if not (np.isfinite([minimum, maximum]).all() and (minimum < maximum).all()):
        raise ValueError(
            f"bounds are {shown((minimum, maximum))}; valid: finite [m], each minimum below its maximum"
        )
    return minimum, maximum
