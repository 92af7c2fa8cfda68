"""PointCloud2 as others lay it out, against plain unpacking of one point after the other."""

import itertools
import struct
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recorded import cloud

from fv_common.cloud_layout import KINDS, cloud_points
from fv_common.errors import MessageError
from fv_exploration.returns import SENSIBLE_M

POINTS = np.array([[1.0, -2.0, 3.5], [np.nan] * 3, [0.25, 0.0, -1.0], [7, 8, 9.5]])
LETTERS = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "f4": "f", "f8": "d"}


def read(message):
    warnings = []
    return cloud_points(message, warnings.append, SENSIBLE_M), warnings


def unpacked(message):
    """One point after the other."""
    order = ">" if message.is_bigendian else "<"
    by_name = {field.name: field for field in message.fields}
    out = []
    for row, column in itertools.product(range(message.height), range(message.width)):
        at = row * message.row_step + column * message.point_step
        out.append(
            [
                struct.unpack_from(
                    order + LETTERS[KINDS[by_name[n].datatype]], bytes(message.data), at + by_name[n].offset
                )[0]
                for n in "xyz"
            ]
        )
    return np.array(out).reshape(-1, 3)


@st.composite
def messages(draw):
    """Any layout that holds together; the numbers are ordinary ones in the order that is said."""
    width, height = draw(st.integers(0, 5)), draw(st.integers(0, 4))
    big, kinds = draw(st.booleans()), [draw(st.sampled_from(sorted(KINDS))) for _ in range(3)]
    fields, at = [], 0
    for name, kind in draw(st.permutations(list(zip("xyz", kinds, strict=True)))):
        at += draw(st.integers(0, 5))
        fields.append(SimpleNamespace(name=name, offset=at, datatype=kind, count=draw(st.integers(0, 1))))
        at += np.dtype(KINDS[kind]).itemsize
    point_step = at + draw(st.integers(0, 9))
    row_step = point_step * width + draw(st.integers(0, 9))
    size = row_step * height
    data = bytearray(draw(st.binary(min_size=size, max_size=size)))
    numbers = itertools.cycle(draw(st.lists(st.integers(1, 100), min_size=1, max_size=20)))
    for row, column, field in itertools.product(range(height), range(width), fields):
        start = row * row_step + column * point_step + field.offset
        code = (">" if big else "<") + LETTERS[KINDS[field.datatype]]
        struct.pack_into(code, data, start, next(numbers))
    return SimpleNamespace(
        width=width, height=height, fields=fields, is_bigendian=big, point_step=point_step, row_step=row_step,
        data=draw(st.sampled_from([bytes, bytearray, list, lambda d: np.frombuffer(d, np.uint8)]))(bytes(data)),
        is_dense=draw(st.booleans()),
    )  # fmt: skip


@settings(max_examples=100, deadline=None)
@given(messages())
def test_every_layout_is_read_as_point_after_point(message):
    points, _ = read(message)
    assert points.dtype in (np.float32, np.float64)
    assert np.array_equal(points, unpacked(message))


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("kind", ["f4", "f8"])
def test_a_byte_order_that_makes_no_sense_is_not_believed(order, kind):
    random = np.random.default_rng(4)
    points = random.uniform(-3, 3, (500, 3))
    points[::7] = np.nan
    message = cloud(points, order, kind)
    right, warnings = read(message)
    assert warnings == []
    message.is_bigendian = not message.is_bigendian
    other, warnings = read(message)
    assert np.array_equal(other, right, equal_nan=True)
    assert len(warnings) == 1
    assert "is_bigendian" in warnings[0]


def test_a_byte_order_is_believed_where_the_other_one_makes_no_more_sense():
    for points in (np.zeros((9, 3)), np.full((9, 3), np.nan), np.full((9, 3), 1e30), np.full((9, 3), np.inf)):
        read_points, warnings = read(cloud(points))
        assert np.array_equal(read_points, points.astype(np.float32), equal_nan=True)
        assert warnings == []


def test_whole_numbers_and_surplus_bytes_are_told():
    points, warnings = read(cloud([[100, -200, 300]], kind="i2"))
    assert points.tolist() == [[100, -200, 300]]
    assert "metres" in warnings[0]
    message = cloud(POINTS)
    message.data = bytes(message.data) + bytes(5)
    points, warnings = read(message)
    assert np.array_equal(points, POINTS, equal_nan=True)
    assert "5 bytes after" in warnings[0]
    points, warnings = read(cloud(POINTS, height=0))
    assert points.shape == (0, 3)
    assert "not read" in warnings[0]


def _field(message, index, **members):
    vars(message.fields[index]).update(members)


@pytest.mark.parametrize(
    ("spoil", "text"),
    [
        (lambda m: _field(m, 2, name="depth"), "needs x, y and z once each"),
        (lambda m: m.fields.append(m.fields[0]), "once each"),
        (lambda m: m.fields.clear(), "once each"),
        (lambda m: _field(m, 0, count=3), "3 of datatype 7"),
        (lambda m: _field(m, 0, datatype=0), "datatype 0; valid"),
        (lambda m: _field(m, 0, datatype=8), "overlap"),
        (lambda m: _field(m, 2, offset=12), "point_step 12; valid: 16 or more"),
        (lambda m: vars(m).update(width=5), "do not fit together"),
        (lambda m: vars(m).update(height=2), "do not fit together"),
        (lambda m: vars(m).update(row_step=12), "do not fit together"),
        (lambda m: vars(m).update(width=2**32 - 1, height=2**32 - 1), "do not fit together"),
        (lambda m: vars(m).update(data=m.data[:-1]), "do not fit together"),
    ],
)
def test_clouds_whose_fields_or_sizes_do_not_fit_are_refused(spoil, text):
    message = cloud(POINTS)
    spoil(message)
    with pytest.raises(MessageError, match=text) as error:
        read(message)
    assert "\n" not in str(error.value)
