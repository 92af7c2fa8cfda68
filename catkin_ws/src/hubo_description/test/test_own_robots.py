"""What others' robots bring: mimic joints in the arm, gripper groups, meshes of all kinds, odd names and files."""

import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from own_robot import BODY, BOX, JOINT, links, srdf, text_stl, write_robot

from fv_robot_model import load_mesh
from hubo_description import RobotDescriptionError, load_robot
from hubo_description.check import check_explorer, check_robot
from hubo_description.collision import SelfCollision
from hubo_description.disabled_pairs import joints_between
from hubo_description.disabled_pairs import main as write_disabled_pairs
from hubo_description.upload import parameters

UPLOAD = Path(__file__).resolve().parents[1] / "nodes" / "upload_robot"


def error_of(folder):
    with pytest.raises(RobotDescriptionError) as caught:
        check_explorer(load_robot(folder))
    assert "\n" not in str(caught.value)
    return str(caught.value)


def check(folder):
    """``upload_robot --check`` in at most 2 GB."""
    return subprocess.run(
        [sys.executable, UPLOAD, "--check", "--robot", folder],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30)),
    )


# ---- mimic joints


def test_mimic_joints_within_the_arm_are_accepted_without_rows_and_values(tmp_path):
    robot = load_robot(write_robot(tmp_path / "own"))
    check_explorer(robot)
    assert robot.groups["arm"].joint_names == ["pan", "lift"]
    assert robot.moving_joints == ["pan", "lift", "level"]
    assert robot.group_states["arm"]["ready"] == {"pan": 0.0, "lift": 0.5}


def test_rows_of_mimics_bind_their_leader(tmp_path):
    slow = {
        "has_velocity_limits": True,
        "max_velocity": 0.3,
        "has_acceleration_limits": False,
        "max_acceleration": 9.0,
    }
    robot = load_robot(write_robot(tmp_path / "own", joint_limits={"level": slow}))
    row = parameters(robot)["/robot_description_planning/joint_limits"]["lift"]
    assert (row["max_velocity"], row["max_acceleration"]) == (0.3, 2.0)


def test_a_pose_beyond_a_mimics_limits_is_named(tmp_path):
    text = error_of(write_robot(tmp_path / "own", urdf=links(wrist_limit=(-0.3, 0.3))))  # level = 0.1 - lift
    assert (
        "own.srdf" in text
        and "'lift' at 0.5, outside its limits [-0.2, 0.4]" in text
        and "mimics level" in text
    )


@pytest.mark.parametrize(("value", "fits"), [("-0.4", True), ("-0.4003", True), ("0.2", False)])
def test_values_of_mimics_in_poses_must_fit(tmp_path, value, fits):
    folder = write_robot(tmp_path / "own", semantic=srdf(state=f'<joint name="level" value="{value}"/>'))
    if fits:
        check_explorer(load_robot(folder))
    else:
        assert "'level' at 0.2, but it mimics 'lift', which puts it at -0.4" in error_of(folder)


def test_controllers_may_name_a_mimic_beside_its_leader_only(tmp_path):
    load_robot(write_robot(tmp_path / "both", joints=["pan", "lift", "level"]))
    assert "'level' mimics 'lift', which this controller does not drive" in error_of(
        write_robot(tmp_path / "alone", joints=["pan", "level"])
    )


def test_mimics_follow_in_the_collision_check(tmp_path):
    robot = load_robot(write_robot(tmp_path / "own"))
    assert joints_between(robot.model, "lower", "hand") == ["lift"]
    assert joints_between(robot.model, "upper", "hand") == ["lift"]
    with SelfCollision(robot) as body:
        body.set_joints({"pan": 0.3, "lift": 0.7})
        state = body._bullet.getLinkState(
            body._body, body.link_index["optical"], computeForwardKinematics=True
        )
    T = robot.model.forward({"pan": 0.3, "lift": 0.7})["optical"]
    assert state[4] == pytest.approx(T[:3, 3], abs=1e-6)


# ---- groups


def test_gripper_groups_of_links_and_passive_mimics_are_accepted(tmp_path):
    finger = BODY.format(name="finger_l", shape=BOX) + BODY.format(name="finger_r", shape=BOX)
    limit = '<limit lower="0" upper="0.02" effort="20" velocity="0.1"/>'
    finger += JOINT.format(name="grip", kind="prismatic", parent="hand", child="finger_l", more=limit)
    mimic = limit + '<mimic joint="grip"/>'
    finger += JOINT.format(name="grip_r", kind="prismatic", parent="hand", child="finger_r", more=mimic)
    group = """<group name="gripper"><link name="hand"/><link name="finger_l"/><link name="finger_r"/>
    <joint name="grip"/><joint name="mount"/></group>
    <group name="all"><group name="arm"/><group name="gripper"/></group>
    <group name="tool"><link name="optical"/></group>
    <group_state name="open" group="gripper"><joint name="grip" value="0.02"/><joint name="grip_r" value="0.02"/>
    </group_state><end_effector name="h" parent_link="hand" group="gripper" parent_group="arm"/>
    <virtual_joint name="v" type="fixed" parent_frame="world" child_link="base_link"/>
    <passive_joint name="grip_r"/>"""
    row = {
        "has_velocity_limits": True,
        "max_velocity": 0.1,
        "has_acceleration_limits": True,
        "max_acceleration": 1.0,
    }
    robot = load_robot(
        write_robot(
            tmp_path / "own", urdf=links() + finger, semantic=srdf(more=group), joint_limits={"grip": row}
        )
    )
    check_explorer(robot)
    assert robot.groups["gripper"].joint_names == ["grip"]
    assert robot.groups["tool"].joint_names == []
    assert robot.group_states["gripper"]["open"]["grip"] == 0.02


def test_the_exploring_group_must_be_a_chain_that_moves(tmp_path):
    loose = '<group name="loose"><joint name="pan"/></group>'
    pose = '<group_state name="ready" group="loose"><joint name="pan" value="0"/></group_state>'
    folder = write_robot(tmp_path / "a", semantic=srdf(more=loose + pose), exploration={"group": "loose"})
    assert "group 'loose' is not one <chain>" in error_of(folder)
    stiff = '<group name="stiff"><chain base_link="hand" tip_link="optical"/></group>'
    folder = write_robot(tmp_path / "b", semantic=srdf(more=stiff), exploration={"capability_group": "stiff"})
    assert "capability_group 'stiff' has no joint that moves" in error_of(folder)


# ---- names


def test_an_srdf_of_another_robot_is_named(tmp_path):
    folder = write_robot(tmp_path / "own")
    (folder / "own.srdf").write_text(f'<robot name="before">{srdf()}</robot>')
    done = check(folder)
    assert done.returncode == 1 and done.stderr.count("\n") == 1
    assert "own.srdf" in done.stderr and "'before'" in done.stderr and "'own'" in done.stderr


def test_a_broken_mesh_to_look_at_is_named_too(tmp_path):
    mesh = '<geometry><mesh filename="t.stl"/></geometry>'
    folder = write_robot(tmp_path / "own", urdf=links().replace(f"<visual>{BOX}", f"<visual>{mesh}", 1))
    (folder / "t.stl").write_text("no mesh")
    done = check(folder)
    assert done.returncode == 1 and done.stderr.count("\n") == 1
    assert "own.urdf: mesh" in done.stderr and "t.stl' cannot be read" in done.stderr


@pytest.mark.parametrize("what", ["visual", "collision"])
def test_meshes_of_packages_that_are_not_there_are_named(tmp_path, what):
    mesh = '<geometry><mesh filename="package://nobody_here/arm.stl"/></geometry>'
    urdf = links().replace(f"<{what}>{BOX}", f"<{what}>{mesh}", 1)
    text = error_of(write_robot(tmp_path / "own", urdf=urdf))
    assert "'nobody_here' is not installed" in text and "ROS_PACKAGE_PATH" in text and "own.urdf" in text


def test_a_root_of_the_maps_name_stands_where_the_map_begins(tmp_path):
    check_explorer(load_robot(write_robot(tmp_path / "low", root="world")))
    text = error_of(write_robot(tmp_path / "high", root="world", robot={"base_height_m": 0.6}))
    assert "base_height_m is 0.6" in text and "'world'" in text
    below = links().replace('"lower"', '"world"')
    folder = write_robot(tmp_path / "below", urdf=below, semantic=srdf().replace('"lower"', '"world"'))
    assert "name of the map's frame, 'world'; rename" in error_of(folder)


def test_names_with_dots_and_letters_of_others(tmp_path):
    urdf = links().replace('"lower"', '"lower.0-ärm"')
    folder = write_robot(tmp_path / "own", urdf=urdf, semantic=srdf().replace('"lower"', '"lower.0-ärm"'))
    robot = load_robot(folder)
    check_explorer(robot)
    assert "lower.0-ärm" in robot.model.link_names


# ---- meshes and shapes


def bullet_box(robot, link):
    """The box about a link in Bullet, at the start, (2, 3)."""
    with SelfCollision(robot) as body:
        return np.array(body._bullet.getAABB(body._body, body.link_index[link], body._client))


@pytest.mark.parametrize("scale", ["1 1 1", "1 -1 0.5"])
def test_a_mesh_of_text_is_the_same_in_planner_and_bullet(tmp_path, scale):
    mesh = f'<geometry><mesh filename="t.stl" scale="{scale}"/></geometry>'
    folder = write_robot(tmp_path / "own", urdf=links(upper=mesh))
    (folder / "t.stl").write_text(text_stl())
    robot = load_robot(folder)
    check_robot(robot)
    vertices = robot.model.shapes("upper")[0].vertices + np.array([0.0, 0.0, 0.3])
    planner = np.array([vertices.min(axis=0), vertices.max(axis=0)])
    assert bullet_box(robot, "upper") == pytest.approx(planner, abs=3.1e-3)  # Bullet's margin


@pytest.mark.parametrize(
    ("mesh", "content", "words"),
    [
        ('filename="t.stl" scale="1 0 1"', text_stl(), "scale is 1 0 1"),
        ('filename="t.stl" scale="1 x 1"', text_stl(), "own.urdf"),
        ('filename="t.stl"', "", "t.stl"),
        ('filename="t.stl"', "solid t\nendsolid t\n", "t.stl"),
        ('filename="t.stl"', text_stl().replace("0.4", "0"), "t.stl"),  # flat
        ('filename="t.stl" scale="200 200 200"', text_stl(), "millimetres"),
        ('filename="none.stl"', "", "no such mesh"),
        ('filename=""', "", "no such mesh"),
    ],
)
def test_meshes_that_give_no_shape_are_named(tmp_path, mesh, content, words):
    folder = write_robot(tmp_path / "own", urdf=links(upper=f"<geometry><mesh {mesh}/></geometry>"))
    (folder / "t.stl").write_text(content)
    assert words in error_of(folder)


def test_triangles_of_text_and_hull_agree(tmp_path):
    file = tmp_path / "t.stl"
    file.write_text(text_stl())
    vertices, triangles = load_mesh(str(file))
    assert triangles.shape == (4, 3)
    corners = vertices[triangles]
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert volume == pytest.approx(0.2 * 0.3 * 0.4 / 6)


def test_links_without_shape_are_said_and_need_a_yes(tmp_path):
    bare = links().replace(f"<collision>{BOX}</collision>", "", 2)
    folder = write_robot(tmp_path / "own", urdf=bare)
    done = check(folder)
    assert done.returncode == 0 and "without <collision>" in done.stderr and "upper, lower" in done.stderr
    text = error_of(folder)
    assert "links_without_shape: [upper, lower]" in text and "optical" not in text
    accepted = {"links_without_shape": ["upper", "lower"]}
    check_explorer(load_robot(write_robot(tmp_path / "yes", urdf=bare, exploration=accepted)))
    wrong = write_robot(tmp_path / "wrong", urdf=bare, exploration={"links_without_shape": ["uper"]})
    assert "'uper'; valid: base_link" in error_of(wrong)


def test_an_arm_without_any_body_needs_a_yes_too(tmp_path):
    ghost = links().replace(f"<visual>{BOX}</visual><collision>{BOX}</collision>", "")
    assert "links_without_shape: [upper, lower, hand, optical]" in error_of(
        write_robot(tmp_path / "own", urdf=ghost)
    )


def test_an_arm_that_touches_itself_at_the_start_is_told_the_pair_and_what_helps(tmp_path):
    """The optical frame gets a body so long that it reaches the upper arm."""
    reaching = BODY.format(name="optical", shape='<geometry><box size="0.6 0.05 1.8"/></geometry>')
    urdf = links().replace('<link name="optical"/>', reaching)
    folder = write_robot(tmp_path / "own", urdf=urdf)
    done = check(folder)
    assert done.returncode == 0 and "'upper' and 'optical' touch" in done.stderr
    text = error_of(folder)
    assert "own.srdf: links 'upper' and 'optical' touch in the start pose 'ready'" in text
    assert f"compute_disabled_pairs --robot {folder}" in text
    assert write_disabled_pairs(["--robot", str(folder), "--samples", "20"]) == 0
    check_explorer(load_robot(folder))


# ---- files


def test_encodings_that_a_file_declares_are_read(tmp_path):
    folder = write_robot(tmp_path / "own", robot={"urdf": "own.urdf.xacro"})
    text = f'<?xml version="1.0" encoding="ISO-8859-1"?>\n<!-- Größe -->\n<robot name="own">{links()}</robot>'
    (folder / "own.urdf.xacro").write_bytes(text.encode("latin-1"))
    srdf_text = f'<?xml version="1.0" encoding="UTF-8"?><robot name="own"><!-- ß -->{srdf()}</robot>'
    (folder / "own.srdf").write_bytes(b"\xef\xbb\xbf" + srdf_text.encode())
    check_explorer(load_robot(folder))
    (folder / "own.srdf").write_bytes(srdf_text.replace("UTF-8", "UTF-16").encode("utf-16"))
    check_explorer(load_robot(folder))
    (folder / "own.srdf").write_bytes(srdf_text.encode("latin-1"))
    assert "own.srdf: cannot be read as" in error_of(folder)


BOMB = (
    '<!DOCTYPE r [<!ENTITY a0 "aaaaaaaaaa">'
    + "".join(f'<!ENTITY a{k} "{f"&a{k - 1};" * 10}">' for k in range(1, 12))
    + "]>"
)


@pytest.mark.parametrize("name", ["own.urdf", "own.srdf", "own.urdf.xacro", "included.xacro"])
def test_entity_bombs_are_refused_before_they_grow(tmp_path, name):
    is_xacro = name.endswith(".xacro")
    folder = write_robot(tmp_path / "own", robot={"urdf": "own.urdf.xacro"} if is_xacro else {})
    include = '<xacro:include filename="included.xacro"/>'
    (folder / "own.urdf.xacro").write_text(
        f'<robot name="own" xmlns:xacro="http://www.ros.org/wiki/xacro">{include}{links()}</robot>'
    )
    (folder / "included.xacro").write_text("<robot/>")
    (folder / name).write_text(f'{BOMB}<robot name="own">&a11;</robot>')
    done = check(folder)
    assert done.returncode == 1 and done.stderr.count("\n") == 1, done.stderr[-2000:]
    assert "own" in done.stderr and "Traceback" not in done.stderr


def test_a_document_type_in_a_comment_is_none(tmp_path):
    folder = write_robot(tmp_path / "own", urdf="<!-- <!DOCTYPE robot> -->" + links())
    check_explorer(load_robot(folder))


YAML_BOMB = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 12)
)


@pytest.mark.parametrize("name", ["robot", "joint_limits", "sensors", "controllers"])
@pytest.mark.parametrize(
    ("content", "words"),
    [
        (YAML_BOMB, "aliases"),
        ("a: &a [*a]\n", "holds itself"),
        ("[" * 20000, "deep"),
        ("# " + "x" * (2 << 20), "more than 1048576"),
        ("a: 2001-99-99\n", "no valid YAML"),
        ("\x00", "no valid YAML"),
    ],
    ids=["aliases", "circle", "deep", "long", "date", "zero"],
)
def test_yaml_that_grows_is_refused_before_it_does(tmp_path, name, content, words):
    folder = write_robot(tmp_path / "own")
    (folder / f"{name}.yaml").write_text(content)
    text = error_of(folder)
    assert f"{name}.yaml" in text and words in text and len(text) < 500


def test_aliases_of_an_honest_size_are_read(tmp_path):
    folder = write_robot(tmp_path / "own")
    row = "{has_velocity_limits: true, max_velocity: 1, has_acceleration_limits: true, max_acceleration: 2}"
    (folder / "joint_limits.yaml").write_text(f"joint_limits:\n  pan: &row {row}\n  lift: *row\n")
    assert load_robot(folder).joint_limits["lift"].max_velocity == 1.0
