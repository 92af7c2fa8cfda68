"""Readers of recorded clouds, and the command that evaluates them."""

import doctest
import json
import os
import struct
from pathlib import Path

import numpy as np
import pytest

import fv_exploration
from fv_exploration import evaluate_cloud
from fv_exploration.bag_clouds import TransformTree
from fv_exploration.recordings import RecordingError, decompress_lzf, read_scans

POINTS = np.array([[1.0, 0.5, 0.25], [np.nan] * 3, [2.0, -0.5, 0.75]], np.float32)


def header(data, points=3, fields="x y z"):
    return (
        f"# .PCD v0.7\nVERSION 0.7\nFIELDS {fields}\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {points}\nHEIGHT 1\n"
        f"VIEWPOINT 0.5 0 0 0 0 0 1\nPOINTS {points}\nDATA {data}\n"
    ).encode()


def literal_lzf(data):
    """An LZF stream of literals only."""
    return b"".join(bytes([len(data[i : i + 32]) - 1]) + data[i : i + 32] for i in range(0, len(data), 32))


def pcd(kind):
    if kind == "ascii":
        return header(kind) + b"1 0.5 0.25\nnan nan nan\n2 -0.5 0.75\n"
    if kind == "binary":
        return header(kind) + POINTS.tobytes()
    plain = POINTS.T.tobytes()  # one field after the other
    packed = literal_lzf(plain)
    return header(kind) + struct.pack("<II", len(packed), len(plain)) + packed


@pytest.mark.parametrize("kind", ["ascii", "binary", "binary_compressed"])
def test_every_kind_of_pcd_gives_the_same_points_and_viewpoint(tmp_path, kind):
    path = tmp_path / "cloud.pcd"
    path.write_bytes(pcd(kind))
    (scan,) = read_scans(path)
    assert np.array_equal(scan.points_sensor, POINTS, equal_nan=True)
    assert np.allclose(scan.T_map_sensor, [[-1, 0, 0, 0.5], [0, -1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


@pytest.mark.parametrize("kind", ["ascii", "binary", "binary_compressed"])
def test_pcds_that_are_cut_off_are_refused(tmp_path, kind):
    path = tmp_path / "cloud.pcd"
    path.write_bytes(pcd(kind)[:-6])
    with pytest.raises(RecordingError):
        list(read_scans(path))


@pytest.mark.parametrize("kind", ["ascii", "binary", "binary_compressed"])
def test_damaged_pcds_are_read_or_refused_by_name(tmp_path, kind):
    path = tmp_path / "cloud.pcd"
    whole = pcd(kind)
    random = np.random.default_rng(7)
    refused = 0
    for _ in range(500):
        damaged = bytearray(whole)
        for at in random.integers(len(whole), size=random.integers(1, 4)):
            damaged[at] ^= 1 << random.integers(8)
        path.write_bytes(damaged)
        try:
            list(read_scans(path))
        except RecordingError as error:
            assert str(path) in str(error)
            refused += 1
    assert refused > 50
    path.write_bytes(whole.replace(b"TYPE F F F", b"TYPE G F F"))
    with pytest.raises(RecordingError, match=r"cloud\.pcd"):
        list(read_scans(path))


def test_pcds_without_coordinates_or_header_are_refused(tmp_path):
    path = tmp_path / "cloud.pcd"
    for data, text in ((header("ascii", fields="a b c"), "needs x, y and z"), (b"\x89PNG\r\n", "header")):
        path.write_bytes(data)
        with pytest.raises(RecordingError, match=text):
            list(read_scans(path))
    with pytest.raises(RecordingError, match="no such file"):
        list(read_scans(tmp_path / "none.pcd"))
    other = tmp_path / "cloud.xyz"
    other.write_text("1 2 3")
    with pytest.raises(RecordingError, match=r"valid: \.pcd"):
        list(read_scans(other))


def test_lzf_copies_what_came_before():
    stream = bytes([2]) + b"abc" + bytes([7 << 5, 0, 2])  # nine more bytes from three back
    assert decompress_lzf(stream, 12) == b"abc" * 4
    with pytest.raises(RecordingError, match="before their begin"):
        decompress_lzf(bytes([0]) + b"a" + bytes([1 << 5, 9]), 4)


def graph_bytes():
    points = b"".join(struct.pack("<I3d", 3, *p) for p in [(1.0, 0, 0), (0, 2.0, 0)])
    pose = struct.pack("<I3d", 3, 0.5, 0, 0) + struct.pack("<I4d", 4, 1, 0, 0, 0)
    return struct.pack("<II", 1, 2) + points + pose + struct.pack("<II", 0, 0)


def test_scan_graphs_are_read_with_their_poses(tmp_path):
    path = tmp_path / "scans.graph"
    path.write_bytes(graph_bytes())
    (scan,) = read_scans(path)
    assert np.allclose(scan.points_sensor, [[1, 0, 0], [0, 2, 0]])
    assert np.allclose(scan.T_map_sensor[:3, 3], [0.5, 0, 0])
    path.write_bytes(graph_bytes()[:50])
    with pytest.raises(RecordingError, match="cut off"):
        list(read_scans(path))


def test_bags_are_read_with_the_transform_of_the_clouds_stamp(tmp_path):
    path = tmp_path / "scans.bag"
    write_bag(path)
    (scan,) = read_scans(path)
    assert np.allclose(scan.points_sensor[[0, 2]], POINTS[[0, 2]])
    assert np.allclose(scan.T_map_sensor[:3, 3], [1.5, 0, 0]), "half way between the two transforms"
    with pytest.raises(RecordingError, match="valid: /points"):
        list(read_scans(path, topic="/other"))
    with pytest.raises(RecordingError, match="TF does not lead"):
        list(read_scans(path, map_frame="moon"))


def write_bag(path):
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(
        get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage")
    )
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"]

    def head(seconds, frame):
        return types["std_msgs/msg/Header"](seq=0, stamp=stamp(sec=seconds, nanosec=0), frame_id=frame)

    def transform(seconds, x):
        place = types["geometry_msgs/msg/Transform"](
            translation=types["geometry_msgs/msg/Vector3"](x=x, y=0.0, z=0.0),
            rotation=types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
        )
        stamped = types["geometry_msgs/msg/TransformStamped"](
            header=head(seconds, "map"), child_frame_id="camera", transform=place
        )
        return types["tf2_msgs/msg/TFMessage"](transforms=[stamped])

    field = types["sensor_msgs/msg/PointField"]
    cloud = types["sensor_msgs/msg/PointCloud2"](
        header=head(20, "camera"),
        height=1,
        width=3,
        fields=[field(name=n, offset=4 * i, datatype=7, count=1) for i, n in enumerate("xyz")],
        is_bigendian=False,
        point_step=12,
        row_step=36,
        data=np.frombuffer(POINTS.tobytes(), np.uint8),
        is_dense=False,
    )
    with Writer(path) as writer:
        tf = writer.add_connection("/tf", "tf2_msgs/msg/TFMessage", typestore=store)
        points = writer.add_connection("/points", "sensor_msgs/msg/PointCloud2", typestore=store)
        for seconds, x in ((10, 1.0), (30, 2.0)):
            msg = transform(seconds, x)
            writer.write(tf, seconds * 10**9, store.serialize_ros1(msg, msg.__msgtype__))
        writer.write(points, 20 * 10**9, store.serialize_ros1(cloud, cloud.__msgtype__))


def test_transforms_chain_to_the_root():
    tree = TransformTree()
    unturned = np.array([0, 0, 0, 1.0])
    tree.add("map", "base", 0.0, np.array([1.0, 0, 0]), unturned)
    tree.add("base", "camera", 0.0, np.array([0, 2.0, 0]), unturned)
    assert tree.root("camera") == "map"
    assert np.allclose(tree.lookup("map", "camera", 5.0)[:3, 3], [1, 2, 0])


def box_scene(path):
    """A wall 2 m away with a box before it, seen from the origin along z."""
    u, v = np.meshgrid(np.linspace(-0.5, 0.5, 160), np.linspace(-0.4, 0.4, 120))
    near = (np.abs(u) < 0.12) & (np.abs(v) < 0.12)
    z = np.where(near, 1.0, 2.0)
    points = np.stack([u * z, v * z, z], axis=-1).reshape(-1, 3).astype(np.float32)
    path.write_bytes(
        header("binary", len(points)).replace(b"0.5 0 0 0 0 0 1", b"0 0 0 1 0 0 0") + points.tobytes()
    )


def test_the_shadow_behind_a_box_is_void(tmp_path):
    box_scene(tmp_path / "box.pcd")
    out = tmp_path / "out"
    assert evaluate_cloud.main([str(tmp_path / "box.pcd"), "--out", str(out), "--views", "4"]) == 0
    report = json.loads((out / "box.json").read_text())
    biggest = report["ellipsoids"][0]
    assert 1.0 < biggest["center"][2] < 2.0
    assert np.all(np.abs(biggest["center"][:2]) < 0.1)
    assert len(report["views"]) == 4
    assert report["views"][0]["void_gain_m3"] > 0
    for name in ("box.png", "box.ot", "box_utility.ot", "box_utility_colors.ot"):
        assert (out / name).stat().st_size > 100


def test_the_example_of_the_readme_runs(tmp_path, monkeypatch, capsys):
    readme = (Path(__file__).parents[1] / "README.md").read_text()
    example = readme.split("```python\n")[1].split("```")[0]
    (tmp_path / "table.pcd").write_bytes(pcd("binary"))
    monkeypatch.chdir(tmp_path)
    exec(compile(example, "README.md", "exec"), {})
    assert "frontier voxels" in capsys.readouterr().out


def test_the_example_of_the_package_runs():
    assert doctest.testmod(fv_exploration).attempted > 3
    assert doctest.testmod(fv_exploration).failed == 0


def test_bad_files_end_with_one_line(tmp_path, capsys):
    assert evaluate_cloud.main([str(tmp_path / "none.pcd"), "--out", str(tmp_path)]) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "none.pcd" in error


def shared(name):
    folder = Path(os.environ.get("FV_SHARED_DATA", Path(__file__).parents[5] / "shared" / "data"))
    if not (folder / name).exists():
        pytest.skip(f"needs {name} (FV_SHARED_DATA)")
    return folder / name


def test_a_real_kinect_table_has_shadows(tmp_path):
    path = shared("kinect_tabletop/test1.pcd")
    assert evaluate_cloud.main([str(path), "--out", str(tmp_path), "--resolution", "0.03"]) == 0
    report = json.loads((tmp_path / "test1.json").read_text())
    assert report["voxels"]["void"] > 100
    assert report["voxels"]["occupied"] > 1000


def test_a_real_scan_graph_is_read():
    scans = list(read_scans(shared("spherical_scan.graph")))
    assert len(scans) == 1
    assert len(scans[0].points_sensor) == 10201


@pytest.mark.parametrize(
    "content",
    [header("ascii", points=0), header("ascii", points=1) + b"nan nan nan\n"],
    ids=["empty", "all NaN"],
)
def test_a_cloud_without_a_point_is_refused_and_leaves_nothing(content, tmp_path, capsys):
    (tmp_path / "void.pcd").write_bytes(content)
    assert evaluate_cloud.main([str(tmp_path / "void.pcd"), "--out", str(tmp_path / "out")]) == 1
    assert "no scan with a point in it" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
