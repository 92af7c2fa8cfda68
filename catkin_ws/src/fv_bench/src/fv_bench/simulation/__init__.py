"""The simulator and its node."""
