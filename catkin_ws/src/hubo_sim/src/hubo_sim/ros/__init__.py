"""The node: messages, services and publishers around the simulator."""
