"""What the robot senses: rendered depth with noise, lidars, inertial units, forces. No ROS."""
