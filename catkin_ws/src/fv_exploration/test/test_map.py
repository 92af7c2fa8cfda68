"""The map's Python face: files, payloads, filters, bad input."""

import math

import numpy as np
import pytest

from fv_exploration import (
    EvaluationConfig,
    Evaluator,
    FilterConfig,
    InputError,
    MapConfig,
    MapFileError,
    OccupancyMap,
    PinholeCamera,
    ScanConfig,
    filter_cloud,
    read_utility_tree,
    view_gain,
    write_color_tree,
    write_utility_tree,
)
from fv_exploration.reference import ReferenceMap

R = 0.1


def cube_map(**options):
    """A bounded map with three scans in it."""
    grid = OccupancyMap(MapConfig(resolution_m=R, bounds_min=(-2, -2, -2), bounds_max=(2, 2, 2), **options))
    rng = np.random.default_rng(1)
    for k in range(3):
        grid.insert_scan(rng.normal(size=(200, 3)) * 0.8, moved(0.2 * k))
    return grid


def moved(x):
    T = np.eye(4)
    T[0, 3] = x
    return T


def test_python_and_octomap_agree_to_the_last_voxel():
    rng = np.random.default_rng(3)
    config = MapConfig(resolution_m=0.05)
    grid, reference = OccupancyMap(config), ReferenceMap(config)
    for k in range(4):
        points = rng.normal(size=(500, 3)).astype(np.float32)
        grid.insert_scan(points, np.eye(4), ScanConfig(max_range_m=1.5))
        reference.insert(points, np.zeros(3), 1.5)
        assert reference.differing(grid) == 0, k


@pytest.mark.parametrize("ending", ["ot", "bt"])
def test_a_map_survives_its_file(tmp_path, ending):
    grid = cube_map()
    path = str(tmp_path / f"map.{ending}")
    (grid.write_ot if ending == "ot" else grid.write_bt)(path)
    for config in (None, grid.config):
        again = OccupancyMap.read(path, config)
        for kind in ("free", "occupied"):
            assert {*map(tuple, again.voxels(kind))} == {*map(tuple, grid.voxels(kind))}
    if ending == "ot":
        assert again.full_data() == grid.full_data()
    assert again.binary_data() == grid.binary_data()


@pytest.mark.parametrize("ending", ["ot", "bt"])
def test_damaged_map_files_are_refused(tmp_path, ending):
    grid = cube_map()
    path = tmp_path / f"map.{ending}"
    (grid.write_ot if ending == "ot" else grid.write_bt)(str(path))
    whole = path.read_bytes()
    damaged = [whole[:-1], whole[: len(whole) // 2], whole + b"more", b"", b"P5 640 480", b"\xff" * 300]
    for data in damaged:
        path.write_bytes(data)
        with pytest.raises(MapFileError, match=path.name):
            OccupancyMap.read(str(path))
    with pytest.raises(MapFileError, match="cannot be opened"):
        OccupancyMap.read(str(tmp_path / f"none.{ending}"))
    with pytest.raises(MapFileError, match=r"\.bt, \.ot"):
        other = tmp_path / "map.pcd"
        other.write_bytes(whole)
        OccupancyMap.read(str(other))


def test_a_resolution_that_is_not_the_files_is_named(tmp_path):
    path = str(tmp_path / "map.ot")
    cube_map().write_ot(path)
    with pytest.raises(InputError, match=r"resolution_m is 0.2; valid: 0.1"):
        OccupancyMap.read(path, MapConfig(resolution_m=0.2))


def test_files_that_cannot_be_written_are_named(tmp_path):
    with pytest.raises(MapFileError, match="cannot be written"):
        cube_map().write_ot(str(tmp_path / "no folder" / "map.ot"))


def test_a_snapshot_is_another_map():
    grid = cube_map()
    copy = grid.snapshot()
    before = copy.counts()
    grid.mark_free(grid.voxels("occupied"))
    assert grid.counts()["occupied"] == 0
    assert copy.counts() == before
    assert (copy.sequence, grid.sequence) == (3, 4)


def test_shares_and_counts_are_those_of_the_bounds():
    grid = cube_map()
    counts = grid.counts()
    assert sum(counts.values()) == 40**3
    assert grid.volume_m3() == pytest.approx(64.0)
    assert grid.known_share() == pytest.approx((counts["free"] + counts["occupied"]) / 40**3)
    for kind, value in (("free", 0), ("occupied", 1), ("unknown", -1)):
        points = grid.voxels(kind)
        assert len(points) == counts[kind]
        assert np.all(grid.classify(points) == value)
    assert np.all(grid.classify([[3.0, 0, 0], [math.nan, 0, 0], [0, 0, -2.01]]) == -1)


def ot_file(path, kind, payload, nodes):
    header = f"# Octomap OcTree file\nid {kind}\nsize {nodes}\nres 0.1\ndata\n"
    path.write_bytes(header.encode() + payload)
    return str(path)


def chain(depth, data):
    """Payload of a tree that has one node on each level down to a depth."""
    return (data + b"\x01") * depth + data + b"\x00"


def test_a_leaf_near_the_root_is_filled_or_refused_but_never_walked_voxel_by_voxel(tmp_path):
    value = np.float32(1.5).tobytes()
    root = ot_file(tmp_path / "root.ot", "OcTree", chain(0, value), 1)  # one leaf of 65536^3 voxels
    with pytest.raises(InputError, match="volume in voxels is"):
        OccupancyMap.read(root)
    bounded = MapConfig(resolution_m=R, bounds_min=(-1, -1, -1), bounds_max=(1, 1.2, 0.9))
    assert OccupancyMap.read(root, bounded).known_share() == 1.0
    grid = OccupancyMap.read(ot_file(tmp_path / "large.ot", "OcTree", chain(8, value), 9))
    assert grid.counts()["occupied"] == 256**3
    assert len(grid.full_data()) == 9 * 5


def test_a_map_read_into_bounds_and_other_clamps_is_the_map_cut(tmp_path):
    grid = cube_map()
    path = str(tmp_path / "map.ot")
    grid.write_ot(path)
    bounds = {"bounds_min": (-0.7, -1.1, -0.4), "bounds_max": (0.9, 0.6, 1.3)}
    cut = OccupancyMap.read(path, MapConfig(resolution_m=R, clamp_min=0.45, clamp_max=0.6, **bounds))
    assert np.all(grid.classify(cut.voxels("unknown")) == -1)
    for kind, value in (("free", 0), ("occupied", 1)):
        assert np.all(grid.classify(cut.voxels(kind)) == value)
        assert len(cut.voxels(kind)) == cut.counts()[kind] > 20
    again = str(tmp_path / "again.ot")
    cut.write_ot(again)
    assert OccupancyMap.read(again, cut.config).full_data() == cut.full_data()  # as pruned as can be


def test_nodes_without_occupancy_and_utility_beyond_memory_are_refused(tmp_path):
    damaged = ot_file(tmp_path / "nan.ot", "OcTree", chain(16, np.float32(math.nan).tobytes()), 17)
    with pytest.raises(MapFileError, match=r"nan.ot: .*log odds is nan"):
        OccupancyMap.read(damaged)
    data = np.float32(0).tobytes() + np.float64(1).tobytes() + np.array([1, 0, 0], np.float32).tobytes()
    huge = ot_file(tmp_path / "huge.ot", "UtilityOcTree", chain(6, data), 7)
    with pytest.raises(MapFileError, match=r"huge.ot: has utility in 1.07\d*e\+09 voxels; valid: at most"):
        read_utility_tree(huge)
    points, _, _ = read_utility_tree(ot_file(tmp_path / "one.ot", "UtilityOcTree", chain(16, data), 17))
    assert len(points) == 1


@pytest.mark.parametrize(
    ("points", "transform", "text"),
    [
        (np.zeros((4, 2)), np.eye(4), "points_sensor"),
        (np.zeros((0, 5)), np.eye(4), "points_sensor"),
        (np.zeros((5, 0)), np.eye(4), "points_sensor"),
        (np.zeros((4, 3, 1)), np.eye(4), "points_sensor"),
        (np.zeros((4, 3)), np.eye(3), "transforms"),
        (np.zeros((4, 3)), np.diag([1, 1, 2.0, 1]), "T_map_sensor"),
        (np.zeros((4, 3)), np.full((4, 4), math.nan), "T_map_sensor"),
    ],
)
def test_scans_of_the_wrong_shape_leave_the_map_alone(points, transform, text):
    grid = cube_map()
    before = grid.full_data()
    with pytest.raises(InputError, match=text):
        grid.insert_scan(points, transform)
    assert grid.full_data() == before
    assert grid.sequence == 3


@pytest.mark.parametrize(
    "values",
    [
        {"resolution_m": 0.0},
        {"prob_hit": 0.4},
        {"prob_miss": 0.6},
        {"clamp_min": 0.98},
        {"dense_limit_mb": math.inf},
        {"bounds_min": (0, 0, 0), "bounds_max": (1, 1, -1)},
        {"bounds_min": (0, 0, 0)},
        {"bounds_min": (0, 0, math.nan), "bounds_max": (1, 1, 1)},
    ],
)
def test_configurations_out_of_range_are_named(values):
    with pytest.raises(InputError, match=r"valid:"):
        MapConfig(**values)


def test_the_changed_voxels_are_reported():
    grid = cube_map()
    result = grid.insert_scan(np.array([[1.5, 0.05, 0.05]]), moved(0.05))
    assert len(result.changed) == len(result.before) == len(result.after) == result.counts["changed"]
    assert np.all(grid.classify((result.changed + 0.5) * R) == result.after)


def test_utility_survives_its_file_and_pruning(tmp_path):
    grid = cube_map()
    evaluator = Evaluator(grid, EvaluationConfig())
    evaluator.update()
    utility = evaluator.utility(1.5)
    assert len(utility.points) > 50
    path = str(tmp_path / "utility.ot")
    write_utility_tree(grid, utility, path)
    points, values, directions = read_utility_tree(path)
    assert np.array_equal(points, utility.points)
    assert np.array_equal(values, utility.utility)
    assert np.array_equal(directions, utility.direction)
    with pytest.raises(MapFileError, match="UtilityOcTree"):
        OccupancyMap.read(path)
    with open(path, "r+b") as file:
        file.truncate(200)
    with pytest.raises(MapFileError, match="cut off"):
        read_utility_tree(path)


def test_the_utility_of_another_map_is_refused(tmp_path):
    grid = cube_map()
    evaluator = Evaluator(grid, EvaluationConfig())
    evaluator.update()
    utility = evaluator.utility(1.5)
    for other in (OccupancyMap(MapConfig(resolution_m=R)), smaller_map()):
        with pytest.raises(InputError, match="valid: utility of this map"):
            write_utility_tree(other, utility, str(tmp_path / "utility.ot"))
    for write in (write_utility_tree, write_color_tree):
        with pytest.raises(InputError, match=r"resolution_m of the utility is 0.1; valid: 0.2"):
            write(OccupancyMap(MapConfig(resolution_m=0.2)), utility, str(tmp_path / "utility.ot"))
    assert not list(tmp_path.iterdir())
    with pytest.raises(InputError, match="threads is -3"):
        evaluator.utility(1.5, threads=-3)


def smaller_map():
    grid = OccupancyMap(MapConfig(resolution_m=R, bounds_min=(-0.5, -0.5, -0.5), bounds_max=(0.5, 0.5, 0.5)))
    grid.insert_scan(np.array([[0.3, 0.1, 0.2]]), np.eye(4))
    return grid


def test_colours_are_a_color_octree(tmp_path):
    grid = cube_map()
    evaluator = Evaluator(grid, EvaluationConfig())
    evaluator.update()
    path = tmp_path / "colors.ot"
    write_color_tree(grid, evaluator.utility(1.0), str(path))
    assert b"id ColorOcTree\n" in path.read_bytes()[:200]


def test_filters_are_off_by_default_and_drop_what_they_should():
    rng = np.random.default_rng(0)
    blob = rng.normal(loc=(1, 0, 0), scale=0.1, size=(500, 3))
    cloud = np.concatenate([blob, [[9.0, 9, 9]], [[math.nan] * 3]])
    assert len(filter_cloud(cloud, FilterConfig())) == 501
    assert np.abs(filter_cloud(cloud, FilterConfig(outlier_neighbours=10))).max() < 5
    assert np.abs(filter_cloud(cloud, FilterConfig(isolated_radius_m=0.5))).max() < 5
    assert len(filter_cloud(cloud, FilterConfig(max_range_m=2.0))) <= 500
    thin = filter_cloud(cloud, FilterConfig(voxel_leaf_m=0.2))
    assert 5 < len(thin) < 100
    assert len(filter_cloud(np.zeros((0, 3)), FilterConfig(voxel_leaf_m=0.1, outlier_neighbours=5))) == 0
    with pytest.raises(InputError, match="voxel_leaf_m"):
        filter_cloud(cloud, FilterConfig(voxel_leaf_m=1e-6))


# -- view gain --------------------------------------------------------------------------------------------------------

CAMERA = PinholeCamera(24, 18, 1.0, 0.8, 0.25, 1.7)


def random_poses(count):
    rng = np.random.default_rng(6)
    poses = np.tile(np.eye(4), (count, 1, 1))
    for pose in poses:
        q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        pose[:3, :3] = q * np.sign(np.linalg.det(q))
        pose[:3, 3] = rng.uniform(-2.4, 2.4, 3)
    return poses


def plain_gain(grid, evaluation, pose):
    """Sample each ray densely and count each voxel once: slow, and blind to voxels that are only just grazed."""
    kinds = {}
    for name, points in (("frontier", evaluation.frontier), ("void", evaluation.void)):
        for v in np.floor(points / R).astype(int).tolist():
            kinds.setdefault(tuple(v), set()).add(name)
    seen = {}
    for ray in CAMERA.rays() @ pose[:3, :3].T:
        lengths = np.arange(0, CAMERA.max_range_m, 0.002)
        samples = pose[:3, 3] + lengths[:, None] * ray
        classes = grid.classify(samples)
        hit = np.flatnonzero(classes == 1)
        end = hit[0] if len(hit) else len(samples)
        for v, c, t in zip(np.floor(samples[:end] / R).astype(int).tolist(), classes, lengths, strict=False):
            if (
                t >= CAMERA.min_range_m
                and max(map(abs, v), default=0) <= 20
                and min(v) >= -20
                and max(v) < 20
            ):
                seen[tuple(v)] = c
    return (
        sum("void" in kinds.get(v, ()) for v in seen) * R**3,
        sum(c == -1 for c in seen.values()) * R**3,
        sum("frontier" in kinds.get(v, ()) for v in seen) * R**2,
    )


def test_gain_is_what_plain_sampling_sees():
    grid = cube_map()
    evaluator = Evaluator(grid, EvaluationConfig())
    evaluation = evaluator.update()
    poses = random_poses(12)
    gain = view_gain(grid, evaluator, poses, CAMERA)
    for k, pose in enumerate(poses):
        void, unknown, frontier = plain_gain(grid, evaluation, pose)
        assert gain.void_volume_m3[k] == pytest.approx(void, rel=0.06, abs=5 * R**3)
        assert gain.unknown_volume_m3[k] == pytest.approx(unknown, rel=0.06, abs=5 * R**3)
        assert gain.frontier_area_m2[k] == pytest.approx(frontier, rel=0.06, abs=5 * R**2)
    assert gain.unknown_volume_m3.max() > 0.1
    again = view_gain(grid, evaluator, poses[::-1], CAMERA, threads=3)
    assert np.array_equal(again.unknown_volume_m3[::-1], gain.unknown_volume_m3)


def test_gains_on_an_evaluation_that_went_along_are_those_of_a_new_one():
    grid = cube_map()
    evaluator = Evaluator(grid, EvaluationConfig())
    evaluator.update()
    poses = random_poses(12)
    for k, pose in enumerate(poses[:4]):
        grid.insert_scan(
            np.random.default_rng(k).uniform(-0.9, 0.9, (200, 3)), pose, ScanConfig(max_range_m=2.0)
        )
        evaluator.update()
        copy = grid.snapshot()
        anew = Evaluator(copy, EvaluationConfig())
        anew.update()
        along, fresh = view_gain(grid, evaluator, poses, CAMERA), view_gain(copy, anew, poses, CAMERA)
        for name in ("void_volume_m3", "unknown_volume_m3", "frontier_area_m2", "occupied_share"):
            assert np.array_equal(getattr(along, name), getattr(fresh, name)), name


def test_an_occupied_wall_hides_what_is_behind_it():
    grid = OccupancyMap(MapConfig(resolution_m=R, bounds_min=(0, -2, -2), bounds_max=(3, 2, 2)))
    y, z = np.meshgrid(np.arange(-1.95, 2, 0.05), np.arange(-1.95, 2, 0.05))
    wall = np.stack([np.full(y.size, 1.05), y.ravel(), z.ravel()], axis=1)
    grid.insert_scan(wall, moved(0.0))
    evaluator = Evaluator(grid, EvaluationConfig())
    evaluator.update()
    pose = np.eye(4)
    pose[:3, :3] = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]
    pose[0, 3] = 0.35
    blocked = view_gain(grid, evaluator, pose, CAMERA)
    pose[0, 3] = 1.25
    behind = view_gain(grid, evaluator, pose, CAMERA)
    assert blocked.occupied_share[0] == 1.0
    assert blocked.unknown_volume_m3[0] < 0.01
    assert behind.unknown_volume_m3[0] > 0.3


def test_gain_of_bad_poses_names_the_view():
    grid = cube_map()
    evaluator = Evaluator(grid, EvaluationConfig())
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[2, 0, 0] = 2
    with pytest.raises(InputError, match=r"T_map_cameras\[2\]"):
        view_gain(grid, evaluator, poses, CAMERA)
    with pytest.raises(InputError, match="another map"):
        view_gain(cube_map(), evaluator, poses, CAMERA)
    assert len(view_gain(grid, evaluator, np.zeros((0, 4, 4)), CAMERA).void_volume_m3) == 0


def test_an_empty_map_is_exported_as_an_empty_colour_tree(tmp_path):
    grid = OccupancyMap(MapConfig(resolution_m=0.1))
    evaluator = Evaluator(grid, EvaluationConfig())
    evaluator.update()
    path = tmp_path / "empty.ot"
    write_color_tree(grid, evaluator.utility(1.0), str(path))
    assert b"id ColorOcTree" in path.read_bytes()
    assert b"size 0" in path.read_bytes()
