"""What an exploration is asked for: settings as YAML, or goals and clouds from the bytes of the wire. The first byte is
the kind. Each is taken, or refused by an error of one line."""

import contextlib
import io

import numpy as np
import yaml
from fv_msgs.msg import AttachedObjects, ExploreGoal
from genpy import DeserializationError
from sensor_msgs.msg import PointCloud2

from fv_common.schema import from_mapping
from fv_exploration import MapConfig, OccupancyMap
from fv_exploration.explore_config import ExploreConfig
from fv_exploration.ros.conversions import held_objects, points_from_cloud
from fv_exploration.ros.explore_goal import configured, volume

TURNED = np.array([[0.8, -0.6, 0.0, 1.0], [0.6, 0.8, 0.0, 2.0], [0.0, 0.0, 1.0, 3.0], [0.0, 0.0, 0.0, 1.0]])
"""Where the frame of the bounds is, when it is not the map frame."""


def one_input(data: bytes) -> None:
    """Only errors that say what is wrong may come."""
    kind, rest = data[:1], data[1:]
    with contextlib.suppress(ValueError, DeserializationError):
        if kind == b"g":
            goal = message(ExploreGoal, rest)
            config = configured(goal, ExploreConfig())
            low, high = volume(goal, "world", config, lambda frame: TURNED).bounds
            assert (low < high).all()
        elif kind == b"c":
            points_from_cloud(message(PointCloud2, rest))
        elif kind == b"h":
            held_objects(message(AttachedObjects, rest))
        else:
            configure(rest)


def message(kind: type, data: bytes) -> object:
    """A message as rospy would make it of these bytes."""
    msg = kind()
    msg.deserialize(data)
    msg.serialize(io.BytesIO())
    return msg


def configure(data: bytes) -> None:
    """A configuration, and the map that it wants."""
    try:
        content = yaml.safe_load(data.decode("utf-8"))
    except (yaml.YAMLError, RecursionError):
        return  # the reader's own business: see robot_folder.py
    config = from_mapping(ExploreConfig, content, "config")
    bounds = {"bounds_min": (-0.2, -0.2, -0.2), "bounds_max": (0.2, 0.2, 0.2)}
    OccupancyMap(MapConfig(**vars(config.map), **bounds))
