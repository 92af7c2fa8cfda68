"""A pybullet world as a ROS node, and the truth about it."""
