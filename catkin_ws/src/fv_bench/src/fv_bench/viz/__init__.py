"""Markers and RViz."""
