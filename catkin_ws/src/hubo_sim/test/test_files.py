"""What the commands leave behind: whole files or none."""

import numpy as np
import pytest
from PIL import Image

from hubo_sim.files import write_whole
from hubo_sim.pictures import write_png


def test_a_picture_replaces_the_one_before_and_leaves_nothing_beside_it(tmp_path):
    for value in (10, 200):
        write_png(tmp_path / "a.png", np.full((4, 6, 3), value, np.uint8))
        assert np.asarray(Image.open(tmp_path / "a.png")).mean() == value
    assert [file.name for file in tmp_path.iterdir()] == ["a.png"]


def test_a_file_that_cannot_be_put_in_place_leaves_nothing_behind(tmp_path):
    (tmp_path / "folder" / "full").mkdir(parents=True)
    with pytest.raises(OSError):
        write_whole(tmp_path / "folder", b"data")
    assert [file.name for file in tmp_path.iterdir()] == ["folder"]
