"""HUBO's offsets: the properties that closed-form inverse kinematics rests on, and the facts of the CAD."""

import numpy as np
import pytest

SIDES = {"R": -1.0, "L": 1.0}
TOLERANCE_M = 1e-9


def line_distance(line_a, line_b):
    """Shortest distance of two infinite lines (point, unit direction) [m]."""
    (p, d), (q, e) = line_a, line_b
    normal = np.cross(d, e)
    if np.linalg.norm(normal) < 1e-9:
        return np.linalg.norm(np.cross(q - p, d))
    return abs(np.dot(q - p, normal)) / np.linalg.norm(normal)


def point_distance(line, point):
    p, d = line
    return np.linalg.norm(np.cross(point - p, d))


def random_pose(robot, seed):
    rng = np.random.default_rng(seed)
    joints = zip(robot.model.joint_names, robot.model.limits, strict=True)
    return {name: rng.uniform(limit.lower, limit.upper) for name, limit in joints}


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("seed", range(5))
def test_shoulder_axes_meet_in_one_point(hubo, hubo_kinematics, side, seed):
    _, axes = hubo_kinematics.frames(random_pose(hubo, seed))
    pitch, roll, yaw = (axes[f"{side}S{c}"] for c in "PRY")
    _, zero_axes = hubo_kinematics.frames(random_pose(hubo, seed) | {f"{side}SR": 0.0})
    assert line_distance(pitch, roll) < TOLERANCE_M
    assert line_distance(roll, yaw) < TOLERANCE_M
    # The point: where roll meets pitch; found without the file's numbers, as the foot on the roll axis.
    (p, d), (q, e) = roll, pitch
    t = np.dot(q - p - np.dot(q - p, e) * e, d)
    centre = p + t * d
    assert point_distance(pitch, centre) < TOLERANCE_M
    assert point_distance(yaw, centre) < TOLERANCE_M
    assert point_distance(zero_axes[f"{side}SY"], centre) < TOLERANCE_M


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("seed", range(5))
def test_straight_elbow_puts_the_forearm_in_line_with_the_upper_arm(hubo, hubo_kinematics, side, seed):
    _, axes = hubo_kinematics.frames(random_pose(hubo, seed) | {f"{side}EP": 0.0})
    upper, forearm = axes[f"{side}SY"], axes[f"{side}WY"]
    assert np.linalg.norm(np.cross(upper[1], forearm[1])) < 1e-9
    assert point_distance(upper, forearm[0]) < TOLERANCE_M


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("seed", range(5))
def test_wrist_axes_meet(hubo, hubo_kinematics, side, seed):
    _, axes = hubo_kinematics.frames(random_pose(hubo, seed))
    assert line_distance(axes[f"{side}WY"], axes[f"{side}WP"]) < TOLERANCE_M


def test_left_side_mirrors_the_right_in_the_hip_frame(hubo_kinematics):
    frames, _ = hubo_kinematics.frames({})
    mirror = np.array([1.0, -1.0, 1.0])
    for link, T in frames.items():
        if link.startswith("Body_R"):
            assert frames[link.replace("Body_R", "Body_L")][:3, 3] == pytest.approx(
                mirror * T[:3, 3], abs=1e-9
            )


def test_positive_waist_turns_the_torso_to_its_left(hubo_kinematics):
    ahead, _ = hubo_kinematics.frames({})
    turned, _ = hubo_kinematics.frames({"WST": 0.5})
    assert ahead["Body_Torso"][:3, 0] == pytest.approx([1.0, 0.0, 0.0])
    assert turned["Body_Torso"][:3, 0] == pytest.approx([np.cos(0.5), np.sin(0.5), 0.0])
    # The CAD hangs the hip at (0.0123, 0.0025, -0.1526) of the torso, axis 0 0 -1, whatever the angle.
    for frames, angle in ((ahead, 0.0), (turned, 0.5)):
        T_torso_hip = np.linalg.inv(frames["Body_Torso"]) @ frames["Body_Hip"]
        assert T_torso_hip[:3, 3] == pytest.approx([0.0123, 0.0025, -0.1526], abs=1e-4)
        assert T_torso_hip[:3, 0] == pytest.approx([np.cos(angle), -np.sin(angle), 0.0])


def test_base_height_is_that_of_straight_legs_on_the_floor(hubo, hubo_kinematics):
    frames, _ = hubo_kinematics.frames({})
    sole_below_ankle_m = 0.1054  # lowest point of the foot in the CAD
    for side in SIDES:
        assert frames[f"Body_{side}AR"][2, 3] - sole_below_ankle_m == pytest.approx(
            -hubo.config.base_height_m, abs=2e-4
        )


def test_ready_pose_looks_ahead_level_at_chest_height(hubo, hubo_kinematics):
    pose = hubo.group_states["torso_right_arm"]["ready"]
    frames, _ = hubo_kinematics.frames(pose)
    T = frames["hand_camera_optical_frame"]
    assert T[:3, 2] @ [1.0, 0.0, 0.0] > np.cos(np.radians(10.0))
    assert abs(T[2, 2]) < np.sin(np.radians(3.0))
    assert T[2, 1] < -0.95  # the image's down is down
    assert frames["Body_Hip"][2, 3] < T[2, 3] < frames["Body_RSP"][2, 3] + 0.1
    for name, value in pose.items():
        limit = hubo.model.limits[hubo.model.joint_index(name)]
        assert min(value - limit.lower, limit.upper - value) >= 0.19, name
