"""What the commands leave behind: whole files or none."""

import numpy as np
from PIL import Image

from hubo_sim.pictures import write_png


def test_a_picture_replaces_the_one_before_and_leaves_nothing_beside_it(tmp_path):
    for value in (10, 200):
        write_png(tmp_path / "a.png", np.full((4, 6, 3), value, np.uint8))
        assert np.asarray(Image.open(tmp_path / "a.png")).mean() == value
    assert [file.name for file in tmp_path.iterdir()] == ["a.png"]
