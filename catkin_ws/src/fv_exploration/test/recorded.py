"""Small recordings for tests: PCD files, clouds as rosbags has them, bags."""

import struct
from types import SimpleNamespace

import numpy as np

UNTURNED = (0.0, 0.0, 0.0, 1.0)


def wall(count=40, distance_m=2.0):
    """(count^2, 3) points of a wall with a box before it, seen along z."""
    u, v = np.meshgrid(np.linspace(-0.5, 0.5, count), np.linspace(-0.5, 0.5, count))
    z = np.where((np.abs(u) < 0.15) & (np.abs(v) < 0.15), distance_m / 2, distance_m)
    return np.stack([u * z, v * z, z], axis=-1).reshape(-1, 3).astype(np.float32)


def pcd(points, data="binary", fields="x y z", kind="F", drop=(), **entries):
    """Bytes of a PCD file of three columns; header entries are replaced by name, or left out."""
    points = np.asarray(points)
    size = points.dtype.itemsize
    header = {
        "VERSION": "0.7",
        "FIELDS": fields,
        "SIZE": " ".join([str(size)] * 3),
        "TYPE": " ".join([kind] * 3),
        "COUNT": "1 1 1",
        "WIDTH": len(points),
        "HEIGHT": 1,
        "VIEWPOINT": "0 0 0 1 0 0 0",
        "POINTS": len(points),
        **entries,
    }
    text = "# .PCD v0.7\n" + "".join(f"{key} {value}\n" for key, value in header.items() if key not in drop)
    return f"{text}DATA {data}\n".encode() + body(points, data)


def body(points, data):
    if data == "ascii":
        return "".join(" ".join(str(value) for value in row) + "\n" for row in points).encode()
    if data == "binary":
        return points.tobytes()
    plain = points.T.tobytes()  # one field after the other
    packed = literal_lzf(plain)
    return struct.pack("<II", len(packed), len(plain)) + packed


def literal_lzf(data):
    """An LZF stream of literals only."""
    return b"".join(bytes([len(data[i : i + 32]) - 1]) + data[i : i + 32] for i in range(0, len(data), 32))


def cloud(points, order="<", kind="f4", **replaced):
    """A PointCloud2's members, of (N, 3) points; members are replaced by name."""
    columns = np.asarray(points).astype(order + kind)
    size = columns.dtype.itemsize
    datatype = {"i2": 3, "i4": 5, "f4": 7, "f8": 8}[kind]
    names = "xyz"
    members = {
        "height": 1,
        "width": len(columns),
        "fields": [
            SimpleNamespace(name=n, offset=size * i, datatype=datatype, count=1) for i, n in enumerate(names)
        ],
        "is_bigendian": order == ">",
        "point_step": 3 * size,
        "row_step": 3 * size * len(columns),
        "data": np.frombuffer(columns.tobytes(), np.uint8),
        "is_dense": False,
    }
    return SimpleNamespace(**{**members, **replaced})


def write_bag(path, clouds=(), transforms=()):
    """A ROS 1 bag.

    :param clouds: (topic, stamp [s], frame, members as ``cloud`` makes them).
    :param transforms: (topic, stamp [s], parent, child, x [m]), or with a quaternion x, y, z, w as sixth.
    """
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(
        get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage")
    )
    with Writer(path) as writer:
        connections = {}
        for topic, stamp_s, msg in [*_clouds(store.types, clouds), *_transforms(store.types, transforms)]:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, msg.__msgtype__, typestore=store)
            at = max(0, int(stamp_s * 1e9))
            writer.write(connections[topic], at, store.serialize_ros1(msg, msg.__msgtype__))


def _header(types, stamp_s, frame):
    stamp = types["builtin_interfaces/msg/Time"](sec=int(stamp_s), nanosec=round(stamp_s % 1 * 1e9))
    return types["std_msgs/msg/Header"](seq=0, stamp=stamp, frame_id=frame)


def _clouds(types, clouds):
    field = types["sensor_msgs/msg/PointField"]
    for topic, stamp_s, frame, members in clouds:
        fields = [field(**vars(item)) for item in members.fields]
        members = {**vars(members), "fields": fields, "header": _header(types, stamp_s, frame)}
        yield topic, stamp_s, types["sensor_msgs/msg/PointCloud2"](**members)


def _transforms(types, transforms):
    for topic, stamp_s, parent, child, x, *turned in transforms:
        place = types["geometry_msgs/msg/Transform"](
            translation=types["geometry_msgs/msg/Vector3"](x=x, y=0.0, z=0.0),
            rotation=types["geometry_msgs/msg/Quaternion"](*(turned[0] if turned else UNTURNED)),
        )
        stamped = types["geometry_msgs/msg/TransformStamped"](
            header=_header(types, stamp_s, parent), child_frame_id=child, transform=place
        )
        yield topic, stamp_s, types["tf2_msgs/msg/TFMessage"](transforms=[stamped])
