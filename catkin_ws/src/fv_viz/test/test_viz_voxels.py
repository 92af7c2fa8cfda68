"""Voxel faces against a slow oracle that looks at every voxel and every neighbour."""

import numpy as np
import pytest

from fv_viz.drawing.voxels import DIRECTIONS, HIDDEN, VoxelBlocks

RESOLUTION = 0.05


def centers_of(cells):
    """Centres (N, 3) x y z of lattice cells (N, 3) x y z."""
    return ((np.asarray(cells) + 0.5) * RESOLUTION).astype(np.float32)


def all_quads(blocks):
    return [blocks.faces(name) for name in blocks.blocks()]


def unit_faces(blocks):
    """The quads cut into faces of single voxels: a set of (middle of the face in half cells, value)."""
    found = []
    for quads in all_quads(blocks):
        for corners, value in zip(quads.corners / RESOLUTION, quads.values, strict=True):
            low, high = np.rint(corners.min(axis=0)), np.rint(corners.max(axis=0))
            ranges = [
                np.arange(a, b) * 2 + 1 if b > a else np.array([2 * a])
                for a, b in zip(low, high, strict=True)
            ]
            found += [
                (int(x), int(y), int(z), int(value)) for x in ranges[0] for y in ranges[1] for z in ranges[2]
            ]
    return sorted(found)


def oracle(cells, nested):
    found = []
    for (x, y, z), value in cells.items():
        for axis in range(3):
            for sign in (-1, 1):
                step = np.zeros(3, int)
                step[axis] = sign
                other = cells.get((x + step[0], y + step[1], z + step[2]), 0)
                if other < value if nested else other == 0:
                    found.append((*(2 * np.array([x, y, z]) + 1 + step), value))
    return sorted(tuple(int(k) for k in face) for face in found)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("nested", [False, True])
@pytest.mark.parametrize("upright", [False, True])
def test_faces_are_those_of_the_oracle(seed, nested, upright):
    rng = np.random.default_rng(seed)
    cells = {
        tuple(c): int(v) for c, v in zip(rng.integers(-9, 9, (600, 3)), rng.integers(1, 4, 600), strict=True)
    }
    blocks = VoxelBlocks(RESOLUTION, block=8, nested=nested, upright=upright)
    blocks.update(centers_of(list(cells)), np.array(list(cells.values()), np.uint8))
    assert unit_faces(blocks) == oracle(cells, nested)


@pytest.mark.parametrize("seed", range(4))
def test_blocks_not_reported_as_changed_keep_their_faces(seed):
    rng = np.random.default_rng(seed)
    blocks = VoxelBlocks(RESOLUTION, block=8)
    held = {}
    cells = rng.integers(-10, 10, (500, 3))
    for _ in range(4):
        cells = np.concatenate([cells[20:], rng.integers(-12, 14, (15, 3))])
        for name in blocks.update(centers_of(cells)):
            held[name] = blocks.faces(name).corners
        for name in blocks.blocks():
            np.testing.assert_array_equal(held[name], blocks.faces(name).corners)
        shown = {name for name, corners in held.items() if len(corners)}
        assert shown <= set(blocks.blocks())


@pytest.mark.parametrize("seed", range(3))
def test_an_array_of_voxels_is_as_good_as_a_list(seed):
    rng = np.random.default_rng(seed)
    arrays = [rng.integers(0, 3, rng.integers(1, 30, 3)).astype(np.uint8) for _ in range(3)]
    dense, sparse = VoxelBlocks(RESOLUTION, block=8), VoxelBlocks(RESOLUTION, block=8)
    for values in [*arrays, np.zeros((2, 3, 4), np.uint8)]:
        first = rng.integers(-20, 20, 3)
        cells = np.argwhere(values)
        changed = sparse.update(centers_of((cells + first)[:, ::-1]), values[tuple(cells.T)])
        assert dense.update_dense(first, values) == changed
        assert unit_faces(dense) == unit_faces(sparse)


def test_one_new_voxel_changes_few_blocks():
    grid = np.argwhere(np.ones((40, 40, 40)))
    blocks = VoxelBlocks(RESOLUTION, block=10)
    assert len(blocks.update(centers_of(grid))) == 64
    assert blocks.update(centers_of(grid)) == []
    assert len(blocks.update(centers_of(np.vstack([grid, [[5, 5, 40]]])))) <= 2


@pytest.mark.parametrize(("upright", "count"), [(True, 6), (False, 4 * 20 + 2)])
def test_a_full_cube_is_a_few_large_quads_of_the_right_area(upright, count):
    grid = np.argwhere(np.ones((20, 20, 20)))
    blocks = VoxelBlocks(RESOLUTION, block=20, upright=upright)
    blocks.update(centers_of(grid))
    quads = all_quads(blocks)[0]
    sides = quads.corners[:, 1:3] - quads.corners[:, 0:2]
    area = np.prod(np.linalg.norm(sides, axis=2), axis=1).sum()
    assert len(quads) == count
    assert quads.sizes.prod(axis=1).sum() == 6 * 400
    assert area == pytest.approx(6 * 1.0)


def test_no_face_spans_two_heights_so_that_height_colours_hold():
    grid = np.argwhere(np.ones((6, 5, 4)))
    blocks = VoxelBlocks(RESOLUTION)
    blocks.update(centers_of(grid))
    quads = all_quads(blocks)[0]
    assert np.ptp(quads.corners[:, :, 2], axis=1).max() <= RESOLUTION * 1.001
    assert set(quads.directions) == set(range(len(DIRECTIONS)))


def test_nan_rows_are_left_out_and_empty_is_empty():
    blocks = VoxelBlocks(RESOLUTION)
    assert blocks.update(np.empty((0, 3))) == []
    assert blocks.blocks() == []
    blocks.update(
        np.array([[np.nan, 0, 0], [0.025, 0.025, np.inf], [0.025, 0.025, 0.025]], np.float32), np.ones(3)
    )
    assert sum(len(q) for q in all_quads(blocks)) == 6
    assert blocks.update(np.empty((0, 3))) == [(0, 0, 0)]
    assert blocks.blocks() == []


def test_hidden_voxels_cover_faces_and_are_not_drawn():
    cells = np.argwhere(np.ones((3, 1, 1)))
    blocks = VoxelBlocks(RESOLUTION)
    blocks.update(centers_of(cells), np.array([1, HIDDEN, HIDDEN], np.uint8))
    assert len(unit_faces(blocks)) == 5
    blocks.update(centers_of(cells), np.full(3, HIDDEN, np.uint8))
    assert blocks.blocks() == []


def test_misuse_is_named():
    with pytest.raises(ValueError, match="resolution"):
        VoxelBlocks(0.0)
    with pytest.raises(ValueError, match="cells are more than"):
        VoxelBlocks(0.001).update(np.array([[0, 0, 0], [10, 10, 10]]))
