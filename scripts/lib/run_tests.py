"""scripts/test: style gates, gtest, pytest and rostest, counted together."""
# long: one command and its stages

from __future__ import annotations

import argparse
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import IO

import fuzzing
import last_resort
import own_network
from interrupts import INTERRUPTED, interrupt_on_signals

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ROOT / "catkin_ws" / "src"
BUILD = ROOT / "catkin_ws" / "build"
DEVEL = ROOT / "catkin_ws" / "devel"
DOCUMENTS = ROOT / "scripts" / "lib" / "tests" / "documents"
OWN_NETWORK = [sys.executable, str(ROOT / "scripts" / "lib" / "own_network.py")]
SLOW_S = 20.0
SUITE_TIMEOUT_S = 1500.0
FUZZ_S = 60.0  # of the ordinary tests, for all packages
SANITIZER_FLAGS = (
    "-O1 -g1 -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=undefined"
)


@dataclass
class Tally:
    """Counts of test cases, and what a person has to know about those that did not pass."""

    passed: int = 0
    failed: int = 0
    skipped: list[str] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)
    slow: list[tuple[float, str]] = field(default_factory=list)

    def add(self, other: Tally) -> None:
        self.passed += other.passed
        self.failed += other.failed
        self.skipped += other.skipped
        self.failures += other.failures
        self.slow += other.slow

    def fail(self, what: str) -> None:
        self.failed += 1
        self.failures.append(what)

    def add_junit(self, path: Path, suite: str, exit_code: int) -> None:
        """Count the cases of a JUnit file; a missing or empty one, or an unexplained exit code, is a failure."""
        failed_before = self.failed
        try:
            cases = list(ElementTree.parse(path).getroot().iter("testcase"))
        except (OSError, ElementTree.ParseError):
            cases = []
        if not cases:
            self.fail(f"{suite}: left no test results (exit code {exit_code})")
            return
        for case in cases:
            self._add_case(case, suite)
        if exit_code != 0 and self.failed == failed_before:
            self.fail(f"{suite}: ended with code {exit_code} although no test case failed")

    def _add_case(self, case: ElementTree.Element, suite: str) -> None:
        name = f"{suite}: {case.get('classname', '')}.{case.get('name', '')}"
        problem = next((child for child in case if child.tag in ("failure", "error")), None)
        skip = case.find("skipped")
        if problem is not None:
            self.fail(f"{name}: {(problem.get('message') or problem.text or '').strip()[:400]}")
        elif skip is not None or case.get("status") == "notrun":
            self.skipped.append(f"{name}: {skip.get('message', '') if skip is not None else 'not run'}")
        else:
            self.passed += 1
        seconds = float(case.get("time") or 0.0)
        if seconds >= SLOW_S:
            self.slow.append((seconds, name))


@dataclass(frozen=True)
class Suite:
    """Tests that run together, beside other suites."""

    name: str
    run: Callable[[Tally, Path], None]  # given where to count and the folder for logs


class Processes:
    """The process groups that are running, so that an interruption ends them."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._running: set[int] = set()
        self.closed = False

    def run(self, command: list[str], output: IO[bytes], **options) -> int:
        """Run a command in a process group of its own; its exit code, 124 if it took too long."""
        with self._lock:
            if self.closed:
                return INTERRUPTED
            process = subprocess.Popen(
                command,
                stdout=output,
                stderr=subprocess.STDOUT,
                stdin=subprocess.DEVNULL,
                start_new_session=True,
                **options,
            )
            self._running.add(process.pid)
        try:
            return process.wait(SUITE_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            return 124
        finally:
            self._end(process.pid)
            process.wait()
            with self._lock:
                self._running.discard(process.pid)

    def end_all(self) -> None:
        """End what runs; nothing starts any more."""
        with self._lock:
            self.closed = True
            running = list(self._running)
        for group in running:
            self._end(group)

    @staticmethod
    def _end(group: int) -> None:
        for how in (signal.SIGTERM, signal.SIGKILL):
            try:
                os.killpg(group, how)
            except ProcessLookupError:
                break
            time.sleep(0.2)


PROCESSES = Processes()


def run(command: list[str], log: Path, **options) -> int:
    """Run a command, output into a log; the exit code. Its process group is ended with it."""
    with log.open("wb") as output:
        return PROCESSES.run(command, output, **options)


def run_suites(suites: list[Suite], tally: Tally, work: Path, jobs: int) -> None:
    """Run so many suites at a time, in this order; a line as each ends."""

    lock = threading.Lock()

    def one(suite: Suite) -> None:
        counted, start = Tally(), time.monotonic()
        suite.run(counted, work)
        if PROCESSES.closed:
            return
        counts = f"{counted.passed} passed, {counted.failed} failed"
        print(f"  {suite.name} took {time.monotonic() - start:.0f} s ({counts})", flush=True)
        with lock:
            tally.add(counted)

    with ThreadPoolExecutor(jobs) as pool:
        waiting = [pool.submit(one, suite) for suite in suites]
        try:
            for suite in waiting:
                suite.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            PROCESSES.end_all()
            raise


def packages() -> list[str]:
    """Names of the packages of this workspace."""
    return sorted(path.parent.name for path in SOURCES.glob("*/package.xml"))


def source_files(*suffixes: str) -> list[str]:
    """Our own files with these suffixes ("" takes in the executables), for the gates."""
    files = (path for folder in (SOURCES, ROOT / "scripts") for path in sorted(folder.rglob("*")))
    return [
        str(path)
        for path in files
        if path.suffix in suffixes and path.is_file() and "__pycache__" not in path.parts
    ]


def check_gates(tally: Tally, work: Path) -> None:
    """Style gates: each is one test case."""
    python = [
        name
        for name in source_files(".py", "")
        if name.endswith(".py") or Path(name).read_bytes().startswith(b"#!/usr/bin/env python3")
    ]
    cpp = source_files(".cpp", ".hpp", ".h")
    gates = {
        "ruff check": ["ruff", "check", "--output-format", "concise", *python],
        "ruff format": ["ruff", "format", "--check", *python],
        "clang-format": ["clang-format", "--dry-run", "--Werror", *cpp],
        "catkin_lint": ["/usr/bin/catkin_lint", "--quiet", "-W1", "--strict", str(SOURCES)],
        "lengths": [sys.executable, str(ROOT / "scripts" / "lib" / "lengths.py"), *python, *cpp],
        "YAML": [sys.executable, "-c", CHECK_YAML, *source_files(".yaml", ".yml")],
    }
    for name, command in gates.items():
        log = work / f"gate-{name.replace(' ', '-')}.log"
        if run(command, log, cwd=ROOT) == 0:
            tally.passed += 1
        else:
            tally.fail(f"gate {name}:\n{log.read_text(errors='replace')[-3000:]}")


CHECK_YAML = "import sys, yaml\nfor name in sys.argv[1:]: list(yaml.safe_load_all(open(name)))"


def gtest_programs() -> list[tuple[str, Path]]:
    """(package, executable) of every gtest that the build declares, built or not."""
    listed = subprocess.run(
        ["ctest", "--test-dir", str(BUILD), "-N"], capture_output=True, text=True, check=True
    )
    found = re.findall(r"_ctest_(\w+?)_gtest_(\w+)", listed.stdout)
    known = packages()
    return [(package, DEVEL / "lib" / package / name) for package, name in found if package in known]


def gtest_suites(only: list[str]) -> list[Suite]:
    """Every gtest program."""
    return [
        Suite(f"{package}/{program.name}", partial(gtest, f"{package}/{program.name}", program))
        for package, program in gtest_programs()
        if package in only
    ]


def gtest(suite: str, program: Path, tally: Tally, work: Path) -> None:
    if not program.exists():
        tally.fail(f"{suite}: was not built")
        return
    report = work / f"{suite.replace('/', '-')}.xml"
    code = run([str(program), f"--gtest_output=xml:{report}"], work / f"{program.name}.log", cwd=work)
    tally.add_junit(report, suite, code)


def pytest_suites(only: list[str]) -> list[Suite]:
    """The pytest files of every package, and of the scripts, in one process each."""
    folders = {name: SOURCES / name / "test" for name in only} | {
        "scripts": ROOT / "scripts" / "lib" / "tests"
    }
    return [
        pytest_suite(name, f"--ignore={DOCUMENTS}", str(folder))
        for name, folder in folders.items()
        if list(folder.rglob("test_*.py"))
    ]


def pytest_suite(name: str, *arguments: str) -> Suite:
    return Suite(f"{name}/pytest", partial(pytest, name, arguments))


def pytest(name: str, arguments: Sequence[str], tally: Tally, work: Path) -> None:
    """One run of pytest; its log and report are named after it."""
    report = work / f"{name}-pytest.xml"
    command = [
        *OWN_NETWORK,
        sys.executable,
        "-m",
        "pytest",
        "-p",
        "no:cacheprovider",
        f"--junitxml={report}",
        *arguments,
    ]
    code = run(command, work / f"{name}-pytest.log", cwd=ROOT)
    tally.add_junit(report, f"{name}/pytest", code)


def document_suites(only: list[str]) -> list[Suite]:
    """The commands of all documents, or of those of some packages."""
    chosen = [] if only == packages() else [f"[{name}]" for name in only]
    return [pytest_suite("documents", str(DOCUMENTS), "-k", " or ".join(["plan", *chosen]) if chosen else "")]


def rostest_suites(only: list[str]) -> list[Suite]:
    """Every .test file, each with a master of its own."""
    return [
        Suite(f"{name}/{launch.name}", partial(rostest, name, launch))
        for name in only
        for launch in sorted((SOURCES / name / "test").glob("*.test"))
    ]


def rostest(name: str, launch: Path, tally: Tally, work: Path) -> None:
    home = work / f"{name}-{launch.stem}"
    home.mkdir()
    environment = dict(
        os.environ, ROS_HOME=str(home), ROS_LOG_DIR=str(home / "log"), ROS_HOSTNAME="localhost"
    )
    environment.pop("ROS_MASTER_URI", None)
    code = run(
        [*OWN_NETWORK, "rostest", name, launch.name], work / f"{name}-{launch.stem}.log", env=environment
    )
    reports = [path for path in home.glob("test_results/**/*.xml") if "rostest-" not in path.name]
    if not reports:
        tally.fail(f"{name}/{launch.name}: left no test results (exit code {code})")
    for report in reports:
        tally.add_junit(report, f"{name}/{launch.name}", code)


def run_sanitized(only: list[str], tally: Tally, work: Path) -> None:
    """The gtests once more, built with address and undefined-behaviour sanitizers."""
    programs = [(package, program.name) for package, program in gtest_programs() if package in only]
    build, devel = ROOT / ".setup" / "sanitized" / "build", ROOT / ".setup" / "sanitized" / "devel"
    command = [
        "catkin_make",
        *("-C", str(ROOT / "catkin_ws"), "--build", str(build)),
        f"-DCATKIN_DEVEL_PREFIX={devel}",
        *("-DCMAKE_BUILD_TYPE=None", f"-DCMAKE_CXX_FLAGS={SANITIZER_FLAGS}", "-DCATKIN_ENABLE_TESTING=ON"),
        f"-DPYTHON_EXECUTABLE={sys.executable}",
        *("-DCMAKE_CXX_COMPILER_LAUNCHER=ccache", "-j2"),
        *(name for _, name in programs),
    ]
    log = work / "sanitized-build.log"
    if run(command, log) != 0:
        tally.fail(f"build with sanitizers:\n{log.read_text(errors='replace')[-2000:]}")
        return
    known = work / "known-leaks.txt"
    known.write_text("leak:urdf::parseURDF\n")  # urdfdom never frees a URDF with a circle, which it refuses
    # Before the libraries of the ordinary build, which the environment names: these would be tested instead.
    libraries = os.pathsep.join(filter(None, [str(devel / "lib"), os.environ.get("LD_LIBRARY_PATH")]))
    environment = {
        **os.environ,
        "LSAN_OPTIONS": f"suppressions={known}",
        "LD_LIBRARY_PATH": libraries,
    }
    for package, name in programs:
        report = work / f"sanitized-{name}.xml"
        arguments = [str(devel / "lib" / package / name), f"--gtest_output=xml:{report}"]
        code = run(arguments, work / f"sanitized-{name}.log", cwd=work, env=environment)
        tally.add_junit(report, f"sanitized {package}/{name}", code)


def run_fuzzing(only: list[str], minutes: float | None, tally: Tally, work: Path) -> None:
    """Fuzz targets, each a test case; an ordinary run's minute is shared as if all packages were asked for."""
    for command in fuzzing.python_commands():
        if run(command, work / "fuzz-python.log") != 0:
            break
    targets = fuzzing.find_targets(only)
    for target in targets:
        if target.lacks:
            tally.skipped.append(f"fuzz {target.title}: {target.lacks}")
    ready = [target for target in targets if not target.lacks]
    for command in fuzzing.build_commands(ready):
        log = work / "fuzz-build.log"
        if run(command, log) != 0:
            tally.fail(f"build of the fuzz targets:\n{log.read_text(errors='replace')[-2000:]}")
            return
    seconds = (
        FUZZ_S * len(targets) / len(fuzzing.find_targets(packages())) if minutes is None else 60 * minutes
    )
    for outcome in fuzzing.fuzz(ready, seconds, work, lasting=minutes is not None):
        if outcome.problem:
            tally.fail(f"fuzz {outcome.target.title}: {outcome.problem}")
        else:
            tally.passed += 1
        if minutes is not None:
            figures = f"{outcome.runs} inputs in {outcome.cpu_s:.0f} CPU s, coverage {outcome.coverage}"
            print(f"  {outcome.target.title}: {figures}", flush=True)


def parse_arguments(words: list[str]) -> argparse.Namespace:
    parser = last_resort.Parser(prog="scripts/test", description="Run every test of the workspace.")
    parser.add_argument("packages", nargs="*", metavar="PACKAGE", help="only these packages (default: all)")
    parser.add_argument(
        "--fast", action="store_true", help="skip the rostests, the fuzzing and the commands of the documents"
    )
    parser.add_argument(
        "--sanitize", action="store_true", help="run the C++ tests under ASan and UBSan instead of all else"
    )
    parser.add_argument(
        "--fuzz",
        type=float,
        metavar="MINUTES",
        help="fuzz for so many minutes in all instead of all else (the ordinary tests do it for one minute)",
    )
    parser.add_argument("--logs", type=Path, metavar="DIR", help="keep logs and reports here")
    arguments = parser.parse_args(words)
    unknown = sorted(set(arguments.packages) - set(packages()))
    if unknown:
        parser.error(f"no such package: {', '.join(unknown)}; valid: {', '.join(packages())}")
    if arguments.fuzz is not None and not 0.0 < arguments.fuzz <= 10_000.0:
        parser.error(f"--fuzz is {arguments.fuzz:g}; valid: minutes, above 0 and up to 10000")
    return arguments


def report(tally: Tally) -> int:
    """Print what happened; the exit code."""
    for seconds, name in sorted(tally.slow, reverse=True):
        print(f"slow: {seconds:6.1f} s  {name}")
    for text in tally.skipped:
        print(f"skipped: {text}")
    for text in tally.failures:
        print(f"FAILED {text}")
    if tally.skipped:
        print(f"{len(tally.skipped)} skipped, named above")
    print(f"{tally.passed} passed, {tally.failed} failed")
    return 1 if tally.failed or not tally.passed else 0


def chosen_suites(arguments: argparse.Namespace) -> list[Suite]:
    """What is to run, the longest first."""
    only = arguments.packages or packages()
    if arguments.sanitize:
        return [Suite("gtest with sanitizers", partial(run_sanitized, only))]
    if arguments.fuzz is not None:
        return [Suite("fuzzing", partial(run_fuzzing, only, arguments.fuzz))]
    short = [Suite("style gates", check_gates), *pytest_suites(only), *gtest_suites(only)]
    if arguments.fast:
        return short
    fuzz = Suite("fuzzing", partial(run_fuzzing, only, None))
    return [*document_suites(only), fuzz, *rostest_suites(only), *short]


def main() -> int:
    interrupt_on_signals()
    arguments = parse_arguments(sys.argv[1:])
    refused = own_network.refusal()
    if refused:
        print(f"test: {own_network.OPEN_DOORS.format(refused)}", flush=True)
    work = Path(tempfile.mkdtemp(prefix="fv-test-"))
    tally = Tally()
    # Two suites on one network might ask for one port.
    jobs = 1 if refused else max(1, min(4, len(os.sched_getaffinity(0))))
    try:
        run_suites(chosen_suites(arguments), tally, work, jobs)
        return report(tally)
    except KeyboardInterrupt:
        print(f"test: interrupted; {tally.passed} passed, {tally.failed} failed so far", file=sys.stderr)
        return INTERRUPTED
    finally:
        if arguments.logs:
            shutil.copytree(work, arguments.logs, dirs_exist_ok=True)
        shutil.rmtree(work, ignore_errors=True)


if __name__ == "__main__":
    last_resort.run(main, "test")
