"""The inner loops and their gtest, cross-compiled for aarch64 and run under qemu."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1]
GTEST = Path("/usr/src/googletest/googletest")
COMPILER, EMULATOR = "aarch64-linux-gnu-g++", "qemu-aarch64"
# As the package compiles them.
FLAGS = ["-std=c++17", "-O2", "-ffp-contract=off", "-fno-math-errno", "-pthread"]


@pytest.mark.skipif(
    not (shutil.which(COMPILER) and shutil.which(EMULATOR) and GTEST.is_dir()),
    reason=f"{COMPILER}, {EMULATOR} or {GTEST} is not installed",
)
def test_the_kernels_for_arm_are_those_of_the_plain_loop(tmp_path: Path) -> None:
    program = tmp_path / "kernels"
    ours = ["src/core/lane_kernels.cpp", "src/core/plain_kernels.cpp", "test/test_lane_kernels.cpp"]
    includes = [
        "-Iinclude",
        "-Isrc/core",
        f"-I{GTEST}",
        f"-I{GTEST}/include",
        "-isystem",
        "/usr/include/eigen3",
    ]
    gtest = [str(GTEST / "src" / name) for name in ("gtest-all.cc", "gtest_main.cc")]
    subprocess.run(
        [COMPILER, "-static", *FLAGS, *includes, *ours, *gtest, "-o", str(program)],
        check=True,
        cwd=PACKAGE,
        capture_output=True,
    )
    ran = subprocess.run([EMULATOR, str(program)], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout[-2000:] + ran.stderr[-500:]
    assert "LaneKernels.UtilityIsThatOfThePlainLoop" in ran.stdout
