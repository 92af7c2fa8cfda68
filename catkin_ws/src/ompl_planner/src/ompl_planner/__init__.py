"""Collision-free, timed motions on the shared occupancy map; the algorithms are in the C++ module `_core`."""
