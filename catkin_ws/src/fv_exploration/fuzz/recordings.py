"""PCD files and scan graphs of any content; the first byte is the kind. Scans that can be used, or a RecordingError."""

import contextlib
import os
import tempfile
from pathlib import Path

import numpy as np

from fv_exploration.recordings import RecordingError, read_scans

FOLDER = Path(tempfile.gettempdir(), f"fv-fuzz-{os.getpid()}")


def one_input(data: bytes) -> None:
    """Read the file; what comes out must be points and a rigid transform."""
    path = FOLDER.with_suffix(".graph" if data[:1] == b"g" else ".pcd")
    path.write_bytes(data[1:])
    with contextlib.suppress(RecordingError):
        for scan in read_scans(path, warn=lambda text: None):
            rotation = scan.T_map_sensor[:3, :3]
            assert scan.points_sensor.ndim == 2 and scan.points_sensor.shape[1] == 3
            assert np.isfinite(scan.T_map_sensor).all()
            assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6) and np.linalg.det(rotation) > 0
    path.unlink()
