"""Rows of a performance table, as scripts/bench prints them."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable


def timed(call: Callable[[], object], runs: int) -> list[float]:
    """Seconds of each of `runs` calls."""
    seconds = []
    for _ in range(runs):
        started = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - started)
    return seconds


def row(
    bench: str,
    case: str,
    ours: float,
    unit: str,
    reference: float | None = None,
    reference_name: str = "",
    target: float | None = None,
    met: bool | None = None,
    runs: list[float] | None = None,
) -> dict:
    """One row; ratio is reference / ours, spread (max - min) / median of our runs."""
    spread = None
    if runs is not None and len(runs) > 1:
        spread = (max(runs) - min(runs)) / statistics.median(runs)
    return {
        "bench": bench,
        "case": case,
        "ours": ours,
        "reference": reference,
        "reference_name": reference_name,
        "unit": unit,
        "ratio": reference / ours if reference is not None and ours else None,
        "spread": spread,
        "runs": len(runs) if runs is not None else 1,
        "target": target,
        "met": met,
    }
