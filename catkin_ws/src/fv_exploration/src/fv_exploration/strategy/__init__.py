"""Which view is next: strategies, and what they are made of. Free of ROS."""
