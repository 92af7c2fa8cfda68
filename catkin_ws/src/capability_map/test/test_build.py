"""Building: complete, resumable, and refused in plain words where it makes no sense."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from conftest import srdf_text, urdf_text

from capability_map import BuildParameters, CapabilityMapError, store
from capability_map._core import ViewProbe, spiral_points
from capability_map.building.build import (
    build_map,
    chunk_cells,
    chunk_count,
    compute_chunk,
    local_executor,
    timed_chunk,
)
from capability_map.building.plan import plan_build
from capability_map.commands import (
    build_command,
    check_command,
    info_command,
    listed_maps,
    run_command,
)
from capability_map.paths import default_map_path
from capability_map.robots import Arm, load_arm

COARSE = BuildParameters(radii_per_arm_length=5.0, points=24, roll_step_deg=30.0)


def same_content(a: store.MapData, b: store.MapData) -> bool:
    names = ("cells", "bits", "witnesses", "manipulability")
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in names)


def test_every_point_of_the_map_equals_a_fresh_decision(cap, arm):
    plan = plan_build(arm, BuildParameters(radii_per_arm_length=8.0, points=60, roll_step_deg=15.0))
    probe = ViewProbe(arm.model(), "arm", plan.probe_options())
    rows = np.arange(0, len(cap.centres), 7)
    centers = np.repeat(cap.centres[rows], len(cap.directions), axis=0)
    outward = np.tile(cap.directions, (len(rows), 1))
    truth, _ = probe.decide(centers + cap.radius * outward, -outward)
    assert np.array_equal(truth.reshape(len(rows), -1), cap.valid[rows])


def test_no_shortcut_loses_a_view_that_plain_steps_find():
    from scipy.spatial.transform import Rotation

    from fv_robot_model import SelfCollision
    from fv_robot_model.ik import SerialChain, make_ik_solver

    hubo = load_arm("hubo")
    model = hubo.model()
    plan = plan_build(hubo, BuildParameters(radii_per_arm_length=10.0))
    random = np.random.default_rng(0)
    # Most within half an arm's length: there the body is in the way.
    positions = plan.reach_center_m + random.uniform(-0.5, 0.5, (300, 3)) * plan.arm_length_m
    turns = Rotation.random(300, random_state=0)
    held, _ = ViewProbe(model, "right_arm", plan.probe_options()).decide(
        positions, turns.as_matrix()[:, :, 2]
    )
    solver = make_ik_solver(SerialChain.of_group(model, "right_arm"))
    collision = SelfCollision(model, group="right_arm")
    q_all = np.zeros((1, len(model.limits)))
    lost = blocked = 0
    for position, turn, answer in zip(positions, turns, held, strict=True):
        poses = np.tile(np.eye(4), (36, 1, 1))
        poses[:, :3, :3] = (
            turn * Rotation.from_euler("z", np.arange(0, 360, 10)[:, None], degrees=True)
        ).as_matrix()
        poses[:, :3, 3] = position
        q = np.repeat(q_all, len(joints := solver.solve(poses)[1]), axis=0)
        q[:, model.group("right_arm").joint_indices] = joints
        free = len(q) > 0 and not collision.in_contact(q).all()
        lost += free and not answer
        blocked += len(q) > 0 and not free
    assert lost == 0
    assert blocked > 10  # contact matters here
    assert held.sum() > 30


def test_turning_about_an_unlimited_first_joint_changes_nothing():
    from scipy.spatial.transform import Rotation

    from fv_robot_model.ik import SerialChain

    hubo = load_arm("hubo")
    model = hubo.model()
    chain = SerialChain.of_group(model, "right_arm")
    assert np.ptp(chain.limits[0]) >= 2.0 * np.pi - 1e-6
    plan = plan_build(hubo, BuildParameters(self_collision=False))  # the body does not turn along
    probe = ViewProbe(model, "right_arm", plan.probe_options())
    random = np.random.default_rng(1)
    cells = plan.grid().centers(random.choice(plan.cells, 2000).tolist())
    outward = plan.outward[random.integers(len(plan.outward), size=2000)]
    held, _ = probe.decide(cells + plan.radius_m * outward, -outward)
    turn = Rotation.from_rotvec(chain.axes[0] * random.uniform(-np.pi, np.pi, (2000, 1)))
    turned = turn.apply(cells + plan.radius_m * outward - chain.points[0]) + chain.points[0]
    again, _ = probe.decide(turned, -turn.apply(outward))
    assert held.sum() > 200
    assert (held != again).sum() <= 2  # 0.1 %: windows of roll narrower than anything looked for


def test_cells_left_out_hold_nothing(cap, arm):
    plan = plan_build(arm, BuildParameters(radii_per_arm_length=8.0, points=60, roll_step_deg=15.0))
    probe = ViewProbe(arm.model(), "arm", plan.probe_options())
    skipped = np.setdiff1d(np.arange(np.prod(plan.size)), plan.cells)
    centers = plan.grid().centers(skipped.tolist())
    directions = spiral_points(12)
    for n in directions:
        held, _ = probe.decide(centers + plan.radius_m * n, np.tile(-n, (len(centers), 1)))
        assert not held.any()


def test_stored_configurations_hold_their_points(cap, arm):
    model = arm.model()
    sphere, point = np.nonzero(cap.valid)
    T = model.tip_pose("arm", cap.witnesses())
    wanted = cap.centres[sphere] + cap.radius * cap.directions[point]
    assert np.abs(T[:, :3, 3] - wanted).max() < 2e-3  # stored to a 65535th of each joint's range
    assert (np.einsum("ij,ij->i", T[:, :3, 2], -cap.directions[point]) > np.cos(2e-3)).all()
    assert (cap.data.manipulability >= 0).all()


def test_workers_make_the_same_map_as_one_process(arm, tmp_path):
    plan = plan_build(arm, COARSE)
    one = build_map(plan, tmp_path / "one.h5", local_executor(1))
    two = build_map(plan, tmp_path / "two.h5", local_executor(2))
    assert same_content(one, two)


def test_an_interrupted_build_goes_on_where_it_stopped(arm, tmp_path, monkeypatch):
    monkeypatch.setattr("capability_map.building.build.CELLS_PER_CHUNK", 16)
    plan = plan_build(arm, COARSE)
    whole = build_map(plan, tmp_path / "whole.h5", local_executor(1))
    computed = []

    def stops_after_three(plan, numbers):
        for number in numbers[:3]:
            yield number, timed_chunk(plan, number)
        raise KeyboardInterrupt

    def counting(plan, numbers):
        for number in numbers:
            computed.append(number)
            yield number, timed_chunk(plan, number)

    out = tmp_path / "resumed.h5"
    with pytest.raises(KeyboardInterrupt):
        build_map(plan, out, stops_after_three)
    (tmp_path / "resumed.h5.parts" / "1.npz").write_bytes(b"half written")
    resumed = build_map(plan, out, counting)
    assert len(computed) == chunk_count(plan) - 2
    assert 1 in computed
    assert same_content(whole, resumed)
    assert not (tmp_path / "resumed.h5.parts").exists()


def test_parts_of_other_settings_are_not_used(arm, tmp_path):
    plan = plan_build(arm, COARSE)
    parts = tmp_path / "map.h5.parts"
    parts.mkdir()
    (parts / "key").write_text("of another build")
    (parts / "0.npz").write_bytes(b"")
    assert same_content(
        build_map(plan, tmp_path / "map.h5", local_executor(1)),
        build_map(plan, tmp_path / "b.h5", local_executor(1)),
    )


def test_a_worker_that_dies_costs_nothing_but_time(arm, tmp_path, monkeypatch):
    monkeypatch.setattr("capability_map.building.build.CELLS_PER_CHUNK", 16)
    plan = plan_build(arm, COARSE)
    mark = tmp_path / "died"
    original = compute_chunk

    def dies_once(plan, number):
        if number == 2 and not mark.exists():
            mark.write_text("")
            os.kill(os.getpid(), signal.SIGKILL)
        return original(plan, number)

    monkeypatch.setattr("capability_map.building.build.compute_chunk", dies_once)  # inherited by fork
    data = build_map(plan, tmp_path / "map.h5", local_executor(2))
    assert mark.exists()
    monkeypatch.undo()
    assert same_content(data, build_map(plan, tmp_path / "b.h5", local_executor(1)))


def test_workers_that_always_die_end_the_build_with_a_reason(arm, tmp_path, monkeypatch):
    monkeypatch.setattr(
        "capability_map.building.build.compute_chunk",
        lambda plan, number: os.kill(os.getpid(), signal.SIGKILL),
    )
    with pytest.raises(CapabilityMapError, match="died 3 times"):
        build_map(plan_build(arm, COARSE), tmp_path / "map.h5", local_executor(2))


def test_chunks_cover_every_cell_once(arm):
    plan = plan_build(arm, COARSE)
    cells = np.concatenate([chunk_cells(plan, number) for number in range(chunk_count(plan))])
    assert np.array_equal(np.sort(cells), plan.cells)


def test_shipped_settings_are_the_defaults():
    folder = Path(__file__).resolve().parents[1] / "config"
    values = yaml.safe_load((folder / "build.yaml").read_text())
    assert set(values) == set(BuildParameters.__dataclass_fields__)
    assert BuildParameters.from_mapping(values) == BuildParameters()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"radius": 1.0}, "unknown key .radius. .did you mean .radius_m"),
        ({"radius_m": -1.0}, "radius_m"),
        ({"radius_m": float("nan")}, "radius_m"),
        ({"points": 3}, "points"),
        ({"roll_step_deg": 0.0}, "roll_step_deg"),
        ({"self_collision_padding_m": -0.1}, "self_collision_padding_m"),
        ({"box_min_m": [0, 0, 0]}, "box_max_m"),
        ({"box_min_m": [0, 0, 0], "box_max_m": [1, 0, 1]}, "empty box"),
        ({"max_cells": 0}, "max_cells"),
        ({"direction_tolerance_deg": 90.0}, "direction_tolerance_deg"),
    ],
)
def test_bad_settings_are_named(values, message):
    with pytest.raises(CapabilityMapError, match=message):
        BuildParameters.from_mapping(values)


def test_an_absurd_radius_is_refused_before_anything_starts(arm):
    with pytest.raises(CapabilityMapError, match="max_cells"):
        plan_build(arm, BuildParameters(radius_m=1e-5))
    with pytest.raises(CapabilityMapError, match="max_memory_mb"):
        plan_build(arm, BuildParameters(radius_m=0.008, points=5000))


def test_a_box_is_filled_as_asked(arm):
    plan = plan_build(arm, BuildParameters(radius_m=0.1, box_min_m=(0, 0, 0), box_max_m=(0.4, 0.5, 0.2)))
    assert plan.size == (2, 3, 1)
    assert np.allclose(plan.origin_m + 0.1 * np.array(plan.size), [0.2, 0.25, 0.1])


@pytest.mark.parametrize(
    ("urdf", "srdf", "message"),
    [
        (urdf_text(), srdf_text(tip="nowhere"), "nowhere"),
        (urdf_text(), srdf_text(base="link_j3", tip="link_j1"), "link_j"),
        (urdf_text(), srdf_text(base="link_j6", tip="tip"), "has no moving joint"),
        ("<robot", srdf_text(), "small"),
        (urdf_text().replace('<limit lower="-2.4"', '<x lower="-2.4"'), srdf_text(), "j3"),
    ],
)
def test_what_is_no_arm_is_refused_by_name(urdf, srdf, message):
    with pytest.raises(CapabilityMapError, match=message):
        plan_build(Arm("small", "arm", urdf, srdf), COARSE)


def test_a_prismatic_joint_is_left_to_kdl(tmp_path):
    sliding = Arm(
        "small", "arm", urdf_text(kind="prismatic").replace('lower="-2.4"', 'lower="-0.1"'), srdf_text()
    )
    plan = plan_build(sliding, COARSE)
    assert ViewProbe(sliding.model(), "arm", plan.probe_options()).solver_family == "kdl"


def test_commands_say_what_is_wrong_in_one_line(capsys, tmp_path, monkeypatch):
    monkeypatch.setenv("FV_DATA", str(tmp_path))
    assert default_map_path("r", "g") == tmp_path / "capability_maps" / "r_g.h5"
    assert run_command(build_command, ["--robot", "no_such_robot"]) == 1
    assert "no_such_robot" in capsys.readouterr().err
    assert run_command(build_command, ["--robot", "hubo", "--group", "tail"]) == 1
    assert "right_arm" in capsys.readouterr().err
    assert run_command(build_command, ["--robot", "hubo", "--group", "legs"]) == 1
    capsys.readouterr()
    for workers in ("0", "99999999"):
        assert run_command(build_command, ["--robot", "hubo", "--workers", workers]) == 1
        assert f"--workers is {workers}; valid: 1 to 512" in capsys.readouterr().err
    assert run_command(build_command, ["--robot", "hubo", "--radius", "1e300"]) == 1
    assert "radius 1e+300 m is longer than the arm; valid: up to " in capsys.readouterr().err
    assert run_command(info_command, [str(tmp_path / "none.h5")]) == 1
    assert run_command(check_command, [str(tmp_path / "none.h5")]) == 1
    assert run_command(check_command, [str(tmp_path / "none.h5"), "--seed", "-1"]) == 1
    assert "--seed is -1; valid: 0 or a whole number above" in capsys.readouterr().err


def test_a_second_build_of_hubo_has_nothing_to_do(capsys, tmp_path, monkeypatch):
    monkeypatch.setenv("FV_DATA", str(tmp_path))
    arguments = ["--robot", "hubo", "--radius", "0.12", "--points", "24", "--roll-step", "45"]
    assert run_command(build_command, arguments) == 0
    printed = capsys.readouterr().out
    assert "spherical-shoulder-6R" in printed
    assert "symmetry of the first joint: not used: " in printed
    assert run_command(build_command, arguments) == 0
    assert "up to date" in capsys.readouterr().out
    assert run_command(build_command, [*arguments[:-1], "40"]) == 0
    assert "written to" in capsys.readouterr().out


def test_one_command_builds_every_listed_map(capsys, tmp_path, monkeypatch):
    monkeypatch.setenv("FV_DATA", str(tmp_path))
    assert set(listed_maps()) == {
        ("hubo", "right_arm"),
        ("hubo", "left_arm"),
        ("kuka_iiwa", "arm"),
        ("youbot_arm", "arm"),
        ("franka_panda", "arm"),
    }
    monkeypatch.setattr("capability_map.building.build.CALIBRATION_VIEWS", 1000)
    assert run_command(build_command, ["--all", "--radius", "0.3", "--points", "24"]) == 0
    built = {path.stem for path in (tmp_path / "capability_maps").glob("*.h5")}
    assert built == {f"{robot}_{group}" for robot, group in listed_maps()}
    families = [
        line for line in capsys.readouterr().out.splitlines() if line.startswith("inverse kinematics")
    ]
    assert not any("kdl" in line for line in families)
    assert run_command(build_command, ["--all", "--group", "arm"]) == 1


@pytest.fixture
def dask_address():
    """A Dask scheduler and two workers on loopback, as processes of their own."""
    pytest.importorskip("distributed", reason="dask and distributed are not installed")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    dask = [sys.executable, "-m", "distributed.cli.dask_scheduler"]
    scheduler = [*dask, "--host", "127.0.0.1", "--port", str(port), "--no-dashboard"]
    worker = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny"]
    commands = [scheduler] + 2 * [[*worker, "--no-dashboard", "--host", "127.0.0.1"]]
    processes = [subprocess.Popen(c, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) for c in commands]
    yield address
    for process in processes:
        process.kill()
        process.wait()


def test_a_dask_cluster_makes_the_same_map(arm, tmp_path, dask_address):
    from capability_map.building.cluster import dask_executor

    plan = plan_build(arm, COARSE)
    data = build_map(plan, tmp_path / "dask.h5", dask_executor(dask_address, timeout_s=30.0))
    assert same_content(data, build_map(plan, tmp_path / "local.h5", local_executor(1)))


def test_a_missing_cluster_is_named(arm, tmp_path):
    pytest.importorskip("distributed", reason="dask and distributed are not installed")
    from capability_map.building.cluster import dask_executor

    with pytest.raises(CapabilityMapError, match=r"no Dask scheduler at tcp://127.0.0.1:1"):
        build_map(
            plan_build(arm, COARSE), tmp_path / "m.h5", dask_executor("tcp://127.0.0.1:1", timeout_s=1.0)
        )
