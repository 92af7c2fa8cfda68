"""Ground truth against slow and obvious answers."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hubo_sim.errors import SimError
from hubo_sim.ground_truth import ObservableSet, TrueWorld, grid_centres, octree_bytes, score_map
from hubo_sim.ground_truth.solids import BoxSolid, CylinderSolid, MeshSolid, SphereSolid
from hubo_sim.worlds import Bounds, load_world, parse_world
from hubo_sim.worlds.triangles import (
    box_triangles,
    cylinder_triangles,
    mesh_triangles,
    sphere_triangles,
    surface_points,
)

BOX = {
    "name": "box",
    "box": {"size_m": [0.6, 0.4, 0.5]},
    "position_m": [0.1, 0.2, 0.3],
    "rpy_deg": [10, 20, 30],
}


def winding_number(triangles, points):
    """(P,) how often closed triangles wind about points: van Oosterom, Strackee, IEEE TBME 1983. The oracle."""
    total = np.zeros(len(points))
    for i, point in enumerate(points):
        a, b, c = np.moveaxis(triangles - point, 1, 0)
        la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
        above = np.einsum("ni,ni->n", a, np.cross(b, c))
        below = la * lb * lc + (a * b).sum(-1) * lc + (b * c).sum(-1) * la + (c * a).sum(-1) * lb
        total[i] = np.arctan2(above, below).sum() / (2.0 * np.pi)
    return total


def world_of(*objects):
    bounds = {"min_m": [-1, -1, -1], "max_m": [1, 1, 1]}
    return parse_world({"description": "d", "bounds": bounds, "objects": list(objects)}, "w", "w")


def some_pose():
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("xyz", [0.3, -0.8, 1.2]).as_matrix()
    T[:3, 3] = [0.2, -0.1, 0.3]
    return T


SOLIDS = [
    BoxSolid("box", np.array([0.6, 0.4, 0.5]), some_pose()),
    CylinderSolid("cylinder", 0.3, 0.5, some_pose()),
    SphereSolid("sphere", 0.35, some_pose()),
    MeshSolid("mesh", box_triangles(np.array([0.6, 0.4, 0.5])), some_pose()),
]


@pytest.mark.parametrize("solid", SOLIDS, ids=lambda s: s.name)
def test_distance_agrees_with_dense_surface_points(solid):
    points = np.random.default_rng(0).uniform(-1, 1, (400, 3))
    surface = surface_points(solid.triangles, 0.01)
    brute = np.array([np.linalg.norm(surface - p, axis=1).min() for p in points])
    assert np.abs(solid.distance(points) - brute).max() < 0.012


@pytest.mark.parametrize("solid", SOLIDS, ids=lambda s: s.name)
def test_depth_inside_agrees_with_the_winding_number(solid):
    points = np.random.default_rng(1).uniform(-0.6, 0.8, (2000, 3))
    clear = solid.distance(points) > 0.03
    inside = np.abs(winding_number(solid.triangles, points)) > 0.5
    depth = solid.depth_inside(points)
    assert np.array_equal(depth[clear] > 0, inside[clear])
    assert depth[clear & inside] == pytest.approx(solid.distance(points)[clear & inside])
    assert inside.sum() > 50


@pytest.mark.parametrize(
    ("triangles", "area"),
    [
        (box_triangles(np.array([1.0, 2.0, 3.0])), 22.0),
        (cylinder_triangles(0.5, 2.0), 2 * np.pi * 0.25 + 2 * np.pi),
        (sphere_triangles(1.0), 4 * np.pi),
    ],
)
def test_primitives_have_their_area_and_are_closed(triangles, area):
    sides = triangles[:, 1:] - triangles[:, :1]
    assert np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2 == pytest.approx(
        area, rel=0.01
    )
    assert np.abs(winding_number(triangles, np.zeros((1, 3))))[0] == pytest.approx(1.0, abs=1e-6)
    assert np.abs(winding_number(triangles, np.full((1, 3), 5.0)))[0] == pytest.approx(0.0, abs=1e-6)


def test_surface_points_leave_no_gap():
    triangles = np.array([[[0, 0, 0], [1.0, 0, 0], [0.2, 0.7, 0.1]]])
    points = surface_points(triangles, 0.05)
    rng = np.random.default_rng(2)
    weights = rng.dirichlet([1, 1, 1], 500)
    samples = weights @ triangles[0]
    assert max(np.linalg.norm(points - s, axis=1).min() for s in samples) <= 0.025


def test_shelf_bins_are_outside_and_its_posts_have_no_deep_inside():
    truth = TrueWorld(load_world("shelf"))
    bin_centre = np.array([[1.0, 0.0, 1.2], [1.1, 0.29, 1.49], [0.6, 0.0, 1.0]])
    assert truth.depth_inside_solid(bin_centre) == pytest.approx(0.0)
    assert truth.distance_to_surface(bin_centre).min() > 0.03


def test_surface_and_solid_voxels_of_a_box():
    truth = TrueWorld(
        world_of({"name": "b", "box": {"size_m": [0.5, 0.5, 0.5]}, "position_m": [0.025, 0.025, 0.025]})
    )
    surface, solid = truth.surface_voxels(0.1), truth.solid_voxels(0.1)
    assert len(solid) == 5**3
    assert truth.distance_to_surface(surface).max() <= 0.1 * np.sqrt(3) / 2 + 0.025
    assert truth.depth_inside_solid(solid).min() > 0.0


def test_urdf_objects_are_where_bullet_puts_them():
    truth = TrueWorld(world_of({"name": "duck", "urdf": {"file": "pybullet_data:duck_vhacd.urdf"}}))
    bare = mesh_triangles(load_file("duck.obj"), np.full(3, 0.05))
    assert truth.solids[0].low_m == pytest.approx(bare.min(axis=(0, 1)), abs=1e-6)
    assert truth.solids[0].high_m == pytest.approx(bare.max(axis=(0, 1)), abs=1e-6)


def load_file(name):
    from hubo_sim.paths import resolve_file

    return resolve_file(f"pybullet_data:{name}", "test")


def test_grid_is_octomaps():
    centres = grid_centres(0.1, Bounds([0.0, 0.0, 0.0], [0.25, 0.1, 0.1]))
    assert centres == pytest.approx(np.array([[0.05, 0.05, 0.05], [0.15, 0.05, 0.05]]))


def test_a_perfect_map_scores_perfectly_and_faults_are_counted():
    truth = TrueWorld(world_of(BOX))
    resolution, bounds = 0.05, Bounds([-1, -1, -1], [1, 1, 1])
    surface = truth.surface_voxels(resolution, bounds)
    centres = grid_centres(resolution, bounds)
    free = centres[
        (truth.depth_inside_solid(centres) == 0) & (truth.distance_to_surface(centres) > resolution)
    ]
    good = score_map(truth, free, surface, resolution)
    assert (good["free_in_solid_share"], good["occupied_far_share"]) == (0.0, 0.0)
    deep = centres[truth.depth_inside_solid(centres) > resolution]
    far = centres[truth.distance_to_surface(centres) > 0.3]
    bad = score_map(
        truth, np.concatenate([free, deep]), np.concatenate([surface, far]), resolution, sigma_m=0.01
    )
    assert bad["free_in_solid_share"] == pytest.approx(len(deep) / (len(deep) + len(free)))
    assert bad["occupied_far_share"] == pytest.approx(len(far) / (len(far) + len(surface)))


def test_explored_share_counts_observable_voxels_only():
    truth = TrueWorld(world_of(BOX))
    mask = np.zeros((4, 4, 4), bool)
    mask[0] = True
    observable = ObservableSet(0.1, np.zeros(3, int), mask, 1, 1, True)
    known = (np.argwhere(mask)[:8] + 0.5) * 0.1
    outside = np.array([[0.35, 0.05, 0.05], [5.0, 5.0, 5.0]])
    score = score_map(truth, np.concatenate([known, outside]), np.zeros((0, 3)), 0.1, observable)
    assert score["explored_share"] == pytest.approx(0.5)
    with pytest.raises(SimError, match=r"0\.1"):
        observable.known_share(known, 0.05)


def test_empty_map_scores_zero_and_nan_is_refused():
    truth = TrueWorld(world_of(BOX))
    score = score_map(truth, np.zeros((0, 3)), np.zeros((0, 3)), 0.05)
    assert (score["free"], score["occupied"], score["free_in_solid_share"]) == (0, 0, 0.0)
    with pytest.raises(SimError, match="points_free"):
        score_map(truth, np.full((1, 3), np.nan), np.zeros((0, 3)), 0.05)


def read_octree(data):
    """Leaves of a .bt file as {key: occupied}, read node by node; and the size that its header states."""
    head, _, body = data.partition(b"data\n")
    position, leaves, nodes = 0, {}, 0

    def read(key, level):
        nonlocal position, nodes
        nodes += 1
        code = int.from_bytes(body[position : position + 2], "little")
        position += 2
        inner = []
        for child in range(8):
            child_key = tuple(2 * k + ((child >> axis) & 1) for axis, k in enumerate(key))
            kind = (code >> (2 * child)) & 3
            if kind == 3:
                inner.append(child_key)
            elif kind:
                assert level == 15
                leaves[child_key] = kind == 2
                nodes += 1
        for child_key in inner:
            read(child_key, level + 1)

    read((0, 0, 0), 0)
    assert position == len(body)
    assert int(head.split(b"size ")[1].split()[0]) == nodes
    return leaves


def test_octree_holds_each_voxel_once_and_occupied_wins():
    rng = np.random.default_rng(4)
    keys = np.unique(rng.integers(-20, 20, (300, 3)), axis=0)
    centres = (keys + 0.5) * 0.05
    occupied, free = centres[:150], centres[100:]
    leaves = read_octree(octree_bytes(occupied, free, 0.05))
    wanted = {tuple(k + 32768): i < 150 for i, k in enumerate(keys)}
    assert leaves == wanted


def test_octree_refuses_what_does_not_fit():
    with pytest.raises(ValueError, match="16 levels"):
        octree_bytes(np.array([[1e6, 0.0, 0.0]]), np.zeros((0, 3)), 0.05)
