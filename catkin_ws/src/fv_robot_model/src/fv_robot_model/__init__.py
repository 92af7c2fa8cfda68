"""The robot as kinematics and collision geometry: Python face of the C++ core."""

from fv_robot_model._core import (
    Group,
    Joint,
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
    Visual,
    body_voxels,
    load_mesh,
    sphere_cover,
)
from fv_robot_model.packages import package_file

__all__ = [
    "Group",
    "Joint",
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
    "Visual",
    "body_voxels",
    "load_mesh",
    "package_file",
    "sphere_cover",
]
