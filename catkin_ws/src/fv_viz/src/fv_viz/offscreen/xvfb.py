"""An X server without a screen on a free display number."""

from __future__ import annotations

import os
import shutil
import subprocess

from fv_common import processes


class Xvfb:
    """Starts Xvfb, which picks its own free display number; `name` is the value for DISPLAY.

    Raises RuntimeError when the program is missing or does not come up in time.
    """

    def __init__(self, width: int = 1920, height: int = 1400, timeout_s: float = 60.0) -> None:
        program = shutil.which("Xvfb")
        if program is None:
            raise RuntimeError("no display and no Xvfb: set DISPLAY or install the package xvfb")
        reader, writer = os.pipe()
        arguments = [
            program,
            "-displayfd",
            str(writer),
            "-screen",
            "0",
            f"{width}x{height}x24",
            *("-nolisten", "tcp"),
            # Its socket file would replace that of a display outside of this network namespace, which it cannot see.
            *("-nolisten", "unix"),
        ]
        self._process = subprocess.Popen(
            arguments,
            pass_fds=[writer],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            preexec_fn=processes.die_with_parent,
        )
        os.close(writer)
        number = processes.read_line(reader, timeout_s)
        os.close(reader)
        if not number:
            self.close()
            raise RuntimeError(f"Xvfb did not come up within {timeout_s:g} s")
        self.name = f":{number.decode().strip()}"

    def close(self) -> None:
        """End the server."""
        processes.stop(self._process)
