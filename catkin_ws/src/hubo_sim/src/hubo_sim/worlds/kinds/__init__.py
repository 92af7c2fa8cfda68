"""Worlds made from a seed. Each module here is a kind, named as its file: a new one is a new file (see room.py).

`make(rng, seed)` returns the content of a world file; the same seed gives the same world.
"""

import importlib
import pkgutil
from typing import Any

import numpy as np

KINDS = tuple(sorted(m.name for m in pkgutil.iter_modules(__path__) if not m.name.startswith("_")))


def generate(kind: str, seed: int) -> dict[str, Any]:
    """Content of a world file of a kind, one of KINDS."""
    return importlib.import_module(f"{__name__}.{kind}").make(np.random.default_rng(seed), seed)
