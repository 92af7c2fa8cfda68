"""Imports keep to the layers that docs/architecture.md writes down, and files do not go in circles."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import pytest
from imports import ROOT, SOURCES, circles, file_edges, package_uses, packages

PAGE = ROOT / "docs" / "architecture.md"


@dataclass(frozen=True)
class Layer:
    """A row of the page's table: the package's floor, and the packages beside it that it may use."""

    floor: int
    beside: frozenset[str]


def layers() -> dict[str, Layer]:
    """The table of the page: | floor | packages | what | beside it, may use |, names in backquotes."""
    out = {}
    for floor, names, beside in re.findall(
        r"^\| (\d) \| (`[^|]*) \|[^|]*\|([^|]*)\|$", PAGE.read_text(), re.MULTILINE
    ):
        layer = Layer(int(floor), frozenset(re.findall(r"`(\w+)`", beside)))
        out |= dict.fromkeys(re.findall(r"`(\w+)`", names), layer)
    return out


def may_use(user: str, used: str, table: dict[str, Layer]) -> bool:
    return table[used].floor < table[user].floor or used in table[user].beside


def test_every_package_has_its_place_on_the_page():
    assert set(layers()) == set(packages())


def test_every_use_goes_down_or_is_named_on_the_page():
    table = layers()
    wrong = [f"{a} uses {b}: {where}" for (a, b), where in package_uses().items() if not may_use(a, b, table)]
    assert not wrong, f"{PAGE.name} allows none of these:\n" + "\n".join(wrong)


def test_files_do_not_go_in_circles():
    found = [" -> ".join(str(path.relative_to(SOURCES)) for path in group) for group in circles(file_edges())]
    assert not found, "\n".join(found)


def test_what_a_package_imports_stands_in_its_package_xml():
    for (user, used), where in package_uses().items():
        root = ElementTree.parse(SOURCES / user / "package.xml").getroot()
        assert used in {element.text for element in root if element.tag.endswith("depend")}, (
            f"{where} uses {used}"
        )


def test_a_circle_and_a_use_upwards_are_seen():
    a, b, c = Path("a"), Path("b"), Path("c")
    assert circles({a: {b}, b: {c}, c: {a}}) == [[a, b, c]]
    assert circles({a: {b, c}, b: {c}, c: set()}) == []
    table = {
        "low": Layer(0, frozenset()),
        "high": Layer(1, frozenset()),
        "friend": Layer(1, frozenset({"high"})),
    }
    assert may_use("high", "low", table) and may_use("friend", "high", table)
    assert not may_use("low", "high", table) and not may_use("high", "friend", table)


@pytest.mark.parametrize("package", packages())
def test_the_edges_of_a_package_are_seen(package):
    """That the reader of imports reads: a package with modules of its own has edges between its files."""
    modules = list((SOURCES / package / "src" / package).rglob("*.py"))
    if len(modules) > 2:
        assert any(other in modules for path in modules for other in file_edges()[path])
