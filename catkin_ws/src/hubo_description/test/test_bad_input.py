"""Broken and contradictory robots: one typed error that names the value and the valid choices."""

import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from hubo_description import RobotDescriptionError, load_robot, robots_folder
from hubo_description.disabled_pairs import BEGIN, write_pairs

UPLOAD = Path(__file__).resolve().parents[1] / "nodes" / "upload_robot"


@pytest.fixture
def copy(tmp_path):
    """A copy of all robots whose HUBO may be damaged."""
    shutil.copytree(robots_folder(), tmp_path / "robots")
    return tmp_path / "robots" / "hubo"


def edit(path, old, new):
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def test_a_folder_loads_like_a_name(copy):
    assert load_robot(copy).urdf_xml == load_robot("hubo").urdf_xml


def test_unknown_robot_lists_the_valid_names():
    with pytest.raises(RobotDescriptionError, match=r"unknown robot 'hobo'.*franka_panda.*hubo.*kuka_iiwa"):
        load_robot("hobo")


DAMAGES = {
    "unknown key": ("robot.yaml", "start_pose:", "start_posse:", "unknown key 'start_posse'.*'start_pose'"),
    "missing unit": ("robot.yaml", "base_height_m:", "base_height:", "unknown key 'base_height'.*'base_height_m'"),
    "wrong unit": ("sensors.yaml", "horizontal_fov_deg:", "horizontal_fov_rad:", "horizontal_fov_deg.*the unit"),
    "fov too wide": ("sensors.yaml", "horizontal_fov_deg: 58.0", "horizontal_fov_deg: 180", "is 180; .*5 to 179 .deg"),
    "fov in radians": ("sensors.yaml", "vertical_fov_deg: 45.0", "vertical_fov_deg: 1.03", "is 1.03; .*5 to 179 .deg"),
    "range in millimetres": ("sensors.yaml", "max_range_m: 3.0", "max_range_m: 3000", "is 3000; .* 0.01 to 100"),
    "topic": ("sensors.yaml", "topic: /camera", "topic: /my-camera", "topic: 'my-camera' is no name in ROS; valid"),
    "camera elsewhere": ("sensors.yaml", "optical_frame: hand_camera_optical_frame", "optical_frame: hand_camera_link",
                         "'torso_right_arm' ends in link 'hand_camera_optical_frame', but camera 'hand_camera' looks"),
    "robot's name": ("robot.yaml", "name: hubo\n", "name: ../hubo\n", "one that a file can have, got '../hubo'"),
    "clearance in millimetres": ("robot.yaml", "size_m: [1.0", "size_m: [1000", ".0. is 1000; .*at most 20"),
    "limits in degrees": ("hubo.urdf.xacro", 'lower="-2.8" upper="2.8"', 'lower="-160" upper="160"',
                          "may move from -160 to 160; valid: radians"),
    "velocity in degrees": ("joint_limits.yaml", "max_velocity: 1.0", "max_velocity: 90", "is 90; .* 50 .rad/s"),
    "controller name": ("controllers.yaml", "  joint_state_controller:", "  joint state:", "'joint state' is no name"),
    "pose with a comma": ("hubo.srdf", 'name="REP" value="-0.2"', 'name="REP" value="-0,2"', "'-0,2' is no joint"),
    "link with a slash": ("hubo.urdf.xacro", '<link name="base_link"/>',
        '<link name="base_link"/><link name="/x"/><joint name="xj" type="fixed"><parent link="base_link"/>'
        '<child link="/x"/></joint>', "'/x' begins with /"),
    "swapped range": ("sensors.yaml", "min_range_m: 0.3", "min_range_m: 5.0", "min_range_m < max_range_m"),
    "text for number": ("sensors.yaml", "rate_hz: 5.0", "rate_hz: fast", "rate_hz is 'fast'; valid: a number"),
    "nan": ("sensors.yaml", "rate_hz: 5.0", "rate_hz: .nan", "rate_hz is nan; valid: a number"),
    "sensor type": ("sensors.yaml", "type: depth_camera", "type: x_ray", "'x_ray'.*camera, lidar, imu, force_torque"),
    "sensor link": ("sensors.yaml", "link: hand_camera_link", "link: nose", "unknown link of sensor.*'nose'"),
    "noise key": ("sensors.yaml", "sigma_base_m", "sigma_base_mm", "unknown key 'sigma_base_mm'.*sigma_base_m"),
    "broken yaml": ("sensors.yaml", "hand_camera:", "hand_camera: [", "no valid YAML"),
    "unknown joint": ("joint_limits.yaml", "  WST:", "  WAIST:", "unknown joint 'WAIST'.*WST"),
    "joint without limits": ("joint_limits.yaml", "  WST:", "  # WST:", "no limits for joint 'WST'"),
    "zero velocity": ("joint_limits.yaml", "max_velocity: 1.0", "max_velocity: 0", "max_velocity is 0; valid"),
    "controller joint": ("controllers.yaml", "joints: [WST]", "joints: [WTS]", "unknown joint 'WTS'"),
    "controller type": ("controllers.yaml", "position_controllers/", "velocity_controllers/", "unknown type"),
    "gain key": ("controllers.yaml", "{p: 2400", "{P: 2400", "unknown key 'P'"),
    "controller list": ("controllers.yaml", "name: huboplus/torso", "name: hubo/torso", "no such controller.*torso"),
    "namespace": ("robot.yaml", "namespace: huboplus", "namespace: hubo", "unknown key 'huboplus'"),
    "group": ("robot.yaml", "group: torso_right_arm", "group: third_arm", "'third_arm'; valid: head, left_arm"),
    "camera": ("robot.yaml", "camera: hand_camera", "camera: eye", "unknown camera 'eye'; valid: hand_camera"),
    "clearance frame": ("robot.yaml", "{frame: base_link,", "{frame: moon,", "clearance frame 'moon'"),
    "clearance size": ("robot.yaml", "size_m: [1.0", "size_m: [0.0", r"size_m\[0\] is 0.0; valid"),
    "urdf missing": ("robot.yaml", "hubo.urdf.xacro", "hubot.urdf.xacro", "no such URDF file"),
    "urdf kind": ("robot.yaml", "hubo.urdf.xacro", "hubo.dae", "got 'hubo.dae'"),
    "xacro broken": ("hubo.urdf.xacro", '<xacro:arm side="R"', "<xacro:leggg", "cannot be expanded"),
    "xml broken": ("hubo.urdf.xacro", "</robot>", "</robots>", "cannot be expanded"),
    "unknown parent": ("hubo.urdf.xacro", '<child link="Body_Hip"/>', '<child link="Hip"/>', "unknown link 'Hip'"),
    "limits swapped": ("hubo.urdf.xacro", 'lower="-2.8" upper="2.8"', 'lower="2.8" upper="-2.8"', "not below"),
    "srdf broken": ("hubo.srdf", "</group>", "</grup>", "hubo.srdf: the SRDF is not XML"),
    "srdf link": ("hubo.srdf", 'tip_link="Body_LWP"', 'tip_link="Hook"', "hubo.srdf.*link 'Hook'.*; valid: base_link"),
    "srdf no chain": ("hubo.srdf", 'base_link="Body_Torso" tip_link="Body_LWP"',
                      'base_link="Body_RSP" tip_link="Body_LWP"', "'Body_RSP' is not above 'Body_LWP'"),
    "pose out of limits": ("hubo.srdf", 'name="REP" value="-0.2"', 'name="REP" value="0.2"', "'REP' at 0.2, outside"),
    "pose no number": ("hubo.srdf", 'name="REP" value="-0.2"', 'name="REP" value="low"', "'low' is no joint value"),
}  # fmt: skip


@pytest.mark.parametrize("case", DAMAGES)
def test_damage_is_named(copy, case):
    file, old, new, message = DAMAGES[case]
    edit(copy / file, old, new)
    with pytest.raises(RobotDescriptionError, match=message) as caught:
        load_robot(copy)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "file", ["robot.yaml", "joint_limits.yaml", "sensors.yaml", "controllers.yaml", "hubo.srdf"]
)
def test_a_missing_file_is_named(copy, file):
    (copy / file).unlink()
    with pytest.raises(RobotDescriptionError, match=file):
        load_robot(copy)


def test_a_missing_mesh_is_named(copy):
    edit(copy / "hubo.urdf.xacro", '<link name="base_link"/>',
         '<link name="base_link"><visual><geometry><mesh filename="no.stl"/></geometry></visual></link>')  # fmt: skip
    with pytest.raises(RobotDescriptionError, match=r"no such mesh: .*no.stl"):
        load_robot(copy)


@pytest.mark.parametrize("arguments", [["--robot", "hobo"], []])
def test_upload_fails_with_one_line(arguments, monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", "http://localhost:1")  # nobody listens there
    done = subprocess.run([sys.executable, UPLOAD, *arguments], capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert done.stderr.startswith("upload_robot: ")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("name", ["kuka_iiwa", "hubo", "free_camera"])
def test_a_copied_robot_is_checked_without_a_master(name, tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", "http://localhost:1")
    mine = tmp_path / "mine"
    shutil.copytree(robots_folder() / name, mine)
    words = [sys.executable, UPLOAD, "--check", "--robot", mine]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert name in done.stdout


def test_pairs_are_written_into_an_srdf_that_had_none(tmp_path):
    srdf = tmp_path / "own.srdf"
    srdf.write_text('<?xml version="1.0"?>\n<robot name="own">\n</robot>\n', encoding="utf-8")
    for reason in ("Never", "Adjacent"):  # the second call finds the markers of the first
        write_pairs(srdf, {("upper", "lower"): reason})
        root = ET.fromstring(srdf.read_text(encoding="utf-8"))
        assert [dict(pair.attrib) for pair in root] == [
            {"link1": "upper", "link2": "lower", "reason": reason}
        ]


def test_an_srdf_with_half_of_the_markers_is_refused_and_left_alone(copy):
    edit(copy / "hubo.srdf", BEGIN, "")
    before = (copy / "hubo.srdf").read_text(encoding="utf-8")
    with pytest.raises(RobotDescriptionError, match="once"):
        write_pairs(copy / "hubo.srdf", {})
    assert (copy / "hubo.srdf").read_text(encoding="utf-8") == before
