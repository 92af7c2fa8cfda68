"""Fuzzes one Python target, coverage-guided: fuzz_python.py TARGET.py [libFuzzer's options and files].

A target is a module with `one_input(data: bytes) -> None`, which raises on what must not happen. Files that are given
are run once each: that is how a finding is replayed.
"""

from __future__ import annotations

import importlib.util
import logging
import resource
import sys
from pathlib import Path

import atheris

OURS = ["capability_map", "fv_common", "fv_exploration", "hubo_description", "hubo_sim"]
MOST_MEMORY = 3 << 30  # of addresses: what a file promises must not be taken


def load(path: Path):
    """The target's module; our own packages are instrumented as it imports them."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    with atheris.instrument_imports(include=OURS):
        spec.loader.exec_module(module)
    return module


def main() -> None:
    """Never returns: libFuzzer ends the process."""
    target = load(Path(sys.argv[1]))
    logging.disable(logging.CRITICAL)
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    atheris.Setup([sys.argv[0], *sys.argv[2:]], target.one_input)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
