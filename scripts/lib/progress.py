"""One line on the terminal that says what is being done; plain lines where there is no terminal."""

from __future__ import annotations

import shutil
import sys
import time

BAR_WIDTH = 24
PLAIN_INTERVAL_S = 10.0


def bar(share: float) -> str:
    """A bar of fixed width for a share of 0..1."""
    full = round(BAR_WIDTH * min(max(share, 0.0), 1.0))
    return "[" + "#" * full + "." * (BAR_WIDTH - full) + "]"


class Progress:
    """Shows the newest state. On a terminal the line is renewed in place; elsewhere a line is printed now and then."""

    def __init__(self) -> None:
        self._terminal = sys.stdout.isatty()
        self._last_plain = -PLAIN_INTERVAL_S
        self._line = ""
        self.warnings: list[str] = []

    def warn(self, text: str) -> None:
        """A line that is also kept: it belongs to the run's record."""
        self.say(f"warning: {text}")
        self.warnings.append(text)

    def say(self, text: str) -> None:
        """A line of its own."""
        self.end()
        print(text, flush=True)

    def show(self, text: str) -> None:
        """The line that changes."""
        if self._terminal:
            width = shutil.get_terminal_size().columns - 1
            self._line = text[:width]
            print(f"\r{self._line:<{width}}", end="", flush=True)
        elif time.monotonic() - self._last_plain >= PLAIN_INTERVAL_S:
            self._last_plain = time.monotonic()
            print(text, flush=True)

    def end(self) -> None:
        """Finish the changing line."""
        if self._line:
            print(flush=True)
            self._line = ""
