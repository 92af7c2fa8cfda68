"""Map files: what is written comes back; what is damaged or foreign is refused in plain words."""

from __future__ import annotations

import dataclasses
import hashlib

import h5py
import numpy as np
import pytest
from conftest import urdf_text

from capability_map import CapabilityMap, CapabilityMapError, store
from capability_map.identity import urdf_hash


def test_a_map_comes_back_as_it_was_written(map_path, tmp_path):
    data = store.load(map_path)
    store.save(tmp_path / "copy.h5", data)
    again = store.load(tmp_path / "copy.h5")
    for field in dataclasses.fields(store.MapData):
        ours, theirs = getattr(data, field.name), getattr(again, field.name)
        if field.name == "shapes":
            assert ours.keys() == theirs.keys()
            assert all(np.array_equal(ours[name], theirs[name]) for name in ours)
        else:
            assert np.array_equal(ours, theirs), field.name


def test_other_tools_can_read_the_file(map_path):
    with h5py.File(map_path, "r") as file:
        assert file.attrs["robot"] == "small"
        assert file["spheres/cell"].attrs["unit"]


def test_hundreds_of_damaged_files_are_refused_in_plain_words(map_path, tmp_path):
    content = bytearray(map_path.read_bytes())
    random = np.random.default_rng(0)
    path = tmp_path / "damaged.h5"
    for i in range(400):
        damaged = bytearray(content)
        if i % 4 == 0:
            damaged = damaged[: random.integers(0, len(damaged))]
        else:
            for at in random.integers(0, len(damaged), size=1 + i % 7):
                damaged[at] ^= int(random.integers(1, 256))
        if damaged[:90] == content[:90] and damaged[512:] == content[512:]:
            continue  # only padding was hit
        path.write_bytes(damaged)
        with pytest.raises(CapabilityMapError, match=r"damaged|not a capability map"):
            store.load(path)


def test_a_wrong_content_under_a_right_checksum_is_refused(map_path, tmp_path):
    random = np.random.default_rng(1)
    with h5py.File(map_path, "r") as file:
        names = []
        file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
    for name in names:
        path = tmp_path / "changed.h5"
        path.write_bytes(map_path.read_bytes())
        with h5py.File(path, "r+") as file:
            del file[name]
            if random.integers(2):
                file.create_dataset(name, data=random.normal(size=3))
        sign(path)
        try:
            CapabilityMap.load(path)
        except CapabilityMapError as err:
            assert str(path) in str(err)


def sign(path):
    content = path.read_bytes()
    line = b"capability_map 2 sha256 " + hashlib.sha256(content[512:]).hexdigest().encode() + b"\n"
    path.write_bytes(line.ljust(512, b"\0") + content[512:])


def test_missing_files_and_foreign_files_are_named(tmp_path):
    with pytest.raises(CapabilityMapError, match=r"cannot read capability map .*nothing.h5"):
        store.load(tmp_path / "nothing.h5")
    with h5py.File(tmp_path / "foreign.h5", "w") as file:
        file["x"] = 1
    with pytest.raises(CapabilityMapError, match="not a capability map"):
        store.load(tmp_path / "foreign.h5")
    with pytest.raises(CapabilityMapError, match="cannot read"):
        store.load(tmp_path)


def test_a_map_of_another_urdf_is_refused_with_both_hashes(map_path, arm):
    other = urdf_text(tip_offset="0 0 0.11")
    with pytest.raises(CapabilityMapError) as caught:
        CapabilityMap.load(map_path, urdf_xml=other)
    assert arm.urdf_sha256 in str(caught.value)
    assert urdf_hash(other) in str(caught.value)


def test_the_hash_ignores_what_the_map_does_not_depend_on(arm):
    same = arm.urdf_xml.replace("<link", "<!-- a comment -->\n  <link").replace(
        "<collision>", '<visual><geometry><sphere radius="1"/></geometry></visual><collision>'
    )
    assert urdf_hash(same) == arm.urdf_sha256
    assert urdf_hash(arm.urdf_xml.replace('upper="2.4"', 'upper="2.5"')) != arm.urdf_sha256
    with pytest.raises(CapabilityMapError, match="no XML"):
        urdf_hash("<robot")


def test_a_folder_that_cannot_be_written_is_named(map_path, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(CapabilityMapError, match="cannot write"):
        store.save(tmp_path / "file" / "map.h5", store.load(map_path))


@pytest.mark.parametrize("kind", ["S4", "c16", "?"])
def test_numbers_of_another_kind_are_read_as_numbers_or_refused(map_path, tmp_path, kind):
    with h5py.File(map_path, "r") as file:
        names = [f"shapes/{name}" for name in file["shapes"]]
    for name in names:
        path = tmp_path / "kind.h5"
        path.write_bytes(map_path.read_bytes())
        with h5py.File(path, "r+") as file:
            values = file[name][...]
            del file[name]
            file[name] = np.full(values.shape, b"word") if kind == "S4" else values.astype(kind)
        sign(path)
        try:
            assert store.load(path).shapes[name.removeprefix("shapes/")].dtype.kind in "fi"
        except CapabilityMapError as err:
            assert str(path) in str(err)
