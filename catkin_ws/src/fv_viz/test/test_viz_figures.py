"""Parts of the figures that need neither RViz nor the simulator, and the checks that every figure must pass."""

import numpy as np
import pytest
from PIL import Image as Picture
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray

from fv_viz import capability, legend
from fv_viz.config import VizConfig
from fv_viz.figures import command, compose, sources
from fv_viz.figures.catalogue import FIGURES


def plain(color, size=(200, 150)):
    return Picture.new("RGB", size, color)


def half(color):
    picture = plain((250, 250, 250))
    picture.paste(color, (0, 0, 100, 150))
    return picture


def test_a_blank_picture_is_a_fault():
    assert compose.faults(plain((250, 250, 250)), ()) == ["the picture is blank"]


@pytest.mark.parametrize(
    ("name", "color"),
    [("red", (213, 60, 40)), ("orange", (230, 159, 0)), ("purple", (120, 60, 160)), ("blue", (45, 88, 138))],
)
def test_missing_colours_are_faults_and_present_ones_are_not(name, color):
    assert compose.faults(half(color), (name,)) == []
    other = (60, 160, 60) if name != "green" else (200, 0, 0)
    assert f"hardly any {name}" in compose.faults(half(other), (name,))[0]


def test_a_figure_is_saved_with_what_it_shows_and_its_command(tmp_path):
    lines = [entry for group in legend.entries(VizConfig()).values() for entry in group]
    panels = [(f"panel {k}", half((10 * k, 0, 0))) for k in range(5)]
    path = compose.save(compose.Figure(panels, "five panels", "nobody", lines), "9.9", tmp_path)
    assert path.name == "figure_9_9.png"
    assert path.with_suffix(".txt").read_text() == "Figure 9.9: five panels\nData: nobody\n"
    with Picture.open(path) as picture:
        assert picture.width == 3 * compose.PANEL


def test_the_legend_panel_lists_the_layers_that_are_shown():
    few = legend.image_message(VizConfig(), ["free", "utility"])
    many = legend.image_message(VizConfig(), legend.entries(VizConfig()))
    assert few.height < many.height
    assert len(few.data) == few.step * few.height
    green = legend.image_message(VizConfig(), ["utility"]).data
    assert green != legend.image_message(VizConfig(utility_scale="viridis"), ["utility"]).data


def test_the_slice_shows_each_class_in_its_colour():
    picture = compose.slice_picture(np.array([[0, 1], [2, 3]]), cell_px=10)
    at = {
        name: picture.getpixel(place)
        for name, place in (("free", (5, 5)), ("wall", (15, 15)), ("edge", (15, 5)))
    }
    assert at["wall"] == (20, 20, 20)
    assert at["free"] == (200, 200, 205)
    assert at["edge"][0] > 200


def test_every_figure_of_the_list_is_there_and_unknown_ones_are_named(capsys):
    wanted = "2.2 3.1 3.2 3.3 3.4 3.5 3.6 4.1 5.1 5.2 5.3 5.4 5.5 5.6 5.7 5.8"
    assert list(FIGURES) == wanted.split()
    assert command.parse(["--only", "3.1, 5.7"]).numbers == ["3.1", "5.7"]
    with pytest.raises(SystemExit):
        command.parse(["--only", "9.9"])
    assert "known: 2.2" in capsys.readouterr().err


HEADER = "# .PCD v0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\nPOINTS 1\n"


@pytest.mark.parametrize(
    "content", ["", "nonsense", HEADER + "DATA binary\n", HEADER + "DATA ascii\nnan nan nan\n"]
)
def test_a_broken_or_empty_cloud_is_no_data_in_one_line(tmp_path, content):
    pytest.importorskip("fv_exploration")
    path = tmp_path / "cloud.pcd"
    path.write_text(content)
    with pytest.raises(sources.NoData, match=r"cloud\.pcd"):
        sources.recorded(path, 0.05)
    with pytest.raises(sources.NoData, match="nowhere"):
        sources.recorded(tmp_path / "nowhere.pcd", 0.05)


def markers(blobs):
    import io

    from fv_viz import packing

    stream = io.BytesIO()
    packing.PackedMarkers(blobs).serialize(stream)
    return MarkerArray().deserialize(stream.getvalue()).markers


def test_spikes_point_from_the_centre_to_the_valid_points():
    valid = np.array([[True, False, True], [False, False, True]])
    centers = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    drawn = markers(capability.spikes(Header(), centers, valid, np.eye(3), 0.1))[0]
    ends = [(p.x, p.y, p.z) for p in drawn.points[1::2]]
    np.testing.assert_allclose(ends, [(0.09, 0, 0), (0, 0, 0.09), (1, 0, 0.09)], atol=1e-12)


@pytest.mark.parametrize(("kind", "sheets"), [("cone", 1), ("double cone", 2), ("ring", 2)])
def test_the_sheets_of_a_structure_have_its_opening_angle(kind, sheets):
    axis, opening = np.array([0.6, 0.0, 0.8]), 0.5
    drawn = markers([capability.structure(Header(), np.ones(3), axis, opening, kind, 0.1, (1, 0, 0))])[0]
    points = np.array([(p.x, p.y, p.z) for p in drawn.points]) - 1.0
    rim = points[np.linalg.norm(points, axis=1) > 1e-9]
    angles = np.arccos(np.clip(rim @ axis / np.linalg.norm(rim, axis=1), -1, 1))
    assert len(points) == sheets * 36 * 3
    np.testing.assert_allclose(np.minimum(angles, np.pi - angles), opening, atol=1e-6)


def test_two_rows_of_spheres_run_along_x():
    grid = np.argwhere(np.ones((5, 5, 5))) * 0.1
    mask = capability.near_rows(grid, np.array([0.2, 0.2, 0.2]), 0.05)
    assert mask.sum() == 10
    assert len(np.unique(grid[mask][:, 1:], axis=0)) == 2
