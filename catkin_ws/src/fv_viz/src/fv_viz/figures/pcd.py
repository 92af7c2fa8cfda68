"""Reading of recorded clouds: PCD (ascii and binary), .npy and .npz."""

from __future__ import annotations

from pathlib import Path

import numpy as np

_TYPES = {"F": "f", "I": "i", "U": "u"}

# A camera at eye height that looks ahead, z of the optical frame along x of the map: for clouds without a pose.
T_MAP_CAMERA = np.array(
    [[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]]
)


def read_points(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) in the sensor's frame and T_map_sensor (4, 4).

    Raises OSError, or ValueError or KeyError that says what is wrong with the file.
    """
    if path.suffix == ".npz":
        with np.load(path) as file:
            return np.asarray(file["points"], dtype=float).reshape(-1, 3), np.asarray(
                file.get("pose", T_MAP_CAMERA)
            )
    if path.suffix == ".npy":
        return np.load(path).astype(float).reshape(-1, 3), T_MAP_CAMERA
    return read_pcd(path.read_bytes()), T_MAP_CAMERA


def read_pcd(content: bytes) -> np.ndarray:
    """x y z (N, 3) of a PCD file's bytes, version 0.7; compressed files are refused."""
    header, start = _header(content)
    sizes, kinds = header["SIZE"], header["TYPE"]
    counts = header.get("COUNT", ["1"] * len(sizes))
    names = header["FIELDS"]
    fields = [
        (n, f"<{_TYPES[t]}{s}", (int(c),)) for n, t, s, c in zip(names, kinds, sizes, counts, strict=True)
    ]
    kind, total = header["DATA"][0], int(header["POINTS"][0])
    if kind == "binary":
        rows = np.frombuffer(content, dtype=np.dtype(fields), count=total, offset=start)
        return np.column_stack([rows[axis][:, 0] for axis in "xyz"]).astype(float)
    if kind == "ascii":
        table = np.array(content[start:].split(), dtype=float).reshape(total, -1)
        return table[:, [names.index(axis) for axis in "xyz"]]
    raise ValueError(f"PCD data of kind {kind!r}; valid: ascii, binary")


def _header(content: bytes) -> tuple[dict[str, list[str]], int]:
    out, at = {}, 0
    while "DATA" not in out:
        end = content.find(b"\n", at)
        if end < 0 or end > 4096:
            raise ValueError("no PCD header")
        words = content[at:end].decode("ascii", "replace").split()
        if words and not words[0].startswith("#"):
            out[words[0]] = words[1:]
        at = end + 1
    missing = {"FIELDS", "SIZE", "TYPE", "POINTS"} - set(out)
    if missing:
        raise ValueError(f"PCD header without {', '.join(sorted(missing))}")
    return out, at
