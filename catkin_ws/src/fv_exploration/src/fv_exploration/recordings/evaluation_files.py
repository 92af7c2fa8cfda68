"""The files of an evaluation: names that keep all inputs apart, and files that are there whole or not at all."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

ENDINGS = (".ot", "_utility.ot", "_utility_colors.ot", ".png", ".json")
"""Of an input's results, the last one being the one that says whose they are."""


def result_names(inputs: Sequence[Path], folder: Path) -> list[str]:
    """A name for the results of each input (absolute, all different), unlike in more than case.

    The file's own where that is enough; else with its ending, its folders, a number. The results of other inputs that
    the folder holds stay; those of the same input are replaced.
    """
    names = [_Name(path, folder) for path in inputs]
    moved = True
    while moved:
        taken: dict[str, list[int]] = {}
        for i, name in enumerate(names):
            for file in name.files():
                taken.setdefault(file, []).append(i)
        moved = False
        for i, name in enumerate(names):
            rivals = {other for file in name.files() for other in taken[file]} - {i}
            if name.is_of_another() or (rivals and (name.has_more() or min(rivals) < i)):
                name.level += 1
                moved = True
    return [name.text() for name in names]


class _Name:
    """The name of an input's results: longer with each level, in the end with a number."""

    def __init__(self, path: Path, folder: Path) -> None:
        self._path = path
        self._folder = folder
        self._choices = _choices(path)
        owned = [i for i, name in enumerate(self._choices) if self._owner(name) == str(path)]
        self.level = owned[0] if owned else 0

    def text(self) -> str:
        over = self.level - len(self._choices) + 1
        return f"{self._choices[-1]}-{over + 1}" if over > 0 else self._choices[self.level]

    def has_more(self) -> bool:
        """Whether there is a longer name without a number."""
        return self.level < len(self._choices) - 1

    def files(self) -> set[str]:
        return {(self.text() + ending).lower() for ending in ENDINGS}

    def is_of_another(self) -> bool:
        """Whether the folder has files of this name that are not the results of this input."""
        there = any((self._folder / (self.text() + ending)).exists() for ending in ENDINGS)
        return there and self._owner(self.text()) != str(self._path)

    def _owner(self, name: str) -> str | None:
        try:
            return json.loads((self._folder / f"{name}{ENDINGS[-1]}").read_text())["path"]
        except (OSError, ValueError, KeyError, TypeError):
            return None


def _choices(path: Path) -> list[str]:
    """Names from short to long."""
    stem, whole = path.stem, path.name.replace(".", "_")
    names = [stem, whole]
    above = [part for part in path.parent.parts if part.strip(os.sep)]
    for depth in range(1, len(above) + 1):
        prefix = "_".join(above[-depth:])
        names += [f"{prefix}_{stem}", f"{prefix}_{whole}"]
    return names


@contextmanager
def whole_files(folder: Path, name: str) -> Iterator[str]:
    """Gives the beginning of the paths to write to; what was written moves into the folder at the end.

    Nothing moves when there is an error.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{name}-", dir=folder) as aside:
        yield os.path.join(aside, name)
        for ending in ENDINGS:
            os.replace(os.path.join(aside, name + ending), folder / (name + ending))
