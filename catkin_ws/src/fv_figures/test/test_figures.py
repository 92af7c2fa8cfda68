"""Parts of the figures that need neither RViz nor the simulator, and the checks that every figure must pass."""

import numpy as np
import pytest
from PIL import Image as Picture

from fv_figures import command, compose, gallery, sources
from fv_figures.catalogue import CAPTIONS, FIGURES
from fv_viz.config import VizConfig
from fv_viz.drawing import legend
from fv_viz.offscreen import camera


def plain(color, size=(200, 150)):
    return Picture.new("RGB", size, color)


def half(color):
    picture = plain((250, 250, 250))
    picture.paste(color, (0, 0, 100, 150))
    return picture


def test_a_blank_picture_is_a_fault():
    assert compose.faults(plain((250, 250, 250)), {}) == ["the picture is blank"]


@pytest.mark.parametrize(
    ("name", "color"),
    [("red", (213, 60, 40)), ("orange", (230, 159, 0)), ("purple", (120, 60, 160)), ("blue", (45, 88, 138))],
)
def test_missing_colours_are_faults_and_present_ones_are_not(name, color):
    assert compose.faults(half(color), {name: 0.4}) == []
    other = (60, 160, 60) if name != "green" else (200, 0, 0)
    assert f"0.00 % {name}" in compose.faults(half(other), {name: 0.4})[0]


def test_a_legend_does_not_stand_for_what_is_missing():
    red = legend.Entry("fill", np.array([[0.85, 0.2, 0.1]]), "red things")
    panels = [("grey", half((120, 120, 120))), ("grey too", half((90, 90, 90)))]
    figure = compose.Figure(panels, "shows", "nobody", [red] * 9, {"red": 1e-4})
    assert compose.faults(compose.grid(figure), figure.expects) == []
    assert "red" in compose.figure_faults(figure)[0]
    blank = compose.Figure([*panels, ("empty", plain((250, 250, 250)))], "shows", "nobody")
    assert compose.figure_faults(blank) == ["panel 'empty' is blank"]


def test_a_picture_of_one_hue_is_a_fault():
    picture = plain((200, 30, 20))
    picture.paste((250, 250, 250), (0, 0, 10, 10))
    assert "red" in compose.faults(picture, {})[0]


def test_a_figure_is_saved_with_what_it_shows_and_its_command(tmp_path):
    lines = [entry for group in legend.entries(VizConfig()).values() for entry in group]
    panels = [(f"panel {k}", half((10 * k, 0, 0))) for k in range(5)]
    path = compose.save(
        compose.Figure(panels, "five <panels>", "nobody", lines), "9.9", tmp_path, ["Data: me"]
    )
    assert path.name == "figure_9_9.png"
    assert path.with_suffix(".txt").read_text() == "Figure 9.9: five <panels>\nData: me\n"
    page = gallery.write(tmp_path).read_text()
    assert 'src="figure_9_9.png"' in page
    assert "five &lt;panels&gt;" in page
    with Picture.open(path) as picture:
        assert picture.width == 3 * compose.PANEL


def test_the_legend_panel_lists_the_layers_that_are_shown():
    every = set(legend.entries(VizConfig()))
    few = legend.image_message(VizConfig(), ["free", "utility"], every)
    many = legend.image_message(VizConfig(), every, every)
    assert legend.PANEL[1] == few.height < many.height
    assert len(few.data) == few.step * few.height
    green = legend.image_message(VizConfig(), ["utility"], every).data
    assert green != legend.image_message(VizConfig(utility_scale="viridis"), ["utility"], every).data


def test_the_legend_leaves_out_what_is_empty():
    def words(layers, filled):
        return [entry.words for entry in legend.lines(VizConfig(), layers, filled)]

    assert words(["free", "contacts", "removed"], {"free"}) == words(["free", "removed"], None)
    assert len(words(["volume"], {"volume", "clearance"})) == len(words(["volume"], {"volume"})) + 1
    assert words(["free"], {"free", "volume", "clearance"}) == words(["free"], None)


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
    assert list(FIGURES) == list(CAPTIONS) == wanted.split()
    assert all(caption.thesis and caption.differs for caption in CAPTIONS.values())
    assert command.parse(["--only", "3.1, 5.7"]).numbers == ["3.1", "5.7"]
    with pytest.raises(SystemExit):
        command.parse(["--only", "9.9"])
    assert "known: 2.2" in capsys.readouterr().err


def test_the_command_beside_a_figure_makes_the_same_data():
    words = ["--world", "shelf", "--resolution", "0.02"]
    assert command.origin_of(command.parse(["--only", "3.1", *words])) == " ".join(words)
    assert command.origin_of(command.parse(["--cloud", "a b.pcd"])) == "--cloud 'a b.pcd'"
    assert command.origin_of(command.parse([])) == ""


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


def test_a_figure_that_fails_does_not_keep_the_others_from_being_made(monkeypatch, tmp_path, capsys):
    def make(material, number, folder, origin):
        if number == "3.1":
            raise camera.RvizFailed("RViz died with code 9")
        if number == "3.2":
            raise sources.NoData("no cloud")
        return ""

    monkeypatch.setattr(command, "_make", make)
    options = command.parse(["--only", "3.1,3.2,3.3", "--out", str(tmp_path)])
    assert command.make_all(None, options) == ["3.1", "3.2"]
    lines = capsys.readouterr().out.splitlines()
    assert "3.1: not made: RViz died with code 9" in lines[0]
    assert "3.2: not made: no cloud" in lines[1]
    assert "3.3: ok" in lines[2]
