"""The robot as kinematics and collision geometry: Python face of the C++ core."""

from fv_robot_model._core import ModelError, RobotModel, UnknownNameError

__all__ = ["ModelError", "RobotModel", "UnknownNameError"]
