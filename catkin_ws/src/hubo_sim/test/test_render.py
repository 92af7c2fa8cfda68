"""Depth against analytic truth, for every wrist roll and for both renderers."""

import importlib.util

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fv_common.transforms import apply, look_at
from hubo_sim.ground_truth.analytic import away_from_edges, box_depth
from hubo_sim.robot_source import load_robot_spec
from hubo_sim.sensors.render import Pinhole, take_picture
from hubo_sim.sim_robot import SimRobot
from hubo_sim.worlds import load_world, parse_object
from hubo_sim.worlds.scene import Scene

CAMERA = Pinhole(160, 120, np.radians(58.0), np.radians(45.0))
NEAR_M, FAR_M = 0.1, 3.5
BOX_SIZE = np.array([0.5, 0.4, 0.3])


@pytest.fixture(params=["egl", "tiny"])
def scene(request):
    with Scene(egl=request.param == "egl") as made:
        if request.param == "egl" and not made.uses_egl:
            pytest.skip("the EGL renderer does not load here")
        yield made


def add(scene, **entry):
    scene.add_object(parse_object(entry, "test"))


def camera_pose(roll_deg, distance_m, tilt_deg=0.0):
    """T_world_optical of a camera looking along +x at the origin from a distance, rolled about its axis."""
    T = np.eye(4)
    forward = Rotation.from_matrix(np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], float))
    T[:3, :3] = (Rotation.from_euler("y", tilt_deg, degrees=True) * forward).as_matrix()
    T[:3, :3] = T[:3, :3] @ Rotation.from_euler("z", roll_deg, degrees=True).as_matrix()
    T[:3, 3] = -distance_m * T[:3, 2]
    return T


@pytest.mark.parametrize("distance_m", [0.35, 1.0, 2.0, 2.9])
def test_depth_of_a_wall_is_its_distance(scene, distance_m):
    add(scene, name="wall", box={"size_m": [0.1, 20.0, 20.0]}, position_m=[0.05, 0, 0])
    for roll_deg in range(0, 360, 30):
        depth = take_picture(scene, CAMERA, camera_pose(roll_deg, distance_m), NEAR_M, FAR_M).depth
        error = np.abs(depth - distance_m)
        assert np.median(error) < 1e-3
        assert np.percentile(error, 99) < 5e-3


@pytest.mark.parametrize("roll_deg", [0, 37, 90, 145, 180, 222, 270, 301])
@pytest.mark.parametrize("tilt_deg", [-60, 0, 25, 90])
def test_depth_of_a_turned_box_is_analytic(scene, roll_deg, tilt_deg):
    add(scene, name="box", box={"size_m": BOX_SIZE.tolist()}, rpy_deg=[20, 35, 50])
    T_box = np.eye(4)
    T_box[:3, :3] = Rotation.from_euler("xyz", [20, 35, 50], degrees=True).as_matrix()
    T_camera = camera_pose(roll_deg, 0.9, tilt_deg)
    truth = box_depth(CAMERA, T_camera, T_box, BOX_SIZE)
    depth = take_picture(scene, CAMERA, T_camera, NEAR_M, FAR_M).depth
    inside = away_from_edges(truth)
    assert inside.sum() > 200
    error = np.abs(depth[inside] - truth[inside])
    assert np.median(error) < 1e-3
    assert np.percentile(error, 99) < 5e-3


def test_silhouette_agrees_with_truth_to_a_pixel(scene):
    add(scene, name="box", box={"size_m": BOX_SIZE.tolist()})
    T_camera = camera_pose(15, 0.8)
    truth = np.isfinite(box_depth(CAMERA, T_camera, np.eye(4), BOX_SIZE))
    seen = np.isfinite(take_picture(scene, CAMERA, T_camera, NEAR_M, FAR_M).depth)
    rim = 2.0 * (np.abs(np.diff(truth, axis=0)).sum() + np.abs(np.diff(truth, axis=1)).sum())
    assert (truth != seen).sum() <= 0.25 * rim
    rows, columns = np.nonzero(truth)
    seen_rows, seen_columns = np.nonzero(seen)
    assert abs(rows.mean() - seen_rows.mean()) < 0.15, "half-pixel shift in v"
    assert abs(columns.mean() - seen_columns.mean()) < 0.15, "half-pixel shift in u"


def test_points_land_on_the_surface_in_world_coordinates(scene):
    add(scene, name="floor", box={"size_m": [20, 20, 0.1]}, position_m=[0, 0, -0.05])
    T = camera_pose(33, 1.2, 50)
    T[2, 3] += 0.5
    depth = take_picture(scene, CAMERA, T, NEAR_M, FAR_M).depth
    points = apply(T, CAMERA.rays() * depth[..., None])[np.isfinite(depth)]
    assert len(points) > 1000
    assert np.percentile(np.abs(points[:, 2]), 99) < 3e-3


def test_nothing_seen_is_nan(scene):
    add(scene, name="ball", sphere={"radius_m": 0.05}, position_m=[-5, 0, 0])
    assert np.isnan(take_picture(scene, CAMERA, camera_pose(0, 1.0), NEAR_M, FAR_M).depth).all()


def test_both_renderers_see_the_same_geometry():
    pictures = []
    for egl in (True, False):
        with Scene(egl=egl) as scene:
            if egl and not scene.uses_egl:
                pytest.skip("the EGL renderer does not load here")
            add(scene, name="floor", box={"size_m": [6, 6, 0.1]}, position_m=[0, 0, -0.4])
            add(scene, name="box", box={"size_m": BOX_SIZE.tolist()}, rpy_deg=[20, 35, 50])
            add(
                scene,
                name="duck",
                mesh={"file": "pybullet_data:duck.obj", "scale": 0.2},
                position_m=[0.2, 0.5, 0],
            )
            pictures.append(take_picture(scene, CAMERA, camera_pose(20, 1.2, 20), NEAR_M, FAR_M).depth)
    both = away_from_edges(pictures[0]) & away_from_edges(pictures[1])
    assert both.mean() > 0.3
    assert np.percentile(np.abs(pictures[0] - pictures[1])[both], 99) < 3e-3


def test_cameras_larger_than_the_renderers_window_are_as_exact(scene):
    """The EGL plugin's window has 1024 x 768 pixels: larger pictures are put together from parts."""
    large = Pinhole(1300, 900, np.radians(58.0), np.radians(45.0))
    add(scene, name="box", box={"size_m": BOX_SIZE.tolist()}, rpy_deg=[20, 35, 50])
    T_box = np.eye(4)
    T_box[:3, :3] = Rotation.from_euler("xyz", [20, 35, 50], degrees=True).as_matrix()
    T_camera = camera_pose(15, 0.6)
    truth = box_depth(large, T_camera, T_box, BOX_SIZE)
    depth = take_picture(scene, large, T_camera, NEAR_M, FAR_M).depth
    inside = away_from_edges(truth)
    assert np.percentile(np.abs(depth[inside] - truth[inside]), 99) < 1e-3
    assert (np.isfinite(truth) != np.isfinite(depth)).mean() < 2e-3


@pytest.mark.parametrize("name", ["plain", "textured"])
def test_pictures_without_shadows_have_the_same_depth_and_true_colours(name):
    with Scene() as scene:
        if not scene.uses_egl:
            pytest.skip("the EGL renderer does not load here")
        if name == "plain":
            add(scene, name="box", box={"size_m": BOX_SIZE.tolist()}, color=[0.8, 0.2, 0.1])
        else:
            add(scene, name="duck", mesh={"file": "pybullet_data:duck.obj", "scale": 0.2})
        assert scene.has_textures == (name == "textured")
        pose = camera_pose(0, 0.9, 20)
        dark, light = (take_picture(scene, CAMERA, pose, NEAR_M, FAR_M, shadows=s) for s in (True, False))
        assert np.array_equal(dark.depth, light.depth, equal_nan=True)
        seen = np.isfinite(dark.depth)
        colours = [p.rgb[seen].astype(float) / p.rgb[seen].sum(axis=1, keepdims=True) for p in (dark, light)]
        assert np.abs(colours[0] - colours[1]).max() < 0.05
        scene.remove_object(next(iter(scene.bodies)))
        assert not scene.has_textures


def test_both_renderers_see_the_same_office_and_robot():
    world, spec = load_world("office"), load_robot_spec("hubo")
    pictures = []
    for egl in (True, False):
        with Scene(egl=egl) as scene:
            if egl and not scene.uses_egl:
                pytest.skip("the EGL renderer does not load here")
            scene.load_world(world)
            robot = SimRobot(scene, spec, world.robot.base_pose(spec.base_height_m))
            robot.set_positions(spec.start_positions())
            pose = look_at([1.4, -1.3, 1.6], [0.0, 0.0, 1.0])
            pictures.append(take_picture(scene, CAMERA, pose, NEAR_M, FAR_M, with_bodies=True))
    egl, tiny = pictures
    both = away_from_edges(egl.depth, 0.02) & away_from_edges(tiny.depth, 0.02)
    assert both.mean() > 0.2
    assert np.percentile(np.abs(egl.depth - tiny.depth)[both], 99) < 3e-3
    assert (egl.body != tiny.body).mean() < 0.01


def test_missing_egl_is_told_in_one_line_and_tinyrenderer_draws(monkeypatch, caplog):
    real = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "eglRenderer" else real(name)
    )
    with Scene() as scene:
        assert not scene.uses_egl
        add(scene, name="wall", box={"size_m": [0.1, 20.0, 20.0]}, position_m=[0.05, 0, 0])
        depth = take_picture(scene, CAMERA, camera_pose(0, 1.0), NEAR_M, FAR_M).depth
    assert np.nanmedian(depth) == pytest.approx(1.0, abs=1e-3)
    (line,) = [record.getMessage() for record in caplog.records]
    assert "TinyRenderer" in line and "\n" not in line
