"""The command that evaluates recorded clouds: results, what it says of bad input, and the names of its files."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from recorded import cloud, pcd, wall, write_bag

from fv_exploration.recordings import evaluate_cloud
from fv_exploration.recordings.evaluation_files import ENDINGS, result_names, whole_files

FAST = ["--resolution", "0.1", "--views", "1", "--utility-range", "1"]


@pytest.fixture
def run(capsys, tmp_path):
    """Evaluates; gives the exit code, the lines of standard error, and the reports by name."""

    def evaluate(*arguments, out="out"):
        code = evaluate_cloud.main([*map(str, arguments), "--out", str(tmp_path / out), *FAST])
        errors = capsys.readouterr().err.splitlines()
        assert all(line.startswith("evaluate_cloud: ") for line in errors)
        reports = {p.stem: json.loads(p.read_text()) for p in sorted((tmp_path / out).glob("*.json"))}
        return code, errors, reports

    return evaluate


def write(path, content):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    return path


def test_the_shadow_behind_a_box_is_void(tmp_path):
    write(tmp_path / "box.pcd", pcd(wall(120)))
    out = tmp_path / "out"
    assert evaluate_cloud.main([str(tmp_path / "box.pcd"), "--out", str(out), "--views", "4"]) == 0
    report = json.loads((out / "box.json").read_text())
    biggest = report["ellipsoids"][0]
    assert 1.0 < biggest["center"][2] < 2.0
    assert np.all(np.abs(biggest["center"][:2]) < 0.1)
    assert len(report["views"]) == 4
    assert report["views"][0]["void_gain_m3"] > 0
    assert report["warnings"] == []
    assert sorted(p.name for p in out.iterdir()) == sorted("box" + ending for ending in ENDINGS)
    assert all(p.stat().st_size > 100 for p in out.iterdir())


def test_bad_files_end_with_one_line_and_the_others_are_evaluated(run, tmp_path):
    good = write(tmp_path / "good.pcd", pcd(wall()))
    code, errors, reports = run(tmp_path / "none.pcd", good, write(tmp_path / "bad.pcd", b"#"))
    assert code == 1
    assert len(errors) == 2
    assert "none.pcd" in errors[0]
    assert "bad.pcd" in errors[1]
    assert list(reports) == ["good"]


@pytest.mark.parametrize(
    ("points", "reason"),
    [
        (np.zeros((0, 3)), "no usable return in a scan of 0 points"),
        (np.full((4, 3), np.nan), "4 without return"),
        (np.zeros((4, 3)), "4 nearer than 1e-06 m"),
        (np.full((4, 3), 1e30), "4 nearer than 1e-06 m or farther than 100000 m"),
        (wall() * 1000, "farther than 5 m; ranges are 1000 to"),
        (wall() * 1000, "they look like millimetres"),
        (wall() * 20, "ranges are 20 to"),
    ],
)
def test_clouds_without_a_usable_return_are_refused_and_leave_nothing(run, tmp_path, points, reason):
    path = write(tmp_path / "cloud.pcd", pcd(np.asarray(points, np.float32)))
    code, errors, reports = run(path)
    assert code == 1
    assert len(errors) == 1
    assert str(path) in errors[0]
    assert "no usable return" in errors[0]
    assert reason in errors[0]
    assert ("millimetres" in errors[0]) == (len(points) > 4 and points.max() > 1000)
    assert reports == {}
    assert not (tmp_path / "out").exists()


def test_absurd_points_are_dropped_counted_and_told(run, tmp_path):
    plain = wall()
    absurd = np.array([[1e-29, -1e-29, 0], [1e30, 0, 0], [0, 0, 0], [3e5, 0, 0]], np.float32)
    _, _, right = run(write(tmp_path / "cloud.pcd", pcd(plain)))
    code, errors, reports = run(
        write(tmp_path / "mixed.pcd", pcd(np.concatenate([absurd, plain]))), out="other"
    )
    assert code == 0
    assert len(errors) == 1
    assert "warning" in errors[0]
    assert f"4 of {len(plain) + 4} points (0.249 %)" in errors[0]
    assert reports["mixed"]["points"]["absurd"] == 4
    assert reports["mixed"]["warnings"] == [errors[0].removeprefix("evaluate_cloud: warning: ")]
    assert reports["mixed"]["voxels"] == right["cloud"]["voxels"]


def test_what_the_outlier_filter_takes_is_told(run, tmp_path):
    stray = np.concatenate([wall(), [[0, 3, 4]], [[np.nan] * 3]]).astype(np.float32)
    code, errors, reports = run(write(tmp_path / "cloud.pcd", pcd(stray)), "--outliers", "8")
    assert code == 0
    counts = reports["cloud"]["points"]
    assert counts["filtered"] >= 1
    assert counts["no_return"] == 1
    assert counts["points"] == len(stray)
    assert f"{counts['filtered']} of {len(stray)} points" in errors[0]
    assert "outliers" in errors[0]


def test_most_returns_beyond_the_range_are_told(run, tmp_path):
    far = np.concatenate([wall(), wall() * 1000, wall() * 1000]).astype(np.float32)
    _, errors, _ = run(write(tmp_path / "cloud.pcd", pcd(far)))
    assert "3200 of 4800 points (66.7 %) are farther than 5 m" in errors[0]
    assert "millimetres" in errors[0]


def test_sensors_in_map_coordinates_are_refused_with_their_shift_and_read_with_it(run, tmp_path):
    path = write(tmp_path / "survey.pcd", pcd(wall(), VIEWPOINT="382000 5621000 112 1 0 0 0"))
    code, errors, reports = run(path)
    assert code == 1
    assert len(errors) == 1
    assert "(382000, 5621000, 112)" in errors[0]
    assert "3276.8 m" in errors[0]
    assert "(-382000, -5621000, -112) m (--shift X Y Z)" in errors[0]
    assert reports == {}
    code, errors, reports = run(path, "--shift", "-382000", "-5621000", "-112")
    _, _, right = run(write(tmp_path / "here.pcd", pcd(wall())))
    assert (code, errors) == (0, [])
    assert reports["survey"]["voxels"] == right["here"]["voxels"]
    assert reports["survey"]["shift_m"] == [-382000, -5621000, -112]


def test_shifts_that_are_none_are_refused(run, tmp_path):
    code, errors, _ = run(write(tmp_path / "x.pcd", pcd(wall())), "--shift", "nan", "0", "0")
    assert code == 1
    assert "--shift is [nan, 0.0, 0.0]; valid" in errors[0]


def test_what_readers_leave_out_is_in_the_report(run, tmp_path):
    clouds = [("/points", stamp, "cam", cloud(wall())) for stamp in (1.0, 2.0, 3.0)]
    write_bag(tmp_path / "scans.bag", clouds, [("/tf", stamp, "map", "cam", 0.0) for stamp in (1.0, 2.0)])
    code, errors, reports = run(tmp_path / "scans.bag")
    assert code == 0
    assert reports["scans"]["scans"] == 2
    assert len(errors) == len(reports["scans"]["warnings"]) == 1
    assert "1 of 3 clouds were left out" in errors[0]


def test_inputs_of_one_name_keep_both_results(run, tmp_path):
    near, far = write(tmp_path / "a/x.pcd", pcd(wall())), write(tmp_path / "b/x.pcd", pcd(wall(distance_m=3)))
    code, _, reports = run(near, far, near)
    assert code == 0
    assert {name: Path(report["path"]) for name, report in reports.items()} == {"a_x": near, "b_x": far}
    assert reports["a_x"]["voxels"] != reports["b_x"]["voxels"]


def test_results_of_other_inputs_stay_and_those_of_the_same_are_replaced(run, tmp_path):
    near, far = write(tmp_path / "a/x.pcd", pcd(wall())), write(tmp_path / "b/x.pcd", pcd(wall(distance_m=3)))
    run(near)
    _, _, reports = run(far)
    assert {name: Path(report["path"]) for name, report in reports.items()} == {"x": near, "x_pcd": far}
    write(far, pcd(wall(distance_m=2.5)))
    _, _, again = run(far)
    assert again["x"] == reports["x"]
    assert list(again) == ["x", "x_pcd"]
    assert again["x_pcd"] != reports["x_pcd"]
    (tmp_path / "out" / "y.png").write_bytes(b"a picture of somebody else's")
    _, _, reports = run(write(tmp_path / "y.pcd", pcd(wall())))
    assert list(reports) == ["x", "x_pcd", "y_pcd"]
    assert (tmp_path / "out" / "y.png").read_bytes() == b"a picture of somebody else's"


@pytest.mark.parametrize(
    ("inputs", "names"),
    [
        (["/d/x.pcd"], ["x"]),
        (["/d/x.pcd", "/d/x.bag"], ["x_pcd", "x_bag"]),
        (["/d/x.pcd", "/d/X.pcd"], ["d_x_pcd", "d_X_pcd-2"]),
        (["/a/x.pcd", "/b/x.pcd", "/b/y.pcd"], ["a_x", "b_x", "y"]),
        (["/a/r/x.pcd", "/b/r/x.pcd"], ["a_r_x", "b_r_x"]),
        (["/d/x.pcd", "/d/x_utility.pcd"], ["x_pcd", "x_utility_pcd"]),
        (["/a_b/x.pcd", "/a/b/x.pcd"], ["a_b_x", "b_x"]),
        (["/d/x.pcd", "/d/x_pcd.pcd", "/e/x.pcd"], ["d_x", "x_pcd_pcd", "e_x"]),
    ],
)
def test_no_two_results_share_a_file_whatever_the_case(tmp_path, inputs, names):
    found = result_names([Path(path) for path in inputs], tmp_path)
    files = [(name + ending).lower() for name in found for ending in ENDINGS]
    assert len(set(files)) == len(files)
    assert found == names


def test_files_are_there_whole_or_not_at_all(tmp_path):
    with pytest.raises(RuntimeError), whole_files(tmp_path, "x") as beginning:
        Path(beginning + ENDINGS[0]).write_text("half")
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []
    with whole_files(tmp_path, "x") as beginning:
        for ending in ENDINGS:
            Path(beginning + ending).write_text("whole")
        assert list(tmp_path.glob("x*")) == []
    assert sorted(os.listdir(tmp_path)) == sorted("x" + ending for ending in ENDINGS)


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
