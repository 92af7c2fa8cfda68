"""Which views can an arm hold at all? Capability maps (thesis, section 3.2): build, store, ask."""

from capability_map.capability_map import CapabilityMap
from capability_map.errors import CapabilityMapError
from capability_map.parameters import BuildParameters
from capability_map.paths import default_map_path

__all__ = ["BuildParameters", "CapabilityMap", "CapabilityMapError", "default_map_path"]
