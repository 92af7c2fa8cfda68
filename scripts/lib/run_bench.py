"""scripts/bench: every speed and memory claim as a ratio against a reference measured in the same run."""

from __future__ import annotations

import argparse
import importlib
import json
import os
import platform
import sys
import time
from pathlib import Path
from types import ModuleType
from typing import Any

import last_resort
import own_network
from interrupts import interrupt_on_signals, leave

from fv_common.files import write_whole

SOURCES = Path(__file__).resolve().parents[2] / "catkin_ws" / "src" / "fv_bench" / "src"
COLUMNS = (
    "bench",
    "case",
    "ours",
    "reference",
    "reference_name",
    "unit",
    "ratio",
    "spread",
    "runs",
    "target",
    "met",
)


def available() -> dict[str, Path]:
    """Name and file of every bench: a module of fv_bench with ``run(quick) -> rows``."""
    files = sorted((SOURCES / "fv_bench").rglob("*.py"))
    return {path.stem: path for path in files if "def run(" in path.read_text()}


def load(path: Path) -> ModuleType:
    """A bench's module."""
    return importlib.import_module(".".join(path.relative_to(SOURCES).with_suffix("").parts))


def shown(value: Any) -> str:
    """A table cell."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "NO"
    if isinstance(value, float):
        return f"{value:.4g}"
    return str(value)


def machine() -> dict[str, str]:
    """The processor, and the instruction set that the inner loops use: what figures depend on most.

    :raises InputError: for a FV_INSTRUCTION_SET that cannot be used.
    """
    from fv_exploration.reference import instruction_set  # not for --help: it may not be built yet

    names = [line.split(":", 1)[1].strip() for line in cpu_info() if line.startswith("model name")]
    return {"processor": names[0] if names else platform.machine(), "instruction_set": instruction_set()}


def cpu_info() -> list[str]:
    try:
        return Path("/proc/cpuinfo").read_text(errors="replace").splitlines()
    except OSError:
        return []


def print_table(rows: list[dict[str, Any]]) -> None:
    """Rows as aligned columns."""
    table = [COLUMNS, *[tuple(shown(row.get(column)) for column in COLUMNS) for row in rows]]
    widths = [max(len(line[i]) for line in table) for i in range(len(COLUMNS))]
    for line in table:
        print("  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip())


def parse_arguments(words: list[str]) -> argparse.Namespace:
    benches = available()
    parser = last_resort.Parser(prog="scripts/bench", description=__doc__.split(": ", 1)[1])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"default: all of {', '.join(benches)}")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the rows as a JSON list too")
    parser.add_argument(
        "--quick", action="store_true", help="fewer runs and smaller sizes: a check, not a figure"
    )
    arguments = parser.parse_args(words)
    unknown = [name for name in arguments.names if name not in benches]
    if unknown:
        parser.error(f"no such bench: {', '.join(unknown)}; valid: {', '.join(benches)}")
    if arguments.json and not os.access(arguments.json.absolute().parent, os.W_OK):
        parser.error(
            f"--json {arguments.json}: its folder cannot be written"
        )  # not after minutes of measuring
    return arguments


def write_rows(path: Path, rows: list[dict[str, Any]]) -> None:
    write_whole(path, json.dumps(rows, indent=1) + "\n")


def measure(arguments: argparse.Namespace) -> int:
    """Run the benches and print their table; the exit code."""
    benches = available()
    rows: list[dict[str, Any]] = []
    try:
        where = machine()
    except ValueError as err:
        print(f"bench: {err}", file=sys.stderr)
        return 2
    print("on {processor}, instruction set {instruction_set}".format(**where), flush=True)
    for name in arguments.names or list(benches):
        start = time.monotonic()
        print(f"measuring {name} ...", flush=True)
        rows += [row | where for row in load(benches[name]).run(arguments.quick)]
        print(f"  {name} took {time.monotonic() - start:.0f} s", flush=True)
        if arguments.json:
            write_rows(arguments.json, rows)
    print_table(rows)
    missed = [row for row in rows if row.get("met") is False]
    print(f"{len(rows)} rows, {len(missed)} below their target")
    if arguments.quick:
        print("--quick shows that the benches run; its figures judge nothing")
    return 1 if missed and not arguments.quick else 0


def main() -> int:
    interrupt_on_signals()
    arguments = parse_arguments(sys.argv[1:])
    own_network.enter_or_say("bench")
    try:
        return measure(arguments)
    except KeyboardInterrupt:
        kept = (
            f"; the rows so far are in {arguments.json}" if arguments.json and arguments.json.exists() else ""
        )
        leave(f"bench: interrupted{kept}")


if __name__ == "__main__":
    last_resort.run(main, "bench")
