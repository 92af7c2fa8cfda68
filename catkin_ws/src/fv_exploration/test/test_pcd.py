"""PCD files as others write them: read right, or refused in one line."""

import re
import struct

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from recorded import literal_lzf, pcd

from fv_exploration.recordings import RecordingError, read_scans
from fv_exploration.recordings.pcd import decompress_lzf

POINTS = np.array([[1.0, 0.5, 0.25], [np.nan] * 3, [2.0, -0.5, 0.75]], np.float32)
KINDS = ["ascii", "binary", "binary_compressed"]


def read(path, content, warnings=None):
    path.write_bytes(content)
    (scan,) = read_scans(path, warn=[].append if warnings is None else warnings.append)
    return scan


def refuse(path, content, text):
    with pytest.raises(RecordingError, match=text) as error:
        read(path, content)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_pcd_gives_the_same_points_and_viewpoint(tmp_path, kind):
    scan = read(tmp_path / "cloud.pcd", pcd(POINTS, kind, VIEWPOINT="0.5 0 0 0 0 0 1"))
    assert np.array_equal(scan.points_sensor, POINTS, equal_nan=True)
    assert np.allclose(scan.T_map_sensor, [[-1, 0, 0, 0.5], [0, -1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


@pytest.mark.parametrize("kind", KINDS)
def test_pcds_that_are_cut_off_are_refused(tmp_path, kind):
    refuse(tmp_path / "cloud.pcd", pcd(POINTS, kind)[:-6], "cut off|lines of points|numbers")


def padded(kind, counts):
    """A file with padding columns of these counts after z; whole numbers fill them."""
    names = ["x", "y", "z", *"_" * len(counts)]
    header = {
        "fields": " ".join(names),
        "SIZE": " ".join(["4"] * 3 + ["1"] * len(counts)),
        "TYPE": " ".join(["F"] * 3 + ["U"] * len(counts)),
        "COUNT": " ".join(["1"] * 3 + [str(count) for count in counts]),
    }
    start = pcd(POINTS, kind, **header).split(f"DATA {kind}\n".encode())[0] + f"DATA {kind}\n".encode()
    if kind == "ascii":
        return start + b"".join(
            b" ".join(b"%r" % float(v) if v == v else b"nan" for v in row) + b" 7" * sum(counts) + b"\r\n"
            for row in POINTS
        )
    rows = [row.tobytes() + bytes([7]) * sum(counts) for row in POINTS]
    return start + b"".join(rows)


@pytest.mark.parametrize("counts", [[1], [4, 12], [0], [0, 3, 0]])
@pytest.mark.parametrize("kind", ["ascii", "binary"])
def test_padding_columns_are_passed_over(tmp_path, kind, counts):
    scan = read(tmp_path / "cloud.pcd", padded(kind, counts))
    assert np.array_equal(scan.points_sensor, POINTS, equal_nan=True)


@pytest.mark.parametrize("with_padding", [False, True])
def test_compressed_padding_is_there_or_left_out_as_pcl_does(tmp_path, with_padding):
    header = padded("binary", [4, 12]).split(b"DATA")[0]
    plain = POINTS.T.tobytes() + (bytes(16 * len(POINTS)) if with_padding else b"")
    packed = literal_lzf(plain)
    content = header + b"DATA binary_compressed\n" + struct.pack("<II", len(packed), len(plain)) + packed
    assert np.array_equal(read(tmp_path / "cloud.pcd", content).points_sensor, POINTS, equal_nan=True)
    refuse(
        tmp_path / "cloud.pcd",
        content.replace(b"COUNT 1 1 1 4 12", b"COUNT 1 1 1 4 13")
        .replace(b"POINTS 3", b"POINTS 2")
        .replace(b"WIDTH 3", b"WIDTH 2"),
        "its header says",
    )


@pytest.mark.parametrize(("kind", "dtype"), [("F", "f8"), ("I", "i2"), ("I", "i4"), ("U", "u1"), ("U", "u8")])
@pytest.mark.parametrize("data", KINDS)
def test_numbers_of_every_type_are_read(tmp_path, kind, dtype, data):
    points = np.array([[1, 2, 3], [4, 5, 250]]).astype(dtype)
    warnings = []
    scan = read(tmp_path / "cloud.pcd", pcd(points, data, kind=kind), warnings)
    assert np.array_equal(scan.points_sensor, points.astype(float))
    assert len(warnings) == (kind != "F")


@pytest.mark.parametrize("dtype", ["f4", "f8"])
@pytest.mark.parametrize("data", ["binary", "binary_compressed"])
def test_numbers_of_a_machine_with_the_other_byte_order_are_told(tmp_path, dtype, data):
    points = np.random.default_rng(5).uniform(-3, 3, (200, 3)).astype(">" + dtype)
    warnings = []
    scan = read(tmp_path / "cloud.pcd", pcd(points, data), warnings)
    assert np.array_equal(scan.points_sensor, points)
    assert len(warnings) == 1
    assert "other byte order" in warnings[0]


def test_a_mark_of_utf8_is_no_part_of_the_header(tmp_path):
    content = b"\xef\xbb\xbf" + pcd(POINTS).split(b"\n", 2)[2]  # FIELDS right after it
    assert np.array_equal(read(tmp_path / "cloud.pcd", content).points_sensor, POINTS, equal_nan=True)


def test_line_ends_comments_and_words_of_other_systems(tmp_path):
    text = (
        "# made elsewhere\r\n# twice\r\nVERSION .7\r\nFIELDS x y z\r\nSIZE 4 4 4\r\n# here too\r\nTYPE F F F\r\n\r\n"
        "WIDTH 3\r\nHEIGHT 2\r\nDATA ascii\r\n1 2 3\r\n\r\nnan NaN -nan\r\ninf -inf Infinity\r\n"
        "1.#QNAN -1.#IND 1.#INF\r\n"
        "-nan(ind) nan(snan) 1\r\n1e0 +2 3.\r\n"
    )
    points = read(tmp_path / "cloud.PCD", text.encode()).points_sensor
    assert np.array_equal(points[[0, 5]], [[1, 2, 3]] * 2)
    assert not np.isfinite(points[1:5]).all(axis=1).any()


def test_widths_alone_and_points_alone_say_how_many(tmp_path):
    for drop in (["POINTS"], ["WIDTH", "HEIGHT"], ["HEIGHT"], ["POINTS", "HEIGHT"]):
        assert len(read(tmp_path / "cloud.pcd", pcd(POINTS, drop=drop)).points_sensor) == 3
    old = pcd(POINTS, drop=["COUNT", "VIEWPOINT"]).replace(b"FIELDS", b"COLUMNS")
    assert len(read(tmp_path / "cloud.pcd", old).points_sensor) == 3


@pytest.mark.parametrize(
    ("replaced", "text"),
    [
        ({"fields": "a b c"}, "needs x, y and z once each"),
        ({"fields": "x y y"}, "needs x, y and z once each"),
        ({"fields": "X Y Z"}, "needs x, y and z"),
        ({"COUNT": "1 1 2"}, "COUNT of field z is 2; valid: 1"),
        ({"COUNT": "1 0 1"}, "COUNT of field y is 0; valid: 1"),
        ({"COUNT": "1 1"}, "COUNT has 2 entries; valid: one for each of 3"),
        ({"COUNT": "1 1 -1"}, "COUNT is '-1'; valid: a whole number"),
        ({"SIZE": "4 4 3"}, "field z is F3; valid"),
        ({"SIZE": "4 4 x"}, "SIZE is 'x'"),
        ({"TYPE": "F F G"}, "field z is G4; valid"),
        ({"POINTS": 4}, "POINTS is 4, but WIDTH times HEIGHT is 3"),
        ({"POINTS": "3 3"}, "POINTS is '3 3'"),
        ({"POINTS": "9" * 40, "WIDTH": 3}, "POINTS is '999"),
        ({"WIDTH": "10000000", "HEIGHT": "10000000", "POINTS": "100000000000000"}, "cut off"),
        ({"drop": ["POINTS", "WIDTH"]}, "lacks POINTS"),
        ({"drop": ["TYPE", "SIZE"]}, "lacks SIZE, TYPE"),
        ({"data": "base64"}, "DATA is 'base64'; valid: ascii, binary, binary_compressed"),
        ({"VIEWPOINT": "0 0 0 0 0 0 0"}, "VIEWPOINT is '0 0 0 0 0 0 0'; valid: 7 finite numbers"),
        ({"VIEWPOINT": "0 0 nan 1 0 0 0"}, "VIEWPOINT is"),
        ({"VIEWPOINT": "0 0 0 1 0 0"}, "VIEWPOINT is"),
        ({"VIEWPOINT": "0 0 0 one 0 0 0"}, "VIEWPOINT is"),
        ({"VERSION": "0.7\nFIELDS x y z"}, "FIELDS twice"),
    ],
)
def test_headers_that_contradict_themselves_are_refused(tmp_path, replaced, text):
    data = replaced.pop("data", "binary")
    content = pcd(POINTS, **replaced).replace(b"DATA binary", b"DATA " + data.encode())
    refuse(tmp_path / "cloud.pcd", content, text)


@pytest.mark.parametrize("kind", KINDS)
def test_a_cloud_of_no_points_is_one(tmp_path, kind):
    warnings = []
    assert read(tmp_path / "none.pcd", pcd(POINTS[:0], kind), warnings).points_sensor.shape == (0, 3)
    assert warnings == []
    if kind != "ascii":
        head = pcd(POINTS, kind, HEIGHT=0, POINTS=0)
        assert read(tmp_path / "none.pcd", head, warnings).points_sensor.shape == (0, 3)
        assert "after its 0 points were not read" in warnings[0]


def test_bodies_that_do_not_fit_are_refused_or_told(tmp_path):
    path, head = tmp_path / "cloud.pcd", pcd(POINTS[:0], "ascii", WIDTH=2, POINTS=2)
    refuse(path, head + b"1 2 3\n", "1 lines of points; its header says 2")
    refuse(path, head + b"1 2 3\n4 5\n6\n", r"line 13 has 2 numbers; valid: 3")
    refuse(path, head + b"1 2 3\n4 5 six\n", r"line 13 has 'six'; valid: a number")
    refuse(path, head + b"1 2 3\n4,0 5 6\n", r"line 13 has '4,0'")
    refuse(path, head + b"1 2 3\n4 1_5 6\n", r"line 13 has '1_5'; valid: a number")
    warnings = []
    assert len(read(path, pcd(POINTS) + bytes(30), warnings).points_sensor) == 3
    assert len(warnings) == 1
    assert "30 bytes after its 3 points" in warnings[0]
    refuse(path, b"\x89PNG\r\n", "header")
    refuse(path, b"", "header")
    refuse(path, b"#\n" * 10**6, "header")


def test_viewpoints_of_another_length_turn_as_far_and_are_told(tmp_path):
    warnings = []
    scan = read(tmp_path / "cloud.pcd", pcd(POINTS, VIEWPOINT="0 0 0 0 0 0 2"), warnings)
    assert np.allclose(np.diag(scan.T_map_sensor), [-1, -1, 1, 1])
    assert "brought to length 1" in warnings[0]


def test_lzf_copies_what_came_before():
    stream = bytes([2]) + b"abc" + bytes([7 << 5, 0, 2])  # nine more bytes from three back
    assert decompress_lzf(stream, 12) == b"abc" * 4
    with pytest.raises(RecordingError, match="before their begin"):
        decompress_lzf(bytes([0]) + b"a" + bytes([1 << 5, 9]), 4)
    bomb = bytes([0]) + b"a" + bytes([7 << 5, 255, 0]) * 10**6
    with pytest.raises(RecordingError, match="unpack to"):
        decompress_lzf(bomb, 1000)


WHOLE = [pcd(POINTS, kind) for kind in KINDS] + [padded("binary", [4]), padded("ascii", [2])]
TOKENS = [
    b"",
    b" ",
    b"\n",
    b"\r\n",
    b"#",
    b"-1",
    b"0",
    b"1e999",
    b"nan",
    b"99999999999",
    b"x",
    b"_",
    b"F",
    b"\0\xff",
]


@settings(max_examples=300, deadline=2000, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.sampled_from(WHOLE), st.data())
def test_damaged_pcds_are_read_or_refused_by_name(tmp_path, whole, data):
    words = re.split(rb"(\s)", whole)
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(words) - 1))
        kind = data.draw(st.sampled_from(["token", "swap", "drop", "bits"]))
        if kind == "token":
            words[at] = data.draw(st.sampled_from(TOKENS))
        elif kind == "swap":
            words[at] = words[data.draw(st.integers(0, len(words) - 1))]
        elif kind == "drop":
            words[at:] = words[at + data.draw(st.integers(1, 3)) :]
        elif words[at]:
            word = bytearray(words[at])
            word[data.draw(st.integers(0, len(word) - 1))] ^= 1 << data.draw(st.integers(0, 7))
            words[at] = bytes(word)
        if not words:
            break
    try:
        scan = read(tmp_path / "cloud.pcd", b"".join(words))
    except RecordingError as error:
        assert "cloud.pcd" in str(error)
        assert "\n" not in str(error)
    else:
        assert scan.points_sensor.shape[1] == 3
        assert np.isfinite(scan.T_map_sensor).all()
