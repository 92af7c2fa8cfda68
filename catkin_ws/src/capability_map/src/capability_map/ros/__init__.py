"""The node, and the only place of this package where messages and numpy meet."""
