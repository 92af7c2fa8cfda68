"""Bags: what is read from them, and what is said when there is none."""

import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

from fv_viz import recording


@pytest.fixture
def bag(tmp_path):
    types = get_typestore(Stores.ROS1_NOETIC)
    text = types.types["std_msgs/msg/String"]
    path = tmp_path / recording.BAG
    with Writer(path) as writer:
        for topic, words in (("/other", "nothing"), (recording.DESCRIPTION, "<robot name='r'/>")):
            connection = writer.add_connection(topic, text.__msgtype__, typestore=types)
            writer.write(connection, 10, types.serialize_ros1(text(words), text.__msgtype__))
    return path


def test_the_robot_description_comes_back(bag):
    assert recording.description_of(bag) == "<robot name='r'/>"


def test_a_bag_becomes_mcap_once(bag, tmp_path):
    assert recording.mcap_main([str(tmp_path), str(tmp_path / "out")]) == 0
    files = list((tmp_path / "out").glob("*.mcap"))
    assert len(files) == 1
    assert files[0].read_bytes().startswith(b"\x89MCAP")
    assert recording.mcap_main([str(tmp_path), str(tmp_path / "out")]) == 1


@pytest.mark.parametrize(
    "command", [recording.replay_main, lambda a: recording.mcap_main([*a, "/nowhere/out"])]
)
def test_no_bag_and_a_broken_bag_are_said_in_one_line(tmp_path, command, capsys):
    broken = tmp_path / "broken.bag"
    broken.write_bytes(b"#ROSBAG V2.0\nnonsense")
    assert command([str(tmp_path / "none.bag")]) == 1
    assert command([str(broken)]) == 1
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 2
    assert all(line.startswith("error: ") for line in lines)
