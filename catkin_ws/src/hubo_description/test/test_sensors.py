"""sensors.yaml: every type, any number, on any link; what is wrong is named."""

import shutil

import pytest
import yaml

from hubo_description import RobotDescriptionError, load_robot, robots_folder
from hubo_description.sensors import DepthCamera, ForceTorque, Imu, Lidar, parse_sensors

LIDAR = {"type": "lidar", "link": "Body_Head", "frame": "Body_Head", "topic": "/scan", "samples": 360}
LIDAR |= {"min_range_m": 0.1, "max_range_m": 8.0}
IMU = {"type": "imu", "link": "Body_Torso", "topic": "/imu"}
WRENCH = {"type": "force_torque", "joint": "RWP", "topic": "/wrist/wrench"}


@pytest.fixture
def hubo_with(tmp_path):
    """Loads HUBO with further sensors."""

    def load(**sensors):
        folder = tmp_path / "hubo"
        shutil.copytree(robots_folder() / "hubo", folder, dirs_exist_ok=True)
        shutil.copytree(robots_folder() / "common", tmp_path / "common", dirs_exist_ok=True)
        content = yaml.safe_load((folder / "sensors.yaml").read_text()) | sensors
        (folder / "sensors.yaml").write_text(yaml.safe_dump(content, sort_keys=False))
        return load_robot(folder)

    return load


def test_any_number_of_sensors_on_any_link(hubo_with):
    camera = yaml.safe_load((robots_folder() / "hubo" / "sensors.yaml").read_text())["hand_camera"]
    second = camera | {"link": "Body_Torso", "optical_frame": "Body_Neck", "topic": "/chest"}
    robot = hubo_with(lidar=LIDAR, imu=IMU, wrench=WRENCH, chest=second, imu2=IMU | {"topic": "/imu2"})
    types = [type(sensor) for sensor in robot.sensors.values()]
    assert types == [DepthCamera, Lidar, Imu, ForceTorque, DepthCamera, Imu]
    assert robot.sensors["lidar"].layers == 1 and robot.sensors["imu"].rate_hz == 100.0


@pytest.mark.parametrize(
    ("sensor", "message"),
    [
        (LIDAR | {"link": "nose"}, "unknown link of sensor extra 'nose'"),
        (LIDAR | {"frame": "nose"}, "unknown link of sensor extra 'nose'"),
        (IMU | {"link": "nose"}, "unknown link of sensor extra 'nose'"),
        (WRENCH | {"joint": "knee"}, "unknown joint of sensor extra 'knee'.*RWP"),
        (IMU | {"topic": "/camera"}, "topic 'camera' is another sensor's too"),
    ],
)
def test_references_that_lead_nowhere_are_named(hubo_with, sensor, message):
    with pytest.raises(RobotDescriptionError, match=message):
        hubo_with(extra=sensor)


def test_exploration_needs_a_camera_not_just_any_sensor(hubo_with):
    with pytest.raises(RobotDescriptionError, match="unknown camera 'hand_camera'; valid: "):
        hubo_with(hand_camera=IMU)


@pytest.mark.parametrize(
    ("sensor", "word"),
    [
        (LIDAR | {"samples": 0}, "samples"),
        (LIDAR | {"samples": 1.5}, "samples"),
        (LIDAR | {"layers": 0}, "layers"),
        (LIDAR | {"horizontal_fov_deg": 400.0}, "horizontal_fov_deg"),
        (LIDAR | {"vertical_fov_deg": -1.0}, "vertical_fov_deg"),
        (LIDAR | {"max_range_m": 0.05}, "max_range_m"),
        (LIDAR | {"sigma_m": -0.1}, "sigma_m"),
        (LIDAR | {"smaples": 3}, "did you mean 'samples'"),
        (IMU | {"rate_hz": 0.0}, "rate_hz"),
        (IMU | {"sigma_rad_s": -1.0}, "sigma_rad_s"),
        (IMU | {"seed": -1}, "seed"),
        (WRENCH | {"sigma_nm": -1.0}, "sigma_nm"),
        (WRENCH | {"link": "x"}, "unknown key 'link'"),
        ({"type": "sonar"}, "sonar.*depth_camera, lidar, imu, force_torque"),
    ],
)
def test_broken_sensors_are_named_in_one_line(sensor, word):
    with pytest.raises(RobotDescriptionError, match=word) as err:
        parse_sensors({"extra": sensor})
    assert "extra" in str(err.value) and "\n" not in str(err.value)
