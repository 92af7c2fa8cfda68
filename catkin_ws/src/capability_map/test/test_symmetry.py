"""Symmetry of the first joint: used where the geometry allows it, and then without a trace in the map."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from conftest import srdf_text, urdf_text
from scipy.spatial.transform import Rotation

from capability_map import BuildParameters, store
from capability_map._core import spiral_points
from capability_map.building.build import build_map, local_executor
from capability_map.building.plan import plan_build
from capability_map.building.symmetry import Symmetry, cells_to_decide, quarter_turn_points, turned_cells
from capability_map.robots import Arm, load_arm

COARSE = BuildParameters(radii_per_arm_length=7.0, points=40, roll_step_deg=30.0)
LIMITED = '<joint name="j1" type="revolute">'
SMALL_BODY = '<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>'
BODY = (
    f'<link name="body">{SMALL_BODY}</link><joint name="fixed" type="fixed"><parent link="base"/>'
    '<child link="body"/><origin xyz="0.2 0.1 0.2"/></joint>'
)


def free_arm(axis: str = "0 0 1", extra: str = "", kind: str = "continuous", rpy: str = "0 0 0") -> Arm:
    """The small arm with an unlimited first joint, whose last joint rolls about z: every decision is exact."""
    urdf = urdf_text(extra=extra).replace("0 0.6 0", "0 0 0")
    urdf = urdf.replace(LIMITED, LIMITED.replace("revolute", kind)).replace("0 0 1", axis, 1)
    urdf = urdf.replace('<origin xyz="0 0 0.1"/>', f'<origin xyz="0 0 0.1" rpy="{rpy}"/>', 1)
    return Arm("small", "arm", urdf, srdf_text())


def built(plan, path) -> store.MapData:
    return build_map(plan, path, local_executor(1))


@pytest.fixture(autouse=True)
def _little_calibration(monkeypatch):
    monkeypatch.setattr("capability_map.building.build.CALIBRATION_VIEWS", 500)


@pytest.mark.parametrize(
    ("arm", "axis", "values"),
    [
        (free_arm(), 2, {"radii_per_arm_length": 8.0}),  # no cell in the middle
        (free_arm("0 0 -1"), 2, {"self_collision": False}),
        (free_arm("1 0 0"), 0, {}),
        (free_arm(rpy="1.5707963267948966 0 0"), 1, {"points": 100}),
    ],
)
def test_sharing_changes_no_bit(tmp_path, arm, axis, values):
    parameters = dataclasses.replace(COARSE, **values)
    plan = plan_build(arm, parameters)
    every = plan_build(arm, dataclasses.replace(parameters, symmetry=False))
    assert (plan.symmetry.axis, plan.symmetry.shared, every.symmetry.shared) == (axis, True, False)
    assert plan.key != every.key
    assert len(plan.decided) < 0.3 * len(plan.cells)
    assert np.array_equal(every.decided, plan.cells)
    shared, full = built(plan, tmp_path / "shared.h5"), built(every, tmp_path / "full.h5")
    for name in ("outward", "cells", "bits"):
        assert np.array_equal(getattr(shared, name), getattr(full, name)), name
    assert len(shared.manipulability) > 1000
    assert np.allclose(shared.manipulability, full.manipulability, rtol=2e-3, atol=1e-4)  # float16
    assert shared.statistics["ik_calls"] < 0.3 * full.statistics["ik_calls"]
    _check_witnesses(plan, shared)


def _check_witnesses(plan, data: store.MapData) -> None:
    valid = np.unpackbits(data.bits.view(np.uint8), axis=1, bitorder="little", count=len(data.outward))
    sphere, point = np.nonzero(valid)
    lower, upper = data.joint_limits.T
    q = lower + (upper - lower) * data.witnesses / 65535.0
    T = plan.arm.model().tip_pose("arm", q)
    wanted = plan.grid().centers(data.cells.tolist())[sphere] + data.radius_m * data.outward[point]
    assert np.abs(T[:, :3, 3] - wanted).max() < 2e-3  # stored to a 65535th of each joint's range
    assert (np.einsum("ij,ij->i", T[:, :3, 2], -data.outward[point]) > np.cos(2e-3)).all()


def test_a_body_that_stays_behind_forbids_it(tmp_path):
    arm = free_arm(extra=BODY)
    plan = plan_build(arm, COARSE)
    assert plan.symmetry.axis is None
    assert "body" in plan.symmetry.text
    assert np.array_equal(plan.decided, plan.cells)
    assert np.array_equal(plan.outward, spiral_points(COARSE.points))
    without = plan_build(arm, dataclasses.replace(COARSE, self_collision=False))
    assert without.symmetry.shared  # what is not looked at cannot forbid anything
    # And rightly so: sharing all the same would be seen.
    forced = Symmetry(2, 1.0, True, "forced")
    directions = quarter_turn_points(COARSE.points, 2)
    full = built(dataclasses.replace(plan, outward=directions), tmp_path / "full.h5")
    decided = cells_to_decide(forced, plan.cells, plan.size)
    wrong = dataclasses.replace(plan, outward=directions, symmetry=forced, decided=decided)
    wrong = built(wrong, tmp_path / "wrong.h5")
    assert len(wrong.manipulability) != len(full.manipulability)


def test_a_body_whose_pairs_are_disabled_forbids_nothing():
    links = [f"link_j{number}" for number in range(1, 7)]
    pairs = "".join(f'<disable_collisions link1="body" link2="{link}" reason="Never"/>' for link in links)
    arm = dataclasses.replace(
        free_arm(extra=BODY), srdf_xml=srdf_text().replace("</robot>", pairs + "</robot>")
    )
    assert plan_build(arm, COARSE).symmetry.shared


@pytest.mark.parametrize(
    ("arm", "values", "reason"),
    [
        (Arm("small", "arm", urdf_text(), srdf_text()), {}, "j1 turns 343.8 degrees, less than a full turn"),
        (free_arm("0 0.1 1"), {}, "not parallel"),
        (free_arm(), {"points": 42}, "42 points are not divisible by 4"),
        (free_arm(), {"box_min_m": (0.1, 0, 0), "box_max_m": (0.5, 0.5, 0.5)}, "misses the centre"),
        (free_arm(), {"box_min_m": (-0.2, -0.6, 0), "box_max_m": (0.2, 0.6, 1)}, "not square"),
        (free_arm(kind="prismatic"), {}, "j1 slides"),
    ],
)
def test_what_forbids_it_is_said(arm, values, reason):
    plan = plan_build(arm, dataclasses.replace(COARSE, **values))
    assert plan.symmetry.axis is None
    assert reason in plan.symmetry.text
    assert plan.decided is plan.cells


def test_hubo_may_share_only_where_contact_is_ignored():
    hubo = load_arm("hubo")
    assert "only one of them turns along" in plan_build(hubo, BuildParameters()).symmetry.text
    assert plan_build(hubo, BuildParameters(self_collision=False)).symmetry.shared


@pytest.mark.parametrize("count", [12, 40, 200])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_directions_are_closed_under_quarter_turns_and_as_even_as_the_spiral(count, axis):
    points = quarter_turn_points(count, axis)
    turned = Rotation.from_rotvec(0.5 * np.pi * np.eye(3)[axis]).apply(points)
    assert np.allclose(np.linalg.norm(points, axis=1), 1.0)
    assert np.allclose(turned, np.roll(points, -count // 4, axis=0))
    views = Rotation.random(20000, random_state=0).as_matrix()[:, :, 2]
    farthest = [np.arccos((views @ p.T).max(axis=1)).max() for p in (points, spiral_points(count))]
    assert farthest[0] < 1.05 * farthest[1]


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_cells_turn_as_their_centres_do(axis):
    plan = plan_build(free_arm(), COARSE)
    centers = plan.grid().centers(plan.cells.tolist())
    middle = plan.origin_m + plan.radius_m * np.array(plan.size)
    for quarters in (1, 2, 3):
        turn = Rotation.from_rotvec(0.5 * np.pi * quarters * np.eye(3)[axis])
        turned = turned_cells(plan.cells, plan.size, axis, quarters)
        assert np.allclose(plan.grid().centers(turned.tolist()), turn.apply(centers - middle) + middle)


def test_the_map_says_how_it_was_used_and_older_maps_are_read(cap, map_path, tmp_path, monkeypatch):
    assert "less than a full turn" in store.load(map_path).symmetry
    write = store._write

    def write_as_before(file, data):
        write(file, data)
        del file.attrs["symmetry"]

    monkeypatch.setattr(store, "_write", write_as_before)
    store.save(tmp_path / "older.h5", cap.data)
    assert store.load(tmp_path / "older.h5").symmetry == "not recorded"
