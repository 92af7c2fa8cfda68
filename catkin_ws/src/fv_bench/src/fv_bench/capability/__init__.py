"""Capability maps and inverse kinematics."""
