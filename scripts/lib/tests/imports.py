"""Who imports whom: files of this workspace and the edges between them, read from Python, C++ and package.xml."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

ROOT = Path(__file__).resolve().parents[3]
SOURCES = ROOT / "catkin_ws" / "src"
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.MULTILINE)
PYTHON_2 = b"#!/usr/bin/env python3"


def packages() -> list[str]:
    """Names of the packages of this workspace."""
    return sorted(path.parent.name for path in SOURCES.glob("*/package.xml"))


def package_of(path: Path) -> str:
    return path.relative_to(SOURCES).parts[0]


def python_files() -> list[Path]:
    """All of the packages' Python: modules, nodes, fuzz targets and tests."""
    files = [path for path in SOURCES.rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    return sorted(
        p for p in files if p.suffix == ".py" or (not p.suffix and p.read_bytes().startswith(PYTHON_2))
    )


def cpp_files() -> list[Path]:
    return sorted(path for path in SOURCES.rglob("*") if path.suffix in (".h", ".hpp", ".cpp"))


def module_files() -> dict[str, Path]:
    """Every importable module of ours by its dotted name."""
    out = {}
    for package in packages():
        folder = SOURCES / package / "src"
        for path in (folder / package).rglob("*.py"):
            parts = path.relative_to(folder).with_suffix("").parts
            out[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return out


def imported_names(path: Path) -> Iterator[str]:
    """Dotted names that a Python file imports, anywhere in it; `from a import b` gives a.b."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: imports of ours are absolute"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def file_edges() -> dict[Path, set[Path]]:
    """Which files of ours a file takes in: modules that it imports, headers that it includes."""
    modules, out = module_files(), {}
    for path in modules.values():
        names = [longest_known(name, modules) for name in imported_names(path) if "._core" not in name]
        out[path] = {modules[name] for name in names if name} - {path}
    headers = {path for path in cpp_files() if path.suffix != ".cpp"}
    for path in cpp_files():
        out[path] = {
            found for text in INCLUDE.findall(path.read_text()) if (found := header(text, path, headers))
        }
    return out


def longest_known(name: str, modules: dict[str, Path]) -> str:
    """The module that a dotted name is in, or nothing."""
    while name and name not in modules:
        name = name.rpartition(".")[0]
    return name


def header(text: str, within: Path, headers: set[Path]) -> Path | None:
    """The header of ours that an #include names: beside the file, or in its package's or another's folders."""
    near = [(within.parent / text).resolve()]
    own = SOURCES / package_of(within)
    near += [own / folder / text for folder in ("include", "src", "src/core", "src/node", "bindings", "test")]
    other = SOURCES / text.split("/")[0] / "include" / text
    return next((path for path in (*near, other) if path in headers), None)


def circles(edges: dict[Path, set[Path]]) -> list[list[Path]]:
    """Groups of files that reach each other (Tarjan's strongly connected components of more than one)."""
    index: dict[Path, int] = {}
    low: dict[Path, int] = {}
    stack: list[Path] = []
    found: list[list[Path]] = []

    def visit(node: Path) -> None:
        index[node] = low[node] = len(index)
        stack.append(node)
        for other in edges.get(node, ()):
            if other not in index:
                visit(other)
            if other in stack:
                low[node] = min(low[node], low[other])
        if low[node] == index[node]:
            group = stack[stack.index(node) :]
            del stack[stack.index(node) :]
            if len(group) > 1:
                found.append(sorted(group))

    for node in edges:
        if node not in index:
            visit(node)
    return found


def package_uses() -> dict[tuple[str, str], str]:
    """(package, other package of ours) -> one place where the first uses the second."""
    names = set(packages())
    out: dict[tuple[str, str], str] = {}

    def note(path: Path, others: set[str]) -> None:
        for other in (others & names) - {package_of(path)}:
            out.setdefault((package_of(path), other), str(path.relative_to(SOURCES)))

    for path in python_files():
        note(path, {name.split(".")[0] for name in imported_names(path)})
    for path in cpp_files():
        note(path, {text.split("/")[0] for text in INCLUDE.findall(path.read_text())})
    for path in SOURCES.glob("*/package.xml"):
        tags = [element for element in ElementTree.parse(path).getroot() if element.tag.endswith("depend")]
        note(path, {(element.text or "").strip() for element in tags})
    return out
