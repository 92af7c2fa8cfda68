"""Worlds: files and seeds as data, and the pybullet scene that is made of them. No ROS."""

from hubo_sim.worlds.world import (
    Bounds,
    RobotPlace,
    ViewPoint,
    World,
    WorldObject,
    list_worlds,
    load_world,
    parse_object,
    parse_world,
)

__all__ = [
    "Bounds",
    "RobotPlace",
    "ViewPoint",
    "World",
    "WorldObject",
    "list_worlds",
    "load_world",
    "parse_object",
    "parse_world",
]
