"""The YAML that ships has exactly the structs' members and defaults."""

from pathlib import Path

import pytest
import yaml
from ompl_planner import _core
from ompl_planner.move import goal_from_args, parser

PACKAGE = Path(__file__).resolve().parents[1]
NODE = {"joint_state_timeout_s", "map_wait_s", "controller_wait_s", "settle_s"}


def test_yaml_has_the_defaults_of_the_struct():
    shipped = yaml.safe_load((PACKAGE / "config" / "planner.yaml").read_text())
    defaults = _core.config_defaults()
    assert set(shipped) == set(defaults) | NODE
    for name, value in defaults.items():
        assert shipped[name] == value, name


def test_yaml_documents_every_planner():
    lines = (PACKAGE / "config" / "planner.yaml").read_text().splitlines()
    line = next(line for line in lines if line.startswith("planner:"))
    assert all(name in line for name in _core.planner_names())


def test_move_understands_its_goals():
    goal = goal_from_args(parser().parse_args(["--joints", "WST=0.1", "REP=-1"]), "arm")
    assert (goal.goal_joints.name, goal.goal_joints.position) == (["WST", "REP"], [0.1, -1.0])
    goal = goal_from_args(
        parser().parse_args(["--pose", "1", "2", "3", "0", "0", "0", "1", "--free-roll"]), "arm"
    )
    assert goal.goal_poses.poses[0].position.z == 3.0 and goal.free_roll
    goal = goal_from_args(
        parser().parse_args(["--camera", "1", "2", "3", "0", "0", "0", "1"]), "arm", "optical_frame"
    )
    assert goal.tip_link == "optical_frame" and goal.free_roll


@pytest.mark.parametrize(
    "argv", [[], ["--named", "home", "--joints", "A=1"], ["--joints", "A"], ["--joints", "A=x"]]
)
def test_move_refuses_what_it_does_not_understand(argv):
    with pytest.raises(SystemExit):
        parser().parse_args(argv)
