"""The report of complete, incomplete and broken run folders; in a headless browser where there is one."""

import io
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser

import numpy as np
import pytest
import viz_fake_run
from PIL import Image as Picture
from PIL import features

from fv_viz.report import charts, compare, media, page, run_data, scene, tables
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


@pytest.mark.parametrize("warnings", [None, [], "text", ["a <b> of 3 joints", "no picture"]])
def test_warnings_of_the_run_are_on_the_page(run, tmp_path, warnings):
    folder = shutil.copytree(run, tmp_path / "run")
    content = json.loads((folder / "run.json").read_text())
    content["warnings"] = warnings
    (folder / "run.json").write_text(json.dumps(content))
    assert report_main([str(folder)]) == 0
    text = (folder / "report.html").read_text()
    shown = isinstance(warnings, list) and bool(warnings)
    assert ("Warnings of this run" in text) == shown
    assert ("<li>a &lt;b&gt; of 3 joints</li><li>no picture</li>" in text) == shown


def test_a_picture_that_is_none_is_said(run, tmp_path):
    folder = shutil.copytree(run, tmp_path / "run")
    (folder / "screenshots" / "view_002.png").write_bytes(b"no picture")
    report_main([str(folder)])
    assert "view_002.png cannot be read" in (folder / "report.html").read_text()


def test_forty_views_stay_under_fifteen_megabytes(tmp_path):
    folder = viz_fake_run.write(tmp_path / "long", views=40)
    report_main([str(folder)])
    assert (folder / "report.html").stat().st_size < 15e6


def test_a_small_video_is_embedded_and_a_large_one_is_named(run, tmp_path, monkeypatch):
    folder = shutil.copytree(run, tmp_path / "run")
    Picture.new("RGB", (40, 30), (200, 30, 20)).save(folder / "scene.png")
    assert 'id="true-scene"' in page.report(run_data.load(folder))
    for name, tag in (("scene.gif", 'src="data:image/gif'), ("scene.mp4", '<video src="data:video/mp4')):
        (folder / name).write_bytes(b"GIF89a or so")
        assert tag in page.report(run_data.load(folder))
        (folder / name).unlink()
    monkeypatch.setattr(media, "MAX_VIDEO_BYTES", 10)
    (folder / "scene.mp4").write_bytes(bytes(11))
    text = page.report(run_data.load(folder))
    assert "<video" not in text
    assert "scene.mp4 in the run folder (0.0 MB) does not fit" in text
    assert text.count("data:image/jpeg") == 5 + 1
    (folder / "scene.mp4").write_bytes(b"")
    assert "does not fit" in page.report(run_data.load(folder))


@pytest.mark.skipif(not features.check("webp_anim"), reason="this Pillow writes no animated WebP")
def test_a_large_gif_becomes_a_small_film_of_as_many_seconds(tmp_path, monkeypatch):
    rng = np.random.default_rng(1)
    noise = [Picture.fromarray(rng.integers(0, 255, (60, 80, 3), dtype=np.uint8)) for _ in range(200)]
    path = tmp_path / "scene.gif"
    noise[0].save(path, save_all=True, append_images=noise[1:], duration=50, loop=0)
    monkeypatch.setattr(media, "MAX_VIDEO_BYTES", path.stat().st_size - 1)
    assert 'src="data:image/webp' in media.scene(run_data.RunData(tmp_path, scene=[path]))
    with Picture.open(io.BytesIO(media._shrunk(path))) as film:
        assert film.n_frames == 100
        seconds = []
        for number in range(film.n_frames):
            film.seek(number)
            film.load()
            seconds.append(film.info["duration"] / 1000.0)
    assert sum(seconds) == pytest.approx(200 * 0.05)
    path.write_bytes(bytes(media.MAX_VIDEO_BYTES + 1))
    assert "does not fit" in media.scene(run_data.RunData(tmp_path, scene=[path]))


def test_on_paper_there_are_a_dozen_pictures_and_the_last(tmp_path):
    data = run_data.RunData(tmp_path, pictures=[tmp_path / f"{k}.png" for k in range(45)])
    text = media.strip(data)
    assert text.count('<figure class="screen">') == 45 - 12 - 0
    assert text.endswith("</script>")


def test_what_has_too_many_faces_is_drawn_in_larger_voxels(monkeypatch):
    monkeypatch.setattr(scene, "MAX_FACES", 20)
    grid = (np.argwhere(np.ones((8, 8, 8))) + 0.5) * 0.1
    size, faces = scene._few_faces(grid, 0.1, np.full(512, 250, np.uint8), False)
    assert size == pytest.approx(0.2)
    assert len(faces) == 18
    assert (faces["length"].astype(int) * faces["width"]).sum() == 6 * 16
    assert set(faces["since"]) == {4}


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
    assert "Each line is the median" in target.read_text()
    assert compare_main([str(tmp_path / "nowhere"), "--out", str(tmp_path / "none.html")]) == 1
    assert not (tmp_path / "none.html").exists()


def test_a_comparison_does_not_replace_another_unless_told_to(run, tmp_path, capsys):
    target = tmp_path / "cmp.html"
    target.write_text("mine")
    assert compare_main([str(run), "--out", str(target)]) == 1
    assert "--force" in capsys.readouterr().err
    assert target.read_text() == "mine"
    assert compare_main([str(run), "--out", str(target), "--force"]) == 0
    assert "1 exploration compared" in target.read_text()
    assert "synthetic, arm: 1 run. Each line is one run." in target.read_text()


def test_maps_of_other_voxels_are_another_case(tmp_path):
    def run(world, size):
        return run_data.RunData(tmp_path, run={"world": world, "robot": "arm", "resolution_m": size})

    runs = [run("a", 0.05), run("b", 0.05), run("a", 0.1), run("a", 0.05)]
    assert compare.case_names(runs) == ["a, arm, 5 cm", "b, arm", "a, arm, 10 cm", "a, arm, 5 cm"]
    assert [len(members) for members in compare.grouped(runs).values()] == [2, 1, 1]


def test_runs_of_one_name_are_told_apart_by_their_folders(run, tmp_path):
    runs = [run_data.load(shutil.copytree(run, tmp_path / parent / "one")) for parent in ("a", "b")]
    assert compare._names(runs) == ["a/one", "b/one"]
    assert compare._names([runs[0], runs[0]]) == ["one", "one"]


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
    words = "After 3 views the exploration ended: it was cancelled; something was touched in 2 physics steps."
    assert page.outcome(data) == words
    data.run["reason"] = "it was cancelled"  # as run.json says it: told once
    assert page.outcome(data) == words


def test_an_explored_share_of_an_unsettled_set_is_called_an_upper_bound(run, tmp_path):
    folder = shutil.copytree(run, tmp_path / "run")
    assert "at most" not in page.report(run_data.load(folder))
    content = json.loads((folder / "run.json").read_text())
    content.update(truth={"observable_settled": False, "observable_samples": 6000}, explored_share=0.857)
    (folder / "run.json").write_text(json.dumps(content))
    text = page.report(run_data.load(folder))
    assert "at most 85.7\u00a0% of what the camera can observe" in text
    assert "≤ 85.7 %" in text
    assert "still growing after 6,000 sampled views" in text
    assert "Explored shares of run are upper bounds" in compare.comparison([run_data.load(folder)])


def test_the_table_of_views_groups_its_columns_and_keeps_unknown_ones(tmp_path):
    columns = {
        "view": [0.0, 1.0],
        "known_share": [0.0647, np.nan],
        "free": [20149.0, 48124.0],
        "mood": [3.0, 4.5],
    }
    data = run_data.RunData(tmp_path, columns={name: np.array(values) for name, values in columns.items()})
    text = tables.every_view(data)
    assert re.findall(r'colspan="(\d)">([^<]*)<', text) == [
        ("1", ""),
        ("1", "share [%]"),
        ("1", "thousand voxels"),
        ("1", "other"),
    ]
    assert re.findall(r'<td class="number">([^<]*)<', text) == [
        "0",
        "6.5",
        "20.1",
        "3",
        "1",
        "–",
        "48.1",
        "4.5",
    ]


def test_the_worth_of_a_view_is_told_with_its_weight(tmp_path):
    data = run_data.RunData(tmp_path, run={"config": {"views": {"known_weight": 0.25}}})
    assert "other unseen space by 0.25" in page.worth_note(data)
    data.run = {"config": [1]}
    assert "by the configured known_weight" in page.worth_note(data)


def test_pictures_are_named_after_the_view_that_they_follow(tmp_path):
    names = ("view_001", "view_012", "finished", "my_own")
    text = media.strip(run_data.RunData(tmp_path, pictures=[tmp_path / f"{name}.png" for name in names]))
    found = re.findall(r"<figcaption>([^<]*)<", text)
    assert found == ["after the first scan", "after view 11", "finished", "my own"]


@pytest.mark.parametrize("limits", [(0, 1), (0, 0.037), (-5, 8123), (1, 2)])
def test_ticks_are_few_and_within(limits):
    marks = charts.ticks(*limits)
    assert 2 <= len(marks) <= 11
    assert limits[0] - 1e-9 <= min(marks) <= max(marks) <= limits[1] + 1e-9


def test_charts_of_nothing_are_empty():
    assert charts.lines([charts.Series("a", np.array([np.nan]), np.array([1.0]))], "x", "y") == ""
    assert charts.stacked_bars(np.array([1.0]), {"a": np.array([np.nan])}, "x", "y") == ""


def browse(tmp_path, page_file, *words):
    """Run a headless Chromium on a page; its output."""
    graphics = [
        "--use-gl=angle",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
        "--hide-scrollbars",
    ]
    command = [CHROMIUM, "--headless=new", "--no-sandbox", *graphics, "--enable-logging=stderr"]
    command += ["--window-size=1200,1400", f"--user-data-dir={tmp_path / 'profile'}"]
    done = subprocess.run([*command, *words, page_file.as_uri()], capture_output=True, text=True, timeout=300)
    # Of a slow software renderer Chromium says so on the console, and its own pages miss the network: neither is a
    # complaint about our page.
    others = ("GL Driver Message", "source: chrome://")
    said = [
        line
        for line in done.stderr.splitlines()
        if "CONSOLE" in line and not any(word in line for word in others)
    ]
    assert said == [], done.stderr
    return done.stdout


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium to open the report in")
def test_a_browser_draws_the_map_without_complaint(run, tmp_path):
    report_main([str(run)])
    picture = tmp_path / "page.png"
    browse(tmp_path, run / "report.html", "--virtual-time-budget=3000", f"--screenshot={picture}")
    text = browse(tmp_path, run / "report.html", "--virtual-time-budget=3000", "--dump-dom")
    assert 'data-drawn="yes"' in text
    pixels = np.asarray(Picture.open(picture).convert("RGB"))[640:1300]
    blue = (pixels[..., 2].astype(int) - pixels[..., 0]) > 25  # the height scale below its middle
    magenta = (pixels[..., 0] > 180) & (pixels[..., 1] < 40) & (pixels[..., 2] > 90)  # the executed views
    assert blue.mean() > 0.01
    assert magenta.sum() > 50


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium to print the report with")
def test_the_report_prints_on_a_few_pages_with_its_configuration(run, tmp_path):
    report_main([str(run)])
    paper = tmp_path / "report.pdf"
    browse(tmp_path, run / "report.html", "--no-pdf-header-footer", f"--print-to-pdf={paper}")
    pages = len(re.findall(rb"/Type\s*/Page\b", paper.read_bytes()))
    assert 2 <= pages <= 8
