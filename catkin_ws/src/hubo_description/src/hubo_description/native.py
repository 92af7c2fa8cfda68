"""What native libraries print, kept off the terminal."""

import ctypes
import os
import sys
from contextlib import contextmanager


@contextmanager
def native_output_hidden():
    """Hide what native code prints to stdout and stderr (Bullet and GL are chatty); errors are raised, not printed."""
    sys.stdout.flush()
    sys.stderr.flush()
    saved, null = [os.dup(1), os.dup(2)], os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(null, 1)
        os.dup2(null, 2)
        yield
    finally:
        ctypes.CDLL(None).fflush(None)  # what C still holds back
        for fd, copy in enumerate(saved, start=1):
            os.dup2(copy, fd)
            os.close(copy)
        os.close(null)
