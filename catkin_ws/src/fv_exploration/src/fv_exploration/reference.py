"""OctoMap's own insertion and plain loops: what the fast ones are held to in tests and benchmarks."""

from fv_exploration._core import reference as _reference

ReferenceMap = _reference.ReferenceMap
plain_utility = _reference.plain_utility
plain_clusters = _reference.plain_clusters
