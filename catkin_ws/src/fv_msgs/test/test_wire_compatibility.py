"""The message packages that this workspace carries must match upstream byte for byte on the wire."""

import importlib

import pytest

MD5 = {
    "control_msgs.msg.FollowJointTrajectoryAction": "bc4f9b743838566551c0390c65f1a248",
    "control_msgs.msg.FollowJointTrajectoryGoal": "69636787b6ecbde4d61d711979bc7ecb",
    "control_msgs.msg.FollowJointTrajectoryResult": "493383b18409bfb604b4e26c676401d2",
    "control_msgs.msg.FollowJointTrajectoryFeedback": "10817c60c2486ef6b33e97dcd87f4474",
    "control_msgs.msg.JointTrajectoryControllerState": "10817c60c2486ef6b33e97dcd87f4474",
    "control_msgs.msg.JointTolerance": "f544fe9c16cf04547e135dd6063ff5be",
    "control_msgs.srv.QueryTrajectoryState": "ec93cdecbd8062d761aa52b7c90cd44b",
    "octomap_msgs.msg.Octomap": "9a45536b45c5e409cd49f04bb2d9999f",
    "octomap_msgs.msg.OctomapWithPose": "20b380aca6a508a657e95526cddaf618",
    "octomap_msgs.srv.GetOctomap": "be9d2869d24fe40d6bc21ac21f6bb2c5",
    "octomap_msgs.srv.BoundingBoxQuery": "93aa3d73b866f04880927745f4aab303",
}


@pytest.mark.parametrize("name", MD5)
def test_md5_equals_upstream(name):
    module, kind = name.rsplit(".", 1)
    assert getattr(importlib.import_module(module), kind)._md5sum == MD5[name]
