"""Capability maps with a right checksum and any content: parts missing, of other types, sizes and numbers.

A map, or a CapabilityMapError.
"""

import contextlib
import hashlib
import io
import os
import struct
import tempfile
from pathlib import Path

import atheris
import h5py
import numpy as np

from capability_map import CapabilityMap, CapabilityMapError
from capability_map.shapes import RULES
from capability_map.store import MapData, save

PATH = Path(tempfile.gettempdir(), f"fv-fuzz-{os.getpid()}.h5")
BLOCK = 512


def right() -> bytes:
    """A map of two cells, three directions, one joint and one valid point."""
    shapes = {}
    for rule in RULES:
        shapes[f"{rule}_type"] = np.array([1], np.int32)
        shapes[f"{rule}_axis"] = np.array([[0.0, 0.0, 1.0]])
        shapes[f"{rule}_opening_rad"] = np.array([0.5])
        shapes[f"{rule}_error_percent"] = np.array([10.0])
    data = MapData(
        **dict.fromkeys(("robot", "group", "base_frame", "tip_frame", "backend"), "x"),
        urdf_sha256="0" * 64,
        parameters={},
        statistics={},
        joint_names=["a"],
        joint_limits=np.array([[-1.0, 1.0]]),
        reach_center_m=np.zeros(3),
        arm_length_m=0.5,
        pivot_m=0.1,
        grid_origin_m=np.zeros(3),
        grid_size=np.array([2, 1, 1], np.int32),
        radius_m=0.05,
        outward=np.eye(3),
        cells=np.array([1]),
        bits=np.array([[2]], np.uint64),
        witnesses=np.array([[100]], np.uint16),
        manipulability=np.array([0.5], np.float16),
        shapes=shapes,
    )
    save(PATH, data)
    return PATH.read_bytes()


RIGHT = right()


def one_input(data: bytes) -> None:
    """Change the right map, give it its checksum, load and ask it."""
    take = atheris.FuzzedDataProvider(data)
    image = io.BytesIO(RIGHT)
    with h5py.File(image, "r+") as file:
        for _ in range(take.ConsumeIntInRange(0, 3)):
            with contextlib.suppress(
                ValueError, TypeError, OSError, OverflowError
            ):  # h5py will not write all of it
                change(file, take)
    content = image.getvalue()[BLOCK:]
    line = f"capability_map 2 sha256 {hashlib.sha256(content).hexdigest()}\n".encode()
    PATH.write_bytes(line.ljust(BLOCK, b"\0") + content)
    try:
        cap = CapabilityMap.load(PATH)
        cap.query(np.array([[0.1, 0.05, 0.05]]), np.array([[0.0, 1.0, 0.0]]))
    except CapabilityMapError:
        assert data, "the right map must be read"


def change(file: h5py.File, take: atheris.FuzzedDataProvider) -> None:
    """One attribute or dataset away, or other than it was."""
    datasets: list[str] = []
    file.visititems(lambda name, item: datasets.append(name) if isinstance(item, h5py.Dataset) else None)
    if take.ConsumeBool():
        name = take.PickValueInList(sorted(file.attrs))
        del file.attrs[name]
        if take.ConsumeBool():
            file.attrs[name] = take.PickValueInList(
                ["", "{}", "[]", "null", "[1]", 7, np.nan, np.inf, b"\xff", [1, 2]]
            )
        return
    name = take.PickValueInList(sorted(datasets))
    if file[name].size > 2**20:  # an earlier change lied about it
        return
    values = file[name][...]
    how = take.ConsumeIntInRange(0, 5)
    del file[name]
    if how == 0:
        return
    if how == 1:  # a size that nothing was written for
        shape = tuple(take.ConsumeIntInRange(0, 2**40) if take.ConsumeBool() else n for n in values.shape)
        file.create_dataset(name, shape, values.dtype, chunks=tuple(4 for _ in shape))
    elif how == 2:
        file[name] = values.astype(take.PickValueInList(["f4", "i1", "u8", "S4", "c16", ">f8", "?"]))
    elif how == 3:
        file[name] = values[..., None]
    elif how == 4:
        file[name] = np.concatenate([values, values]) if take.ConsumeBool() else values[:0]
    else:
        number = struct.unpack("<d", take.ConsumeBytes(8).ljust(8, b"\0"))[0]
        if take.ConsumeBool():
            number = take.ConsumeIntInRange(-3, 2**33)
        values.flat[take.ConsumeIntInRange(0, max(values.size - 1, 0))] = number
        file[name] = values
