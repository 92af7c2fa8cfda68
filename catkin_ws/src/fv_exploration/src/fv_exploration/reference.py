"""OctoMap's own insertion and plain loops, what the fast ones are held to; their instruction sets."""

from fv_exploration._core import reference as _reference

instruction_set = _reference.instruction_set
lane_times = _reference.lane_times
ReferenceMap = _reference.ReferenceMap
plain_utility = _reference.plain_utility
plain_clusters = _reference.plain_clusters
