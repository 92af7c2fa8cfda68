"""Motions against the plain pipeline, from real exploration states."""
