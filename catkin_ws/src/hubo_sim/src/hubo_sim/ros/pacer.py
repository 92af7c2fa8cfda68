"""When physics may step: simulated time against the wall clock."""

from __future__ import annotations

import time

_BEHIND_S = 0.1  # falling behind by more than this is forgotten rather than caught up


class Pacer:
    """Holds simulated time to a real-time factor; 0 means no holding."""

    def __init__(self, real_time_factor: float) -> None:
        self.real_time_factor = real_time_factor
        self._wall_s = time.monotonic()
        self._clock_ns = 0

    def restart(self, clock_ns: int) -> None:
        """Count from here: clock_ns is now."""
        self._wall_s, self._clock_ns = time.monotonic(), clock_ns

    def wall_clock_ns(self, clock_ns: int) -> int:
        """Simulated time if it ran at wall speed since the last call of this or restart; restarts at clock_ns."""
        wall_s = time.monotonic()
        out = clock_ns + int((wall_s - self._wall_s) * 1e9)
        self._wall_s, self._clock_ns = wall_s, out
        return out

    def ahead_s(self, clock_ns: int) -> float:
        """Wall time [s] to wait before the next step; 0 when behind."""
        if self.real_time_factor <= 0.0:
            return 0.0
        due = self._wall_s + (clock_ns - self._clock_ns) * 1e-9 / self.real_time_factor
        ahead = due - time.monotonic()
        if ahead < -_BEHIND_S:
            self.restart(clock_ns)
        return max(ahead, 0.0)
