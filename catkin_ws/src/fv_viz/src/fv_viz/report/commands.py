"""The commands `report` and `compare`."""

from __future__ import annotations

import sys
from pathlib import Path

from fv_common.command import Parser
from fv_common.files import write_whole
from fv_viz.report import run_data
from fv_viz.report.compare import comparison
from fv_viz.report.page import report


def report_main(arguments: list[str] | None = None) -> int:
    """rosrun fv_viz report RUN_DIR [--out FILE]; returns the exit code."""
    parser = Parser(prog="rosrun fv_viz report", description="Write the report of a run folder.")
    parser.add_argument("run", type=Path, help="folder that scripts/explore left behind")
    parser.add_argument("--out", type=Path, help="file to write; default: report.html in the folder")
    options = parser.parse_args(arguments)
    try:
        data = run_data.load(options.run)
        target = options.out or options.run / "report.html"
        write_whole(target, report(data))
    except OSError as error:
        return _failed(error)
    for line in data.missing:
        print(f"left out: {line}")
    print(f"report: {target} ({target.stat().st_size / 1e6:.1f} MB)")
    return 0


def compare_main(arguments: list[str] | None = None) -> int:
    """rosrun fv_viz compare RUN_DIR RUN_DIR... [--out FILE] [--force]; returns the exit code."""
    parser = Parser(prog="rosrun fv_viz compare", description="Draw several runs in one page.")
    parser.add_argument("runs", type=Path, nargs="+", help="folders that scripts/explore left behind")
    parser.add_argument(
        "--out", type=Path, default=Path("comparison.html"), help="file to write (%(default)s)"
    )
    parser.add_argument("--force", action="store_true", help="replace the file if it is there")
    options = parser.parse_args(arguments)
    if options.out.exists() and not options.force:
        return _failed(f"{options.out} is there already: --force replaces it, --out FILE writes another")
    found = []
    for folder in options.runs:
        try:
            found.append(run_data.load(folder))
        except OSError as error:
            print(f"left out: {error}", file=sys.stderr)
    if not found:
        return _failed("none of the folders holds a run")
    try:
        write_whole(options.out, comparison(found))
    except OSError as error:
        return _failed(error)
    print(f"comparison: {options.out}")
    return 0


def _failed(why: object) -> int:
    print(f"error: {why}", file=sys.stderr)
    return 1
