"""Coverage-guided fuzzing of whatever reads what others made: C++ by libFuzzer, Python by atheris, libFuzzer's too.

A target is a file in <package>/fuzz: NAME.cpp (built by scripts/fuzz/CMakeLists.txt) or NAME.py (run by
fuzz_python.py). Its seeds lie in <package>/fuzz/corpus/NAME. What is built and found, and inputs worth going on from,
are kept in .setup/fuzz.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ROOT / "catkin_ws" / "src"
STATE = ROOT / ".setup" / "fuzz"
BUILD = STATE / "build"
PYTHON = STATE / "python"  # atheris; only fuzzing needs it
WANTED = ROOT / "requirements" / "fuzz.txt"
HANG_S = 30  # for one input, on a machine that may be busy
GRACE_S = 240.0  # beyond its share: imports under instrumentation, on a machine that may be busy
OPTIONS = [
    f"-timeout={HANG_S}",
    "-rss_limit_mb=2048",
    "-malloc_limit_mb=1024",  # what a header promises must not be taken at its word
    "-print_final_stats=1",
]


SANITIZERS = {
    "ASAN_OPTIONS": "detect_leaks=0",  # urdfdom leaks on what it refuses; --sanitize looks for ours
    "UBSAN_OPTIONS": "print_stacktrace=1",
}


@dataclass(frozen=True)
class Target:
    """Something to fuzz."""

    package: str
    name: str
    command: tuple[str, ...]  # libFuzzer's options and files follow
    seeds: Path
    lacks: str = ""  # what must be installed first

    @property
    def title(self) -> str:
        return f"{self.package}/{self.name}"


@dataclass
class Outcome:
    """What became of a target. `problem` is empty where nothing was found."""

    target: Target
    runs: int = 0
    coverage: int = 0
    cpu_s: float = 0.0
    problem: str = ""


def is_python_ready() -> bool:
    """Is everything of requirements/fuzz.txt there?"""
    marker = PYTHON / WANTED.name
    return marker.is_file() and marker.read_bytes() == WANTED.read_bytes()


def python_commands() -> list[list[str]]:
    """Commands that install it; none where it is there."""
    if is_python_ready():
        return []
    install = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "-q",
        "--no-deps",
        "--disable-pip-version-check",
        "--upgrade",
    ]
    return [[*install, "--target", str(PYTHON), "-r", str(WANTED)], ["cp", str(WANTED), str(PYTHON)]]


def find_targets(packages: list[str], sources: Path = SOURCES) -> list[Target]:
    """The targets of these packages."""
    clang = "" if shutil.which("clang++") else "clang++ is not installed (requirements/apt.txt)"
    atheris = "" if is_python_ready() else "atheris could not be installed (requirements/fuzz.txt)"
    driver = Path(__file__).with_name("fuzz_python.py")
    found = []
    for package in packages:
        folder = sources / package / "fuzz"
        for file in sorted((*folder.glob("*.cpp"), *folder.glob("*.py"))):
            is_cpp = file.suffix == ".cpp"
            command = (
                (str(BUILD / package / file.stem),) if is_cpp else (sys.executable, str(driver), str(file))
            )
            lacks = clang if is_cpp else atheris
            found.append(Target(package, file.stem, command, folder / "corpus" / file.stem, lacks))
    return found


def build_commands(targets: list[Target]) -> list[list[str]]:
    """Commands that build the C++ ones; none where there is nothing to build."""
    wanted = [f"{t.package}_{t.name}" for t in targets if len(t.command) == 1 and not t.lacks]
    configure = [
        *("cmake", "-S", str(ROOT / "scripts" / "fuzz"), "-B", str(BUILD)),
        *("-DCMAKE_C_COMPILER=clang", "-DCMAKE_CXX_COMPILER=clang++", "-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"),
        f"-DFV_MESSAGES={ROOT / 'catkin_ws' / 'devel' / 'include'}",
    ]
    return [configure, ["make", "-C", str(BUILD), "-j2", *wanted]] if wanted else []


class Job:
    """One target as a process of its own."""

    def __init__(self, target: Target, seconds: float, work: Path, options: list[str], kept: Path) -> None:
        self.outcome = Outcome(target)
        self.log = work / f"{target.package}-{target.name}.log"
        kept.mkdir(parents=True, exist_ok=True)
        findings = STATE / "findings"
        findings.mkdir(parents=True, exist_ok=True)
        self._deadline = time.monotonic() + seconds + GRACE_S
        command = [
            *target.command,
            *OPTIONS,
            *options,
            f"-max_total_time={max(1, round(seconds))}",
            f"-artifact_prefix={findings / f'{target.package}-{target.name}-'}",
            str(kept),
            *([str(target.seeds)] if target.seeds.is_dir() else []),
        ]
        python = os.pathsep.join(filter(None, [os.environ.get("PYTHONPATH"), str(PYTHON)]))
        environment = {**os.environ, **SANITIZERS, "PYTHONPATH": python, "TMPDIR": str(work)}
        with self.log.open("wb") as output:
            self._process = subprocess.Popen(
                command,
                stdout=output,
                stderr=subprocess.STDOUT,
                stdin=subprocess.DEVNULL,
                start_new_session=True,
                env=environment,
                cwd=work,
            )

    def ended(self) -> bool:
        """True once the process is gone; then the outcome is told."""
        pid, status, usage = os.wait4(self._process.pid, os.WNOHANG)
        if pid == 0:
            if time.monotonic() < self._deadline:
                return False
            self.kill()
            self.outcome.problem = f"did not end by itself; its log ends:\n{self._text()[-600:]}"
            return True
        self._process.returncode = os.waitstatus_to_exitcode(status)
        self.outcome.cpu_s = usage.ru_utime + usage.ru_stime
        self._read(self._process.returncode)
        return True

    def kill(self) -> None:
        try:
            os.killpg(self._process.pid, signal.SIGKILL)
        except ProcessLookupError:
            return
        self._process.wait()

    def _text(self) -> str:
        return self.log.read_text(errors="replace")

    def _read(self, code: int) -> None:
        text = self._text()
        counts = re.findall(r"cov: (\d+)", text)
        runs = re.findall(r"number_of_executed_units: (\d+)|^#(\d+)\s", text, re.MULTILINE)
        self.outcome.coverage = int(counts[-1]) if counts else 0
        self.outcome.runs = int(runs[-1][0] or runs[-1][1]) if runs else 0
        if code != 0:
            self.outcome.problem = _problem(self.outcome.target, text, code)
        elif self.outcome.runs == 0:
            self.outcome.problem = f"ran nothing; its log ends:\n{text[-600:]}"


def _problem(target: Target, text: str, code: int) -> str:
    """What was found, the input that shows it, and how to see it again."""
    told = [
        line.strip()
        for line in text.splitlines()
        if re.search(r"runtime error:|ERROR: |^\w*(Error|Exception)\b|SUMMARY: (Add|Und)", line)
    ]
    written = re.search(r"Test unit written to (\S+)", text)
    lines = [*dict.fromkeys(told[:4])] or [f"ended with code {code}; its log ends: {text[-400:]}"]
    if written:
        lines.append(f"input: {written[1]}")
        lines.append(
            f"again: . scripts/env; PYTHONPATH=$PYTHONPATH:{PYTHON} {shlex.join(target.command)} {written[1]}"
        )
    return "\n    ".join(lines)


def fuzz(targets: list[Target], seconds: float, work: Path, lasting: bool) -> list[Outcome]:
    """Fuzz each target for an equal share of so many seconds on all cores together.

    :param lasting: go on from what earlier calls kept, with a random seed; otherwise from the seeds alone.
    """
    workers = os.cpu_count() or 1
    share = seconds * workers / max(1, len(targets))
    options = [] if lasting else ["-seed=1"]
    waiting, running, outcomes = list(targets), [], []
    try:
        while waiting or running:
            while waiting and len(running) < workers:
                target = waiting.pop(0)
                kept = (STATE if lasting else work) / "corpus" / target.package / target.name
                running.append(Job(target, share, work, options, kept))
            time.sleep(0.1)
            for job in [job for job in running if job.ended()]:
                running.remove(job)
                outcomes.append(job.outcome)
    finally:
        for job in running:
            job.kill()
    return outcomes
