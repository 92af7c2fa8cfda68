"""Readers of recorded clouds: what they share, scan graphs, and the examples."""

import doctest
import os
import struct
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from recorded import pcd

import fv_exploration
from fv_exploration.recordings import RecordingError, RecordingWarning, read_scans

POINTS = np.array([[1.0, 0.5, 0.25], [np.nan] * 3, [2.0, -0.5, 0.75]], np.float32)


def test_files_that_are_none_are_refused_by_name(tmp_path):
    with pytest.raises(RecordingError, match=r"none\.pcd: there is no such file"):
        list(read_scans(tmp_path / "none.pcd"))
    other = tmp_path / "cloud.xyz"
    other.write_text("1 2 3")
    with pytest.raises(RecordingError, match=r"valid: \.pcd"):
        list(read_scans(other))
    (tmp_path / "folder.pcd").mkdir()
    with pytest.raises(RecordingError, match=r"folder\.pcd"):
        list(read_scans(tmp_path / "folder.pcd"))


def test_warnings_reach_who_does_not_ask_for_them(tmp_path):
    path = tmp_path / "turned.pcd"
    path.write_bytes(pcd(POINTS, VIEWPOINT="0 0 0 2 0 0 0"))
    with pytest.warns(RecordingWarning, match=r"turned\.pcd.*length 1"):
        list(read_scans(path))
    path.write_bytes(pcd(POINTS))
    with pytest.warns(RecordingWarning, match=r"turned\.pcd.*not used"):
        list(read_scans(path, map_frame="map"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        list(read_scans(path))


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


@settings(max_examples=200, deadline=2000, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_damaged_scan_graphs_are_read_or_refused_by_name(tmp_path, data):
    content = bytearray(graph_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path / "scans.graph"
    path.write_bytes(content[: data.draw(st.integers(0, len(content)))])
    try:
        for scan in read_scans(path, warn=[].append):
            assert scan.points_sensor.shape[1] == 3
            assert np.isfinite(scan.T_map_sensor).all()
    except RecordingError as error:
        assert "scans.graph" in str(error)
        assert "\n" not in str(error)


def test_the_example_of_the_readme_runs(tmp_path, monkeypatch, capsys):
    readme = (Path(__file__).parents[1] / "README.md").read_text()
    example = readme.split("```python\n")[1].split("```")[0]
    (tmp_path / "table.pcd").write_bytes(pcd(POINTS))
    monkeypatch.chdir(tmp_path)
    exec(compile(example, "README.md", "exec"), {})
    assert "frontier voxels" in capsys.readouterr().out


def test_the_example_of_the_package_runs():
    assert doctest.testmod(fv_exploration).attempted > 3
    assert doctest.testmod(fv_exploration).failed == 0


def shared(name):
    folder = Path(os.environ.get("FV_SHARED_DATA", Path(__file__).parents[5] / "shared" / "data"))
    if not (folder / name).exists():
        pytest.skip(f"needs {name} (FV_SHARED_DATA)")
    return folder / name


def test_a_real_scan_graph_is_read():
    scans = list(read_scans(shared("spherical_scan.graph")))
    assert len(scans) == 1
    assert len(scans[0].points_sensor) == 10201
