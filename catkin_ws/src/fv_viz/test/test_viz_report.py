"""The report of complete, incomplete and broken run folders; in a headless browser where there is one."""

import json
import re
import shutil
import subprocess
from html.parser import HTMLParser

import numpy as np
import pytest
import viz_fake_run
from PIL import Image as Picture

from fv_viz.report import charts, compare, page, run_data
from fv_viz.report.commands import compare_main, report_main
from fv_viz.report.scene import FACE, encoded_faces

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FILES = ("run.json", "metrics.csv", "map_points.npz", "known_since.npz", "views.json")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return viz_fake_run.write(tmp_path_factory.mktemp("runs") / "one")


class Tags(HTMLParser):
    """Collects tags and every address."""

    def __init__(self):
        super().__init__()
        self.tags, self.addresses = [], []

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.addresses += [value for name, value in attributes if name in ("src", "href")]


def parsed(text):
    tags = Tags()
    tags.feed(text)
    return tags


def test_a_complete_run_gives_everything_and_needs_no_network(run):
    assert report_main([str(run)]) == 0
    text = (run / "report.html").read_text()
    tags = parsed(text)
    assert tags.tags.count("svg") > 5
    assert tags.tags.count("img") == 5 + 1
    assert "canvas" in tags.tags
    assert all(address.startswith("data:") for address in tags.addresses)
    assert "ended by itself" in text
    assert "52." in text or "explored" in text
    assert "Not everything of this run" not in text


@pytest.mark.parametrize("name", FILES)
def test_each_missing_file_is_said_and_the_rest_is_there(run, tmp_path, name, capsys):
    folder = shutil.copytree(run, tmp_path / "run")
    (folder / name).unlink()
    assert report_main([str(folder)]) == 0
    assert f"{name} is not there" in (folder / "report.html").read_text()
    assert name in capsys.readouterr().out


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize(
    "content", [b"", b"\x00\xff nonsense", b"[]", b"{}", b"3", b"null", b'[{"pose": [1]}]']
)
def test_a_broken_file_is_named_and_does_no_harm(run, tmp_path, name, content):
    folder = shutil.copytree(run, tmp_path / "run")
    (folder / name).write_bytes(content)
    assert report_main([str(folder)]) == 0
    assert "<h1>" in (folder / "report.html").read_text()


def test_a_folder_that_is_no_run_is_refused_in_one_line(tmp_path, capsys):
    assert report_main([str(tmp_path)]) == 1
    assert report_main([str(tmp_path / "nowhere")]) == 1
    assert len(capsys.readouterr().err.strip().splitlines()) == 2


def test_text_from_the_run_cannot_break_the_page(run, tmp_path):
    folder = shutil.copytree(run, tmp_path / "run")
    content = json.loads((folder / "run.json").read_text())
    content.update(world="<script>alert(1)</script>", reason="</script><b>", config={"a": "</script>"})
    (folder / "run.json").write_text(json.dumps(content))
    report_main([str(folder)])
    text = (folder / "report.html").read_text()
    assert "<script>alert" not in text
    assert "</script><b>" not in text


def test_a_picture_that_is_none_is_said(run, tmp_path):
    folder = shutil.copytree(run, tmp_path / "run")
    (folder / "screenshots" / "view_002.png").write_bytes(b"no picture")
    report_main([str(folder)])
    assert "view_002.png cannot be read" in (folder / "report.html").read_text()


def test_forty_views_stay_under_fifteen_megabytes(tmp_path):
    folder = viz_fake_run.write(tmp_path / "long", views=40)
    report_main([str(folder)])
    assert (folder / "report.html").stat().st_size < 15e6


def test_encoded_faces_cover_the_surface_of_a_cube():
    grid = (np.argwhere(np.ones((4, 4, 4))) + 0.5) * 0.1
    faces = encoded_faces(grid, 0.1, np.full(64, 254, np.uint8))
    assert FACE.itemsize == 10
    assert (faces["length"].astype(int) * faces["width"]).sum() == 6 * 16
    assert set(faces["since"]) == {0}


def test_a_voxel_seen_later_does_not_hide_what_was_seen_before():
    pair = np.array([[0.05, 0.05, 0.05], [0.15, 0.05, 0.05]])
    faces = encoded_faces(pair, 0.1, np.array([253, 250], np.uint8))
    assert sorted(faces["since"].tolist()) == [1] * 6 + [4] * 5


def test_runs_are_compared_by_case(run, tmp_path, capsys):
    other = viz_fake_run.write(tmp_path / "two", seed=2, views=3)
    target = tmp_path / "cmp.html"
    assert compare_main([str(run), str(other), str(tmp_path / "nowhere"), "--out", str(target)]) == 0
    assert "nowhere" in capsys.readouterr().err
    assert "synthetic, arm: 2 runs" in target.read_text()
    assert compare_main([str(tmp_path / "nowhere")]) == 1


def test_the_spread_keeps_the_last_share_of_a_shorter_run(run, tmp_path):
    other = run_data.load(viz_fake_run.write(tmp_path / "two", seed=2, views=3))
    _, shares = compare.spread([run_data.load(run), other], "known_share")
    assert shares.shape == (2, 5)
    assert shares[1, 4] == shares[1, 2]
    assert np.isnan(compare.spread([run_data.load(run), other], "move_s")[1][1, 4])


def test_the_outcome_is_one_sentence_of_what_is_known():
    data = run_data.RunData(folder=None)
    assert page.outcome(data) == "The exploration left no result."
    data.run = {"result": "CANCELLED", "views": 3, "contacts": 2}
    assert page.outcome(data) == (
        "After 3 views the exploration was cancelled; something was touched in 2 physics steps."
    )


@pytest.mark.parametrize("limits", [(0, 1), (0, 0.037), (-5, 8123), (1, 2)])
def test_ticks_are_few_and_within(limits):
    marks = charts.ticks(*limits)
    assert 2 <= len(marks) <= 11
    assert limits[0] - 1e-9 <= min(marks) <= max(marks) <= limits[1] + 1e-9


def test_charts_of_nothing_are_empty():
    assert charts.lines([charts.Series("a", np.array([np.nan]), np.array([1.0]))], "x", "y") == ""
    assert charts.stacked_bars(np.array([1.0]), {"a": np.array([np.nan])}, "x", "y") == ""


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium to open the report in")
def test_a_browser_draws_the_map_without_complaint(run, tmp_path):
    report_main([str(run)])
    picture, command = (
        tmp_path / "page.png",
        [CHROMIUM, "--headless=new", "--no-sandbox", "--hide-scrollbars"],
    )
    command += [
        "--use-gl=angle",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
        "--window-size=1200,1400",
    ]
    command += [
        "--enable-logging=stderr",
        "--virtual-time-budget=3000",
        f"--user-data-dir={tmp_path / 'profile'}",
    ]
    address = (run / "report.html").as_uri()
    shot = subprocess.run(
        [*command, f"--screenshot={picture}", address], capture_output=True, text=True, timeout=60
    )
    assert not re.search(r"CONSOLE.*", shot.stderr), shot.stderr
    page_text = subprocess.run(
        [*command, "--dump-dom", address], capture_output=True, text=True, timeout=60
    ).stdout
    assert 'data-drawn="yes"' in page_text
    pixels = np.asarray(Picture.open(picture).convert("RGB"))[640:1300]
    blue = (pixels[..., 2].astype(int) - pixels[..., 0]) > 25  # the height scale below its middle
    magenta = (pixels[..., 0] > 180) & (pixels[..., 1] < 40) & (pixels[..., 2] > 90)  # the executed views
    assert blue.mean() > 0.01
    assert magenta.sum() > 50
