"""Bags: clouds of any layout and transforms of any shape, or any bytes at all.

Scans that can be used, or a RecordingError.
"""

import contextlib
import os
import tempfile
from pathlib import Path

import atheris
import numpy as np
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from fv_exploration.recordings import RecordingError, read_scans

STORE = get_typestore(Stores.ROS1_NOETIC)
STORE.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"))
FRAMES = ["camera", "hand", "base", "world", "/base", ""]
PATH = Path(tempfile.gettempdir(), f"fv-fuzz-{os.getpid()}.bag")


def one_input(data: bytes) -> None:
    """Write a bag and read it; what comes out must be points and a rigid transform."""
    PATH.unlink(missing_ok=True)
    take = atheris.FuzzedDataProvider(data[1:])
    if data[:1] == b"#":
        PATH.write_bytes(data)
    else:
        write(take)
    with contextlib.suppress(RecordingError):
        for scan in read_scans(
            PATH, map_frame=take.PickValueInList(["", "world", "base"]), warn=lambda text: None
        ):
            rotation = scan.T_map_sensor[:3, :3]
            assert scan.points_sensor.shape[1:] == (3,)
            assert np.isfinite(scan.T_map_sensor).all()
            assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6) and np.linalg.det(rotation) > 0


def write(take: atheris.FuzzedDataProvider) -> None:
    """A bag of a few transforms and clouds."""
    with Writer(PATH) as bag:
        for topic in ("/tf", "/tf_static")[: take.ConsumeIntInRange(0, 2)]:
            edges = [edge(take) for _ in range(take.ConsumeIntInRange(0, 4))]
            send(bag, topic, STORE.types["tf2_msgs/msg/TFMessage"](edges), take)
        for topic in ("/points", "/more")[: take.ConsumeIntInRange(0, 2)]:
            for _ in range(take.ConsumeIntInRange(1, 2)):
                send(bag, topic, cloud(take), take)


def send(bag: Writer, topic: str, msg: object, take: atheris.FuzzedDataProvider) -> None:
    """One message on a topic; the last bytes may be lost."""
    known = [c for c in bag.connections if c.topic == topic]
    connection = known[0] if known else bag.add_connection(topic, msg.__msgtype__, typestore=STORE)
    raw = bytes(STORE.serialize_ros1(msg, msg.__msgtype__))
    lost = take.ConsumeIntInRange(0, 255)
    bag.write(connection, 10**9, raw[: len(raw) - lost] if lost < 16 else raw)


def header(take: atheris.FuzzedDataProvider) -> object:
    stamp = STORE.types["builtin_interfaces/msg/Time"](
        take.ConsumeIntInRange(0, 3), take.ConsumeIntInRange(0, 10**9)
    )
    return STORE.types["std_msgs/msg/Header"](0, stamp, take.PickValueInList(FRAMES))


def edge(take: atheris.FuzzedDataProvider) -> object:
    numbers = [number(take) for _ in range(3)]
    turn = [number(take) for _ in range(4)] if take.ConsumeBool() else [0.0, 0.0, 0.0, 1.0]
    types = STORE.types
    transform = types["geometry_msgs/msg/Transform"](
        types["geometry_msgs/msg/Vector3"](*numbers), types["geometry_msgs/msg/Quaternion"](*turn)
    )
    return types["geometry_msgs/msg/TransformStamped"](header(take), take.PickValueInList(FRAMES), transform)


def cloud(take: atheris.FuzzedDataProvider) -> object:
    kind = STORE.types["sensor_msgs/msg/PointField"]
    usual = take.ConsumeBool()
    fields = [kind(name, 4 * i, 7, 1) for i, name in enumerate("xyz")] if usual else [
        kind(take.PickValueInList(["x", "y", "z", "_"]), take.ConsumeIntInRange(0, 40), take.ConsumeIntInRange(0, 9),
             take.ConsumeIntInRange(0, 3))
        for _ in range(take.ConsumeIntInRange(0, 5))
    ]  # fmt: skip
    data = np.frombuffer(take.ConsumeBytes(take.ConsumeIntInRange(0, 120)), np.uint8)
    sizes = [1, len(data) // 12, 12, len(data)] if take.ConsumeBool() else [take.ConsumeIntInRange(0, 2**32 - 1) if
             take.ConsumeBool() else take.ConsumeIntInRange(0, 24) for _ in range(4)]  # fmt: skip
    height, width, point_step, row_step = sizes
    return STORE.types["sensor_msgs/msg/PointCloud2"](
        header(take),
        height,
        width,
        fields,
        take.ConsumeBool(),
        point_step,
        row_step,
        data,
        take.ConsumeBool(),
    )


def number(take: atheris.FuzzedDataProvider) -> float:
    """Of a scene's size, or anything."""
    return take.ConsumeFloat() if take.ConsumeBool() else take.ConsumeIntInRange(-64, 64) / 16.0
