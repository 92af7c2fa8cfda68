"""The camera in the hand looks past the robot that carries it."""

import numpy as np
import pybullet
import pytest

from hubo_description import load_robot
from hubo_description.bullet_urdf import urdf_for_bullet
from hubo_description.disabled_pairs import start_pose


class View:
    """The robot alone in a world of its own, rendered from its camera."""

    def __init__(self, robot, tmp_path):
        path = tmp_path / "robot.urdf"
        path.write_text(urdf_for_bullet(robot.urdf_xml, robot.model, tmp_path), encoding="utf-8")
        self.client = pybullet.connect(pybullet.DIRECT)
        self.camera = robot.sensors[robot.config.exploration.camera]
        self.body = pybullet.loadURDF(str(path), useFixedBase=True, physicsClientId=self.client)
        infos = [pybullet.getJointInfo(self.body, k, self.client) for k in range(self.count())]
        self.joints = {info[1].decode(): info[0] for info in infos}
        self.links = {info[12].decode(): info[0] for info in infos}

    def count(self):
        return pybullet.getNumJoints(self.body, self.client)

    def shares(self, pose):
        """{link: share of the pixels that show it}, links in view only."""
        for name, value in pose.items():
            pybullet.resetJointState(self.body, self.joints[name], value, physicsClientId=self.client)
        frame = self.links[self.camera.optical_frame]
        state = pybullet.getLinkState(
            self.body, frame, computeForwardKinematics=True, physicsClientId=self.client
        )
        eye, R = np.array(state[4]), np.array(pybullet.getMatrixFromQuaternion(state[5])).reshape(3, 3)
        half = np.radians([self.camera.horizontal_fov_deg, self.camera.vertical_fov_deg]) / 2.0
        aspect = np.tan(half[0]) / np.tan(half[1])
        view = pybullet.computeViewMatrix(eye, eye + R[:, 2], -R[:, 1])
        lens = pybullet.computeProjectionMatrixFOV(self.camera.vertical_fov_deg, aspect, 0.003, 5.0)
        flags = pybullet.ER_SEGMENTATION_MASK_OBJECT_AND_LINKINDEX
        image = pybullet.getCameraImage(
            80, 60, view, lens, renderer=pybullet.ER_TINY_RENDERER, flags=flags, physicsClientId=self.client
        )
        seen = np.reshape(image[4], -1)
        seen_links = (seen[seen >= 0] >> 24) - 1  # pybullet packs body and link index into one number
        names = {index: name for name, index in self.links.items()}
        return {names[k]: float(np.sum(seen_links == k)) / seen.size for k in np.unique(seen_links)}


@pytest.fixture
def view_of(tmp_path):
    views = []

    def make(robot):
        views.append(View(robot, tmp_path))
        return views[-1]

    yield make
    for view in views:
        pybullet.disconnect(view.client)


def test_robot_is_out_of_view_at_the_start(robot, view_of):
    assert view_of(robot).shares(start_pose(robot)) == {}


def test_hubo_never_sees_its_hand_and_seldom_the_rest(view_of):
    hubo = load_robot("hubo")
    view, limits = view_of(hubo), dict(zip(hubo.model.joint_names, hubo.model.limits, strict=True))
    yaws = np.linspace(limits["RWY"].lower, limits["RWY"].upper, 9)
    pitches = np.linspace(limits["RWP"].lower, limits["RWP"].upper, 6)
    wrists = [{"RWY": yaw, "RWP": pitch} for yaw in yaws for pitch in pitches]
    seen = [view.shares(start_pose(hubo) | wrist) for wrist in wrists]
    for wrist, shares in zip(wrists, seen, strict=True):
        assert not {"Body_RWP", "Body_RWY", "hand_camera_link"} & set(shares), wrist
    totals = [sum(shares.values()) for shares in seen]
    assert np.median(totals) == 0.0  # the torso and the upper arm, when the wrist turns back to them
    assert np.mean(totals) < 0.1
    assert max(totals) > 0.0  # the view does see what stands in it
