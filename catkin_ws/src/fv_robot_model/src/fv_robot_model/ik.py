"""Inverse kinematics: all solutions of a chain for many poses at once."""

from fv_robot_model._core import (
    IkOptions,
    IkSolver,
    SerialChain,
    make_ik_solver,
    make_numerical_ik_solver,
)

__all__ = ["IkOptions", "IkSolver", "SerialChain", "make_ik_solver", "make_numerical_ik_solver"]
