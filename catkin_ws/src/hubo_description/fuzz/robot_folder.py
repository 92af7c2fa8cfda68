"""One file of a robot's folder with any content: its name in the first line, what it holds behind. A robot, or a
RobotDescriptionError."""

import contextlib
import os
import shutil
import tempfile
from pathlib import Path

from hubo_description import RobotDescriptionError, load_robot, robots_folder

FOLDER = Path(tempfile.gettempdir(), f"fv-fuzz-{os.getpid()}")
shutil.copytree(robots_folder() / "youbot_arm", FOLDER)
RIGHT = {path.name: path.read_bytes() for path in FOLDER.iterdir()}


def one_input(data: bytes) -> None:
    """Replace the file, load the robot, put the file back."""
    name, _, content = data.partition(b"\n")
    name = name.decode("ascii", "replace")
    if name not in RIGHT:
        return
    (FOLDER / name).write_bytes(content)
    with contextlib.suppress(RobotDescriptionError):
        load_robot(FOLDER)
    (FOLDER / name).write_bytes(RIGHT[name])
