"""Long texts as one line, and the tracebacks that rospy writes into its log as one line and an entry elsewhere."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable

LONGEST = 1000  # characters
TRACEBACK = "Traceback (most recent call last)"


def one_line(text: str) -> str:
    """The text without line ends and control characters, cut where nobody would read on."""
    line = " ".join(text.split())
    line = "".join(c if c.isprintable() else f"\\x{ord(c):02x}" for c in line)
    return line if len(line) <= LONGEST else line[:LONGEST] + " ..."


class OneLine(logging.Filter):
    """rospy and actionlib log an error in a callback with its traceback; here that becomes one line.

    A callback that fails at each message is told of at the 1st, 2nd, 4th, 8th ... time.

    :param keep: takes the whole text, and returns where it is kept.
    """

    LOGGER = "rosout"  # that of rospy.loginfo and its kin

    def __init__(self, keep: Callable[[str], str]) -> None:
        super().__init__()
        self._keep = keep
        self._seen: Counter[str] = Counter()

    @classmethod
    def install(cls, keep: Callable[[str], str]) -> None:
        """From now on, for all that rospy says."""
        logging.getLogger(cls.LOGGER).addFilter(cls(keep))

    def filter(self, record: logging.LogRecord) -> bool:
        text = record.getMessage()
        if TRACEBACK not in text:
            return True
        lines = [line for line in text.splitlines() if line.strip()]
        what = lines[0] if lines[-1].startswith("[") else f"{lines[0]}: {lines[-1]}"  # [: a list as text
        self._seen[what] += 1
        times = self._seen[what]
        if times & (times - 1):
            return False
        again = f", {times} times so far" if times > 1 else ""
        record.msg, record.args = f"{one_line(what)}{again} ({self._keep(text)})", ()
        return True
