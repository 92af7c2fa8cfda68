"""World files of any content. A world, or a SimError."""

import contextlib
import os
import tempfile
from pathlib import Path

from hubo_sim.errors import SimError
from hubo_sim.worlds import load_world

PATH = Path(tempfile.gettempdir(), f"fv-fuzz-{os.getpid()}.yaml")


def one_input(data: bytes) -> None:
    """Read it."""
    PATH.write_bytes(data)
    with contextlib.suppress(SimError):
        load_world(str(PATH))
