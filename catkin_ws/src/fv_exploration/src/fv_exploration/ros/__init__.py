"""What needs ROS: messages, topics, services and actions around the exploration."""
