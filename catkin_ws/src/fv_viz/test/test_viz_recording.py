"""Bags: what is read from them, how they are played, and what is said when there is none."""

import os
import shutil
import signal
import subprocess

import pytest
import viz_synthetic
from rosbags.highlevel import AnyReader
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
    with AnyReader([tmp_path / "out"]) as reader:
        words = {c.topic: reader.deserialize(data, c.msgtype).data for c, _, data in reader.messages()}
    assert words == {"/other": "nothing", recording.DESCRIPTION: "<robot name='r'/>"}
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


@pytest.mark.skipif(not shutil.which("rosrun"), reason="no rosrun")
def test_a_replay_has_a_clock_and_markers(tmp_path):
    rosbag, rospy = pytest.importorskip("rosbag"), pytest.importorskip("rospy")
    evaluation = viz_synthetic.evaluation(viz_synthetic.scan(0.1, [(0.2, -0.2, 0.5, 0.1)]))
    with rosbag.Bag(str(tmp_path / recording.BAG), "w") as bag:
        for second in range(1, 600, 5):
            bag.write("/fv_exploration/evaluation", evaluation, rospy.Time(second))
    command = ["rosrun", "fv_viz", "replay", str(tmp_path), "--no-rviz"]
    player = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        master = player.stdout.readline().split("ROS_MASTER_URI=")[1].strip()

        def first(topic, field):
            echo = ["rostopic", "echo", "-n", "1", f"{topic}/{field}"]
            environment = {**os.environ, "ROS_MASTER_URI": master, "ROS_HOSTNAME": "localhost"}
            return subprocess.run(echo, capture_output=True, text=True, timeout=200, env=environment).stdout

        assert "secs" in first("/clock", "clock")
        assert "occupied" in first("/fv_viz/occupied", "markers[1]/ns")
    finally:
        player.send_signal(signal.SIGINT)
        assert player.wait(120) == 130
