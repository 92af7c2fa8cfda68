"""Whole files or none."""

import pytest

from fv_common.files import write_replacing, write_whole


def test_a_file_replaces_the_one_before_and_leaves_nothing_beside_it(tmp_path):
    for content in (b"one", "zwei \N{DIGIT TWO}\n"):
        write_whole(tmp_path / "a.txt", content)
    assert (tmp_path / "a.txt").read_text(encoding="utf-8") == "zwei 2\n"
    assert [file.name for file in tmp_path.iterdir()] == ["a.txt"]


def test_a_writer_that_fails_leaves_what_was_there(tmp_path):
    write_whole(tmp_path / "a.npz", "old")

    def half(beside):
        assert beside.suffix == ".npz"
        beside.write_text("half")
        raise OSError("the disk is full")

    with pytest.raises(OSError, match="full"):
        write_replacing(tmp_path / "a.npz", half)
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [("a.npz", "old")]


def test_a_file_that_cannot_be_put_in_place_leaves_nothing_behind(tmp_path):
    (tmp_path / "folder" / "full").mkdir(parents=True)
    with pytest.raises(OSError):
        write_whole(tmp_path / "folder", b"data")
    assert [file.name for file in tmp_path.iterdir()] == ["folder"]
