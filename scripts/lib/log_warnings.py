"""Warnings and errors that nodes have written to their logs."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from fv_exploration.warning_list import WarningList

COLOUR = re.compile(r"\x1b\[[0-9;]*m")
# As rosconsole and rospy write them: [ WARN] [1700000000.5, 12.3]: text
LINE = re.compile(r"\[\s*(?:WARN|ERROR|FATAL)\]\s*\[[^\]]*\]:?\s*(?P<text>.*\S)")
MOST_BYTES = 20 * 2**20
"""Of each log."""


def logged(log_dir: Path, known: Iterable[str] = ()) -> list[str]:
    """One line for each warning or error in ``log_dir/*.log``, with the log's name before it.

    :param known: lines that are told elsewhere already, as ``WarningList.lines`` gives them: not repeated.
    """
    known = tuple(known)
    found = WarningList()
    for path in sorted(log_dir.glob("*.log")):
        with path.open("rb") as file:
            content = file.read(MOST_BYTES).decode(errors="replace")
        for match in LINE.finditer(COLOUR.sub("", content)):
            text = match["text"]
            bare = re.sub(r"^\w+: ", "", text)  # some nodes begin with their name
            if not any(bare in line or line in bare for line in known):
                found.add(f"{path.stem}: {text}")
    return found.lines()
