"""The robot as kinematics and collision geometry: Python face of the C++ core."""

from fv_robot_model._core import (
    Group,
    JointLimits,
    LinkFilterConfig,
    ModelError,
    PointClass,
    RobotModel,
    SelfCollision,
    SelfFilter,
    SelfFilterConfig,
    Shape,
    UnknownNameError,
    body_voxels,
    sphere_cover,
)

__all__ = [
    "Group",
    "JointLimits",
    "LinkFilterConfig",
    "ModelError",
    "PointClass",
    "RobotModel",
    "SelfCollision",
    "SelfFilter",
    "SelfFilterConfig",
    "Shape",
    "UnknownNameError",
    "body_voxels",
    "sphere_cover",
]
