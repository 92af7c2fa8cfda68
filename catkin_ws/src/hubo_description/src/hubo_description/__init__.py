"""Robots as data: URDF, SRDF, controllers, limits and sensors of one robot, loaded and checked.

>>> robot = load_robot("hubo")
>>> robot.config.exploration.group
'torso_right_arm'
"""

from hubo_description.errors import RobotDescriptionError
from hubo_description.robot import Robot, list_robots, load_robot, robots_folder

__all__ = ["Robot", "RobotDescriptionError", "list_robots", "load_robot", "robots_folder"]
