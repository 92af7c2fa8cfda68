"""World files: what ships loads, and what is broken is named in one line."""

import numpy as np
import pytest
import yaml

from fv_common.errors import ConfigError
from hubo_sim.commands import settle_world
from hubo_sim.commands.sim_node import print_worlds
from hubo_sim.config import SimConfig
from hubo_sim.errors import SimError
from hubo_sim.ground_truth import TrueWorld
from hubo_sim.paths import package_folder
from hubo_sim.worlds import list_worlds, load_world, parse_object, parse_world
from hubo_sim.worlds.kinds import KINDS
from hubo_sim.worlds.scene import Scene
from hubo_sim.worlds.settle import largest_way, settle
from hubo_sim.worlds.triangles import surface_points

GENERATED = [*(f"{kind}:{seed}" for kind in KINDS for seed in (1, 2)), "tabletop"]
MINIMAL = {"description": "d", "bounds": {"min_m": [0, 0, 0], "max_m": [1, 1, 1]}}


def test_the_worlds_that_the_readme_promises_are_there():
    assert {"cabinet", "empty", "monastery", "office", "rubble", "shelf"} <= set(list_worlds())


@pytest.mark.parametrize("name", [*list_worlds(), *GENERATED])
def test_every_world_loads_into_physics(name):
    world = load_world(name)
    assert world.description
    with Scene(egl=False) as scene:
        scene.load_world(world)
        assert len(scene.bodies) == len(world.objects)


@pytest.mark.parametrize("name", [n for n in [*list_worlds(), *GENERATED] if n != "monastery"])
def test_nothing_stands_in_the_sweep_of_the_waist(name):
    """Within 0.75 m of the robot's vertical axis there is only floor and ceiling."""
    for solid in TrueWorld(load_world(name)).solids:
        if solid.name not in ("floor", "ceiling"):
            points = surface_points(solid.triangles, 0.05)
            assert np.hypot(points[:, 0], points[:, 1]).min() > 0.75, solid.name


def test_rubble_stands_by_itself():
    world = load_world("rubble")
    assert largest_way(world, settle(world)) < 0.01


def test_settled_objects_lie_on_each_other_and_settling_repeats():
    boxes = [
        {"name": f"box_{i}", "box": {"size_m": [0.2, 0.2, 0.1]}, "position_m": [0.01 * i, 0, 0.3 * i]}
        for i in (1, 2)
    ]
    floor = {"name": "floor", "box": {"size_m": [4, 4, 0.1]}, "position_m": [0, 0, -0.05]}
    world = parse_world(MINIMAL | {"objects": [floor, *boxes]}, "w", "w")
    first, second = settle(world), settle(world)
    heights = [item.T_world_object[2, 3] for item in first.objects]
    assert heights == pytest.approx([-0.05, 0.05, 0.15], abs=2e-3)
    assert largest_way(first, second) == 0.0
    with pytest.raises(SimError, match="still moves after 2 s"):
        settle(world, still=(), limit_s=2)  # the floor falls too


def test_settle_world_writes_a_world_that_loads(tmp_path, monkeypatch, capsys):
    floor = {"name": "floor", "box": {"size_m": [4, 4, 0.1]}, "position_m": [0, 0, -0.05]}
    ball = {"name": "ball", "box": {"size_m": [0.1, 0.1, 0.1]}, "position_m": [0, 0, 0.2]}
    fence = {"name": "fence", "box": {"size_m": [0.1, 1, 1]}, "position_m": [1, 0, 0.5]}
    (tmp_path / "in.yaml").write_text(yaml.safe_dump(MINIMAL | {"objects": [floor, ball, fence]}))
    out = tmp_path / "out.yaml"
    words = ["settle_world", "--world", str(tmp_path / "in.yaml"), "--out", str(out), "--fences", "fence"]
    monkeypatch.setattr("sys.argv", words)
    assert settle_world.main() == 0
    assert "0.15" in capsys.readouterr().out
    world = load_world(str(out))
    assert [item.name for item in world.objects] == ["floor", "ball"]
    assert world.objects[1].T_world_object[2, 3] == pytest.approx(0.05, abs=2e-3)


@pytest.mark.parametrize("name", GENERATED)
def test_generated_worlds_repeat_for_their_seed(name):
    first, second = load_world(name), load_world(name)
    for a, b in zip(first.objects, second.objects, strict=True):
        assert a.name == b.name and np.array_equal(a.T_world_object, b.T_world_object)
    assert len(first.objects) > 10


def test_unknown_world_lists_the_valid_ones():
    with pytest.raises(SimError, match="office"):
        load_world("nowhere")


def test_list_names_every_world_and_each_of_them_loads(capsys):
    print_worlds()
    listed = [line.split()[0] for line in capsys.readouterr().out.splitlines()]
    assert {"shelf", "office", "cabinet", "rubble", "monastery", "empty", "tabletop:SEED"} <= set(listed)
    for name in listed:
        assert load_world(name.replace("SEED", "7")).description


def test_bad_seed_of_a_generated_world_is_named():
    for name in ("room:x", "castle:1", "room:-1", "room:²"):
        with pytest.raises(SimError):
            load_world(name)


def test_file_that_is_no_yaml_is_named(tmp_path):
    path = tmp_path / "broken.yaml"
    path.write_text("a: [1")
    with pytest.raises(SimError, match="broken"):
        load_world(str(path))


LAUGHS = "a0: &a0 [ha]\n" + "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 12))


@pytest.mark.parametrize(
    ("text", "word"),
    [
        (LAUGHS, "its aliases .* grow to more than"),
        ("[" * 20_000, "nested too deep"),
        ("a: &a [*a]", "an alias that holds itself"),
        ("description: one\nbounds: {}\ndescription: two", "key 'description' is there twice.*line 3"),
    ],
    ids=["laughs", "deep", "circle", "twice"],
)
def test_yaml_that_grows_or_contradicts_itself_is_refused(tmp_path, text, word):
    path = tmp_path / "bomb.yaml"
    path.write_text(text)
    with pytest.raises(SimError, match=rf"bomb\.yaml: .*{word}"):
        load_world(str(path))


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"colour": 1}, "colour"),
        ({"bounds": {"min_m": [0, 0, 0], "max_m": [1, 1, 0]}}, "max_m"),
        ({"bounds": {"min_m": [0, 0], "max_m": [1, 1, 1]}}, "min_m"),
        ({"bounds": {"min_m": [0, 0, float("nan")], "max_m": [1, 1, 1]}}, "min_m"),
        ({"robot": {"yaw": 3}}, "yaw"),
        ({"objects": {"name": "a"}}, "list"),
        ({"objects": [{"name": "a"}]}, "exactly one"),
        ({"objects": [{"name": "a", "box": {"size": [1, 1, 1]}}]}, "size"),
        ({"objects": [{"name": "a", "box": {"size_m": [1, 1, "x"]}}]}, "size_m"),
        ({"objects": [{"name": "a", "sphere": {"radius_m": -1}}]}, "radius_m"),
        ({"objects": [{"name": "a", "box": {"size_m": [1, 1, -1]}}]}, "size_m"),
        ({"objects": [{"name": "a", "box": {"size_m": [1, 1, 0]}}]}, "size_m"),
        ({"objects": [{"name": "a", "sphere": {"radius_m": 1}, "position_m": [1e30, 0, 0]}]}, "position_m"),
        ({"objects": [{"name": "a", "sphere": {"radius_m": 1}, "color": [255, 0, 0]}]}, "color"),
        (
            {
                "objects": [
                    {"name": "a", "urdf": {"file": "pybullet_data:duck_vhacd.urdf", "scale": [1, 1, 1]}}
                ]
            },
            "scale",
        ),
        ({1: 2, "colour": 1}, "1"),
        ({"objects": [{"name": "a", "mesh": {"file": "pybullet_data:no.obj"}}]}, "no.obj"),
        ({"objects": [{"name": "a", "sphere": {"radius_m": 1}}] * 2}, "twice"),
        ({"objects": [{"name": "a", "sphere": {"radius_m": 1}, "color": [1, 2]}]}, "color"),
    ],
)
def test_broken_content_is_named_in_one_line(change, word):
    with pytest.raises(SimError, match=word) as err:
        parse_world(MINIMAL | change, "w", "w.yaml")
    assert "\n" not in str(err.value)


def test_broken_urdf_and_taken_name_leave_the_scene_as_it_was(tmp_path):
    path = tmp_path / "bad.urdf"
    path.write_text("<robot")
    with Scene(egl=False) as scene:
        scene.add_object(parse_object({"name": "a", "sphere": {"radius_m": 0.1}}, "x"))
        with pytest.raises(SimError):
            scene.add_object(parse_object({"name": "b", "urdf": {"file": str(path)}}, "x"))
        with pytest.raises(SimError, match="exists"):
            scene.add_object(parse_object({"name": "a", "sphere": {"radius_m": 0.1}}, "x"))
        assert list(scene.bodies) == ["a"]
        with pytest.raises(SimError, match="there are: a"):
            scene.remove_object("b")


def test_gui_without_a_display_is_one_clear_line(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    with pytest.raises(SimError, match="display"):
        Scene(gui=True)


def test_shipped_parameters_are_the_defaults():
    shipped = yaml.safe_load((package_folder() / "config" / "sim.yaml").read_text())
    assert shipped == vars(SimConfig())


@pytest.mark.parametrize("bad", [{"seed": -1}, {"renderer": "gl"}, {"physics_rate_hz": 0.0}, {"noise": 1}])
def test_bad_parameters_are_named(bad):
    with pytest.raises(ConfigError, match=f"^{next(iter(bad))} is .*; valid: "):
        SimConfig(**bad)
