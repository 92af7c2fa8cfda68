"""The bytes written from arrays are those that genpy writes from objects."""

import io

import numpy as np
import pytest
from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from fv_viz.drawing import packing, shapes


def sample():
    out = shapes.marker(Header(frame_id="wörld"), "name/space", Marker.TRIANGLE_LIST, (0.1, 0.2, 0.3), 0.5, 7)
    out.pose.position.x, out.lifetime.secs, out.frame_locked = 1.5, 3, True
    out.text, out.mesh_resource, out.mesh_use_embedded_materials = "m³", "file:///a.dae", True
    return out


@pytest.mark.parametrize("count", [0, 3, 300])
def test_packed_markers_are_read_back_as_sent(count):
    rng = np.random.default_rng(count)
    points, colors = rng.normal(size=(count, 3)), rng.random((count, 4)).astype(np.float32)
    stream = io.BytesIO()
    packing.PackedMarkers([packing.pack_marker(sample(), points, colors), shapes.clear(Header())]).serialize(
        stream
    )
    expected = sample()
    expected.points = [Point(*p) for p in points]
    expected.colors = [ColorRGBA(*c) for c in colors]
    first = io.BytesIO()
    expected.serialize(first)
    read = MarkerArray().deserialize(stream.getvalue())
    again = io.BytesIO()
    read.markers[0].serialize(again)
    assert again.getvalue() == first.getvalue()
    assert read.markers[1].action == Marker.DELETEALL


def test_packed_markers_travel_under_the_type_of_marker_arrays():
    assert packing.PackedMarkers([])._md5sum == MarkerArray._md5sum
    assert isinstance(packing.PackedMarkers([]), MarkerArray)


def test_cloud_keeps_points_and_colours():
    points = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    msg = packing.cloud(Header(), points, np.array([1.0, 0.5, 0.0]))
    data = np.frombuffer(msg.data, [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<u4")])
    assert (data["x"] == [1.0, 4.0]).all()
    assert (data["rgb"] == 0xFF7F00).all()
    assert (msg.width, msg.point_step, len(msg.data)) == (2, 16, 32)


def test_an_empty_cloud_is_valid():
    assert packing.cloud(Header(), np.empty((0, 3)), np.zeros(3)).width == 0
