"""Which rays come back: the counting model against a plain one, and what it does to the gain of views."""

import math

import numpy as np
import pytest

from fv_exploration import (
    Evaluator,
    InputError,
    MapConfig,
    OccupancyMap,
    PinholeCamera,
    ReturnChance,
    view_gain,
)

LOW, HIGH = np.array([-1.0, -1.0, -1.0]), np.array([1.0, 1.0, 1.0])
CELL_M = 0.25
CAMERA = PinholeCamera(
    width=8, height=6, horizontal_fov_rad=1.0, vertical_fov_rad=0.8, min_range_m=0.3, max_range_m=2.0
)


def turned(yaw: float, position=(0.0, 0.0, 0.0)) -> np.ndarray:
    """(4, 4) camera that looks along +x, turned about z."""
    T = np.eye(4)
    c, s = math.cos(yaw), math.sin(yaw)
    T[:3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    T[:3, 3] = position
    return T


class PlainCounts:
    """The counting model in a dictionary, cells found by small steps along the ray."""

    def __init__(self) -> None:
        self.counts: dict[tuple, list[int]] = {}
        self.first = [0.25 * 48, 0.25 * 48 * 4.0]  # a quarter of a scan that came back from half the range

    def reflects(self, cell) -> float:
        hits, passes = self.counts.get(cell, (0, 0))
        prior = self.first[0] / sum(self.first)
        return (hits + 0.02 * prior) / (hits + passes + 0.02)

    def cells(self, origin, direction, begin, end) -> list[tuple[tuple, float]]:
        """Cells in order, each with the length at which the ray leaves it."""
        lengths = np.arange(begin, end, 1e-4)
        keys = np.floor((origin + lengths[:, None] * direction) / CELL_M).astype(int)
        last = np.append(np.nonzero((np.diff(keys, axis=0) != 0).any(axis=1))[0], len(keys) - 1)
        return [(tuple(keys[i]), lengths[i]) for i in last]

    def note(self, T, ranges) -> None:
        for ray, length in zip(CAMERA.rays() @ T[:3, :3].T, ranges, strict=True):
            if np.isnan(length):
                met = self.cells(T[:3, 3], ray, CAMERA.min_range_m, CAMERA.max_range_m)
            else:
                met = self.cells(T[:3, 3], ray, 0.0, length)
            for i, (cell, _) in enumerate(met):
                if np.isnan(length) and self.reflects(cell) > 0.5:
                    break  # a surface: what lies behind was not looked at
                hit = not np.isnan(length) and i == len(met) - 1
                if cell not in self.counts:
                    self.first[0 if hit else 1] += 1
                self.counts.setdefault(cell, [0, 0])[0 if hit else 1] += 1

    def chance(self, T, ray) -> float:
        going, came = 1.0, 0.0
        for cell, leaves in self.cells(T[:3, 3], T[:3, :3] @ ray, 0.0, CAMERA.max_range_m):
            back = going * self.reflects(cell)
            came += back if leaves > CAMERA.min_range_m else 0.0
            going -= back
            if going < 0.01:
                break
        return came


def test_chances_are_those_of_a_plain_count():
    returns, plain = ReturnChance(LOW, HIGH, CELL_M, CAMERA), PlainCounts()
    random = np.random.default_rng(2)
    for k in range(4):
        # a scan that came back from a wall at x = 1.3 on one side, and not at all on the other
        T = turned(0.05 + 0.02 * k, (0.011 * k + 0.013, 0.017, 0.019))
        lengths = (1.3 - T[0, 3]) / (CAMERA.rays() @ T[:3, :3].T)[:, 0]
        lengths[CAMERA.rays()[:, 0] > 0] = np.nan
        points = CAMERA.rays() * lengths[:, None]
        returns.note(T, random.permutation(points))
        plain.note(T, lengths)
    poses = np.array([turned(yaw, (0.01, 0.02, 0.03)) for yaw in (0.0, 0.1, 0.4, 2.0)])
    chances, _ = returns.outlook(poses)
    expected = np.array([[plain.chance(T, ray) for ray in CAMERA.rays()] for T in poses])
    assert returns.prior == pytest.approx(plain.first[0] / sum(plain.first), rel=0.02)
    assert np.median(np.abs(chances - expected)) < 1e-3
    assert np.mean(np.abs(chances - expected) < 0.02) > 0.97, "a step may miss a corner that a ray cuts off"


def test_a_ray_into_the_open_is_expected_to_show_nothing_and_a_wall_to_come_back():
    returns = ReturnChance(LOW, HIGH, CELL_M, CAMERA)
    ahead, back = turned(0.0), turned(math.pi)
    before = returns.outlook(np.array([ahead]))[0]
    for _ in range(3):
        returns.note(ahead, np.full((5, 3), np.nan))
        returns.note(back, CAMERA.rays() * 1.2)
    (open_rays, wall), (_, reach) = returns.outlook(np.array([ahead, back]))
    assert (open_rays < 0.25 * before[0]).all()
    assert np.median(wall) > 0.95
    assert (wall > 0.5).all(), "where the sphere of points cuts a cell, some rays pass"
    assert (reach > 1.0).all()
    assert np.median(reach) < 1.2 + 2.5 * CELL_M, "nothing is expected from behind it"


def test_a_stride_follows_one_ray_of_each_block():
    returns = ReturnChance(LOW, HIGH, CELL_M, CAMERA)
    for k in range(3):
        returns.note(turned(0.2 * k), CAMERA.rays()[: 30 - 5 * k] * 1.1)
    poses = np.array([turned(yaw) for yaw in (0.0, 0.5, 3.0)])
    every, some = returns.outlook(poses)[0], returns.outlook(poses, stride=2)[0]
    blocks = some.reshape(3, 3, 2, 4, 2)
    assert (blocks == blocks[:, :, :1, :, :1]).all()
    assert np.abs(every.mean(axis=1) - some.mean(axis=1)).max() < 0.1
    with pytest.raises(InputError, match="stride"):
        returns.outlook(poses, stride=0)


def test_rays_that_the_robot_hid_teach_nothing():
    returns = ReturnChance(LOW, HIGH, CELL_M, CAMERA)
    poses = np.array([turned(0.0)])
    before = returns.outlook(poses)
    hidden = np.ones(48, dtype=bool)
    returns.note(poses[0], np.full((1, 3), np.nan), hidden)
    for old, new in zip(before, returns.outlook(poses), strict=True):
        assert np.array_equal(old, new)
    with pytest.raises(InputError, match="hidden"):
        returns.note(poses[0], np.zeros((0, 3)), hidden[:5])


def test_an_open_ray_says_nothing_of_what_lies_behind_a_surface():
    returns = ReturnChance(LOW, HIGH, CELL_M, CAMERA)
    pose = turned(0.0)
    for _ in range(3):
        returns.note(pose, CAMERA.rays() * 1.0)
    behind = np.array([turned(0.0, (1.3, 0.0, 0.0))])
    before = returns.outlook(behind)[0]
    returns.note(pose, np.zeros((0, 3)))  # such as a mirror, or a scan that was lost
    assert np.allclose(before, returns.outlook(behind)[0], atol=1e-4)


@pytest.mark.parametrize(
    "bounds, cell_m",
    [((HIGH, LOW), 0.1), ((LOW, HIGH), 0.0), ((LOW, np.full(3, np.nan)), 0.1), ((LOW, HIGH), 1e-4)],
)
def test_a_grid_that_cannot_be_is_refused(bounds, cell_m):
    with pytest.raises(InputError):
        ReturnChance(*bounds, cell_m, CAMERA)


def free_corner_map() -> tuple[OccupancyMap, Evaluator]:
    grid = OccupancyMap(MapConfig(resolution_m=0.1, bounds_min=tuple(LOW), bounds_max=tuple(HIGH)))
    grid.mark_free(np.zeros((1, 3)))
    evaluator = Evaluator(grid)
    evaluator.update()
    return grid, evaluator


def test_gains_count_with_the_chance_of_their_rays():
    grid, evaluator = free_corner_map()
    poses = np.array([turned(0.3), turned(-1.0, (0.2, 0.1, 0.0))])

    def unknown(**outlook):
        return view_gain(grid, evaluator, poses, CAMERA, **outlook).unknown_volume_m3

    ones = np.ones((2, 48))
    everything = unknown()
    assert np.array_equal(unknown(ray_chances=ones), everything)
    assert np.allclose(unknown(ray_chances=0.5 * ones), 0.5 * everything)
    assert np.array_equal(unknown(ray_chances=0 * ones), [0.0, 0.0])
    assert np.array_equal(unknown(ray_reaches_m=9.0 * ones), everything)
    near = unknown(ray_reaches_m=0.6 * ones)
    assert ((near > 0) & (near < 0.5 * everything)).all()
    half = ones.copy()
    half[:, ::2] = 0.0
    half[1] = 1.0
    masked = unknown(ray_chances=half)
    assert 0 < masked[0] < everything[0]
    assert masked[1] == everything[1]


def test_a_voxel_counts_with_the_best_of_the_rays_that_meet_it():
    grid, evaluator = free_corner_map()
    pose = np.array([turned(0.0)])
    sure = np.zeros((1, 48))
    sure[0, :8] = 1.0
    likely = np.where(sure > 0, 1.0, 0.25)
    rest = np.where(sure > 0, 0.0, 0.25)

    def unknown(chances):
        return view_gain(grid, evaluator, pose, CAMERA, ray_chances=chances).unknown_volume_m3[0]

    assert unknown(sure) < unknown(likely) < unknown(sure) + unknown(rest)


def test_an_outlook_of_the_wrong_size_is_refused():
    grid, evaluator = free_corner_map()
    for wrong in (np.ones((1, 47)), np.zeros((0, 48))):
        with pytest.raises(InputError):
            view_gain(grid, evaluator, np.array([turned(0.0)]), CAMERA, ray_chances=wrong)
