"""The inner loops with each instruction set of this processor against a plain loop, all in its caches."""

from __future__ import annotations

import statistics

from fv_bench.exploration.scene import row
from fv_exploration.reference import lane_times

KERNELS = ("mark", "cast", "add")


def run(quick: bool) -> list[dict]:
    """Rows of nanoseconds a voxel step; where there is AVX-512, of how much slower AVX2 is too."""
    times = lane_times(5 if quick else 41)
    plain = times.pop("plain")
    rows = []
    for name, of_set in times.items():
        for kernel in KERNELS:
            case, how = f"{kernel}, {name}: a voxel step", {"reference_name": "plain loop", "target": 2}
            rows.append(row("lanes", case, of_set[kernel], plain[kernel], unit="ns", **how))
    if "avx512" in times:
        for kernel in KERNELS:
            slower = statistics.median(times["avx2"][kernel]) / statistics.median(times["avx512"][kernel])
            case = f"{kernel}: time with avx2 / with avx512"
            rows.append(row("lanes", case, [slower], unit="ratio", target=2.5, at_most=True))
    return rows
