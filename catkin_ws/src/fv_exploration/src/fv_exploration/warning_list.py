"""What a user should know of a run beside its result: one-line texts, each told once and counted. Free of ROS."""

from __future__ import annotations

import re
import threading
from collections.abc import Callable

NUMBER = re.compile(r"(?<![\w.])-?\d+(\.\d+)?(?!\w)")  # not those of a name such as link_2
MOST = 50
"""Of more different texts than this only the number is kept."""


class WarningList:
    """Collects warnings. Texts that differ in their numbers alone count as one; the first is kept.

    :param say: called with each text when it is new.
    """

    def __init__(self, say: Callable[[str], None] = lambda text: None) -> None:
        self._say = say
        self._texts: dict[str, str] = {}
        self._counts: dict[str, int] = {}
        self._left_out = 0
        self._lock = threading.Lock()

    def add(self, text: str) -> None:
        """Take a text; line breaks become spaces."""
        text = " ".join(text.split())
        key = NUMBER.sub("#", text)
        with self._lock:
            new = key not in self._texts
            if new and len(self._texts) >= MOST:
                self._left_out += 1
                return
            self._texts.setdefault(key, text)
            self._counts[key] = self._counts.get(key, 0) + 1
        if new:
            self._say(text)

    def lines(self) -> list[str]:
        """One line a warning, in the order in which they came first, with how often they came."""
        with self._lock:
            counted = [(text, self._counts[key]) for key, text in self._texts.items()]
            more = [f"{self._left_out} further warnings are in the logs"] if self._left_out else []
        return [text if count == 1 else f"{text} ({count} times)" for text, count in counted] + more

    def clear(self) -> None:
        """Forget everything: another run begins."""
        with self._lock:
            self._texts.clear()
            self._counts.clear()
            self._left_out = 0
