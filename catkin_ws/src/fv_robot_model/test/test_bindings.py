"""The Python face: shapes of arrays, keywords, typed errors."""

import threading
from itertools import pairwise

import numpy as np
import pytest
from conftest import EXAMPLE_SRDF, EXAMPLE_URDF

from fv_robot_model import (
    LinkFilterConfig,
    ModelError,
    PointClass,
    RobotModel,
    SelfCollision,
    SelfFilter,
    SelfFilterConfig,
    Shape,
    UnknownNameError,
    body_voxels,
    package_file,
    sphere_cover,
)


def test_forward_takes_one_or_many_or_names(example) -> None:
    model = example.model
    q = example.random_q(5, seed=1)
    batch = model.forward(q)
    assert batch.shape == (5, len(model.link_names), 4, 4)
    np.testing.assert_array_equal(model.forward(q[2]), batch[2])
    by_name = model.forward(dict(zip(model.joint_names, q[2], strict=True)))
    np.testing.assert_array_equal(by_name["hand"], batch[2, model.link_index("hand")])
    assert model.forward(np.zeros((0, 3))).shape == (0, len(model.link_names), 4, 4)


def test_forward_refuses_what_does_not_fit(example) -> None:
    model = example.model
    with pytest.raises(ValueError, match="expected 3 joint values, got 2"):
        model.forward([0.0, 0.0])
    with pytest.raises(ValueError, match="'lift' is nan"):
        model.forward([0.0, np.nan, 0.0])
    with pytest.raises(ValueError, match="lift wrist"):
        model.forward({"turn": 0.0})
    with pytest.raises(UnknownNameError, match="'leg'; valid: turn, lift, wrist"):
        model.forward({"turn": 0.0, "lift": 0.0, "wrist": 0.0, "leg": 0.0})
    with pytest.raises(ValueError, match="shape"):
        model.forward(np.zeros((1, 1, 3)))


def test_jacobian_is_the_derivative_of_the_tip(example) -> None:
    model = example.model
    h = 1e-6
    for q in example.random_q(20, seed=2):
        J = model.jacobian("all", q)
        for i in range(3):
            T = model.tip_pose("all", q + h * np.outer([-1.0, 1.0], np.eye(3)[i]))
            np.testing.assert_allclose(J[:3, i], (T[1] - T[0])[:3, 3] / (2 * h), atol=1e-8)
            spin = (T[1] - T[0])[:3, :3] @ model.tip_pose("all", q)[:3, :3].T / (2 * h)
            np.testing.assert_allclose(J[3:, i], [spin[2, 1], spin[0, 2], spin[1, 0]], atol=1e-8)
    assert model.jacobian("all", np.zeros((4, 3))).shape == (4, 6, 3)


def test_groups_and_named_states(example) -> None:
    model = example.model
    arm = model.group("arm")
    assert (arm.base_link, arm.tip_link, arm.is_chain) == ("trunk", "hand", True)
    assert [model.link_names[i] for i in arm.moved_links] == ["arm", "hand"]
    home = model.named_states("arm")["home"]
    np.testing.assert_allclose(model.with_group("arm", home, np.ones(3)), [1.0, 0.1, -0.5])
    assert model.within_limits("arm", home)
    assert not model.within_limits("arm", [0.31, 0.0])
    with pytest.raises(UnknownNameError, match="'leg'; valid: all, arm"):
        model.group("leg")


def test_joints_are_told_by_name(example) -> None:
    joints = {joint.name: joint for joint in example.model.joints}
    assert {name: joint.type for name, joint in joints.items()} == {
        "turn": "continuous",
        "lift": "prismatic",
        "wrist": "revolute",
    }
    wrist = joints["wrist"]
    assert (wrist.parent, wrist.child, wrist.leader, wrist.multiplier, wrist.offset) == (
        "arm",
        "hand",
        "",
        1.0,
        0.0,
    )
    np.testing.assert_allclose(wrist.axis, np.array([0.0, 1.0, 1.0]) / np.sqrt(2.0))
    np.testing.assert_allclose(wrist.T_parent_joint[:3, 3], [0.45, 0.0, 0.0])
    assert (wrist.limits.lower, wrist.limits.velocity) == (-2.0, 2.0)
    assert example.model.moved_links(["lift"]) == ["arm", "hand"]
    with pytest.raises(UnknownNameError, match="'leg'"):
        example.model.moved_links(["leg"])


def test_what_a_resolver_raises_is_one_line() -> None:
    urdf = "<robot name='r'><link name='a'><collision><geometry><mesh filename='package://nobody/x.stl'/></geometry>"
    urdf += "</collision></link></robot>"
    with pytest.raises(ModelError, match=r"link 'a': .*'nobody' is not installed") as caught:
        RobotModel.from_xml(urdf, resolver=package_file)
    assert "\n" not in str(caught.value)
    assert RobotModel.from_xml(urdf, with_shapes=False).shapes("a") == []
    with pytest.raises(ModelError, match="neither absolute"):
        package_file("x.stl")


def test_parents_come_before_children(robot) -> None:
    model = robot.model
    assert all(model.parent(i) < i for i in range(len(model.link_names)))
    assert len(set(model.link_names)) == len(model.link_names)


def test_broken_descriptions_are_typed_errors() -> None:
    with pytest.raises(ModelError, match="URDF"):
        RobotModel.from_xml("nonsense")
    with pytest.raises(ModelError, match="SRDF is not XML"):
        RobotModel.from_xml(EXAMPLE_URDF, "nonsense")
    with pytest.raises(ModelError, match="'finger'"):
        RobotModel.from_xml(EXAMPLE_URDF, EXAMPLE_SRDF.replace('tip_link="hand"', 'tip_link="finger"', 1))


@pytest.mark.parametrize("text", [EXAMPLE_URDF, EXAMPLE_SRDF])
def test_cut_descriptions_never_crash(text: str) -> None:
    for end in range(0, len(text) - 1, 7):
        parts = (text[:end], "") if text is EXAMPLE_URDF else (EXAMPLE_URDF, text[: max(end, 1)])
        with pytest.raises(ModelError):
            RobotModel.from_xml(*parts)


@pytest.mark.parametrize("is_urdf", [True, False])
def test_mangled_descriptions_never_crash(is_urdf: bool) -> None:
    random = np.random.default_rng(11)
    original = EXAMPLE_URDF if is_urdf else EXAMPLE_SRDF
    refused = 0
    for _ in range(400):
        at, length = random.integers(len(original)), random.integers(1, 12)
        junk = "".join(random.choice(list('<>/"= 0-1.eabn\0é'), random.integers(0, 6)))
        text = original[:at] + junk + original[at + length :]
        try:
            model = RobotModel.from_xml(*((text, "") if is_urdf else (EXAMPLE_URDF, text)))
            SelfCollision(model).in_contact(np.zeros((1, len(model.joint_names))))
        except ModelError:
            refused += 1
    assert refused > 100


def test_what_the_hand_holds_counts_as_robot(example) -> None:
    T_hand_ball = np.eye(4)
    T_hand_ball[0, 3] = 0.2
    ball = Shape.sphere(0.05, T_hand_ball)
    laden = example.model.with_attached("cup", "hand", [ball], touch_links=["arm"])
    q = np.zeros(3)
    T_root_hand = laden.forward(q)[laden.link_index("hand")]
    point = (T_root_hand @ [0.2, 0.0, 0.0, 1.0])[None, :3]
    assert SelfFilter(laden).is_robot(point, q)[0]
    assert not SelfFilter(example.model).is_robot(point, q)[0]
    assert ("base", "cup") in SelfCollision(laden).checked_pairs
    assert ("arm", "cup") not in SelfCollision(laden).checked_pairs


def test_mesh_resolver_errors_name_the_mesh() -> None:
    urdf = EXAMPLE_URDF.replace('<sphere radius="0.06"/>', '<mesh filename="package://p/hand.stl"/>')
    with pytest.raises(ModelError, match=r"package://p/hand\.stl"):
        RobotModel.from_xml(urdf)
    with pytest.raises(ModelError, match="unknown package 'p'; valid: q"):
        RobotModel.from_xml(urdf, "", {"q": "/nowhere"})
    with pytest.raises(ModelError, match="missing"):
        RobotModel.from_xml(urdf, "", lambda uri: "/nowhere/hand.stl")


def test_self_collision_of_a_batch_is_that_of_each(example) -> None:
    checker = SelfCollision(example.model)
    q = example.random_q(500, seed=3)
    batch = checker.in_contact(q)
    assert batch.any() and not batch.all()
    for values, touches in zip(q, batch, strict=True):
        assert (checker.first_contact(values) is not None) == touches
        assert bool(checker.contacts(values)) == touches


def test_self_collision_runs_in_threads(example) -> None:
    checker = SelfCollision(example.model)
    q = example.random_q(20000, seed=4)
    expected = checker.in_contact(q)
    results: list[np.ndarray] = []
    threads = [threading.Thread(target=lambda: results.append(checker.in_contact(q))) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(results) == 4
    for result in results:
        np.testing.assert_array_equal(result, expected)


def test_filter_labels_and_configuration(example) -> None:
    model = example.model
    q = np.zeros(3)
    hand = model.forward(q)[model.link_index("hand"), :3, 3]
    T_root_sensor = np.eye(4)
    T_root_sensor[:3, 3] = hand + np.array([1.0, 0.0, 0.0])
    offsets = np.array([[0.0, 0, 0], [-0.1, 0, 0], [-0.5, 0, 0], [0.5, 0, 0], [np.nan, 0, 0]])
    points_sensor = offsets + hand - T_root_sensor[:3, 3]
    config = SelfFilterConfig(shadow_m=0.02, links={"arm": LinkFilterConfig(ignore=True)})
    labels = SelfFilter(model, config).classify(points_sensor, T_root_sensor, q)
    expected = [PointClass.ROBOT, PointClass.SHADOW, PointClass.ROBOT, PointClass.SCENE, PointClass.INVALID]
    assert labels.tolist() == [int(value) for value in expected]


def test_filter_refuses_unknown_names_and_values(example) -> None:
    with pytest.raises(TypeError):
        SelfFilterConfig(paddingm=0.1)
    with pytest.raises(ValueError, match="padding_m"):
        SelfFilter(example.model, SelfFilterConfig(padding_m=-1.0))
    with pytest.raises(UnknownNameError, match="'leg'"):
        SelfFilter(example.model, SelfFilterConfig(links={"leg": LinkFilterConfig(scale=1.1)}))
    with pytest.raises(ValueError, match="rigid"):
        SelfFilter(example.model).classify(np.zeros((1, 3)), np.zeros((4, 4)), np.zeros(3))
    with pytest.raises(TypeError):
        SelfFilter(example.model).classify(np.zeros((2, 4)), np.eye(4), np.zeros(3))


def test_body_voxels_are_on_the_grid_and_grow_with_padding(example) -> None:
    q = np.zeros(3)
    T_map_root = np.eye(4)
    T_map_root[:3, 3] = [0.3, -0.2, 0.7]
    thin = body_voxels(example.model, q, resolution_m=0.05, T_map_root=T_map_root)
    thick = body_voxels(example.model, q, resolution_m=0.05, padding_m=0.05, T_map_root=T_map_root)
    np.testing.assert_allclose(thin / 0.05 - 0.5, np.round(thin / 0.05 - 0.5), atol=1e-9)
    assert {tuple(p) for p in thin.round(6)} < {tuple(p) for p in thick.round(6)}


def test_cover_counts_fall_with_the_radius(example) -> None:
    counts = [len(sphere_cover(example.model, "arm", radius)) for radius in (0.03, 0.05, 0.1, 1.0)]
    assert all(a >= b for a, b in pairwise(counts)) and counts[-1] == 1
    with pytest.raises(UnknownNameError):
        sphere_cover(example.model, "leg", 0.05)
