"""Controllers as ros_control has them: goals, splines, tolerances, drives. No ROS."""
