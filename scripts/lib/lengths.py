"""Functions over 60 lines and files over 400, of Python and C++: none without a reason.

A reason is a comment `# long: reason` (`// long: reason`) in the line before the function or in its first two lines, or
in the file's first ten lines.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

FUNCTION_LINES, FILE_LINES = 60, 400
REASON = re.compile(r"(#|//) long: \S")
NOT_CODE = re.compile(
    r'R"\((?:.|\n)*?\)"|//[^\n]*|/\*(?:.|\n)*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\''
)
NO_FUNCTION = re.compile(
    r"\s*(template\s*<.*>\s*)?(namespace|class|struct|enum|union|extern|if|for|while|switch|do|else)\b"
)


@dataclass(frozen=True)
class Function:
    """A function's name or first words, and its first and last line, from 1."""

    name: str
    first: int
    last: int


def python_functions(text: str) -> Iterator[Function]:
    """Functions and methods; their decorators do not count."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            yield Function(node.name, node.lineno, node.end_lineno or node.lineno)


def cpp_functions(text: str) -> Iterator[Function]:
    """Blocks in braces that follow a parameter list: functions, tests and lambdas, by counting braces."""
    bare = NOT_CODE.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)
    bare = re.sub(
        r"^[ \t]*#.*(?:\\\n.*)*", lambda match: re.sub(r"[^\n]", " ", match[0]), bare, flags=re.MULTILINE
    )
    opened: list[tuple[str, int]] = []
    begin = 0
    for at, letter in enumerate(bare):
        if letter == "{":
            words = bare[begin:at]
            first = bare.count("\n", 0, begin + len(words) - len(words.lstrip())) + 1
            opened.append((" ".join(words.split()), first))
        elif letter == "}" and opened:
            words, first = opened.pop()
            if "(" in words and not words.endswith("=") and not NO_FUNCTION.match(words):
                yield Function(words.split("(")[0], first, bare.count("\n", 0, at) + 1)
        if letter in "{};":
            begin = at + 1


def too_long(path: Path) -> list[str]:
    """One line of text for each function and for the file that is too long without a reason."""
    text = path.read_text()
    lines = text.splitlines()
    found = []
    if len(lines) > FILE_LINES and not any(REASON.search(line) for line in lines[:10]):
        found.append(
            f"{path}: {len(lines)} lines; valid: up to {FILE_LINES}, or a comment 'long: reason' on top"
        )
    functions = cpp_functions(text) if path.suffix in (".cpp", ".h", ".hpp") else python_functions(text)
    for function in functions:
        size = function.last - function.first + 1
        near = lines[max(0, function.first - 2) : function.first + 1]
        if size > FUNCTION_LINES and not any(REASON.search(line) for line in near):
            where = f"{path}:{function.first}: {function.name} has {size} lines"
            found.append(f"{where}; valid: up to {FUNCTION_LINES}, or a comment 'long: reason' beside it")
    return found


def main() -> int:
    """Exit status: 1 when something is too long."""
    found = [line for name in sys.argv[1:] for line in too_long(Path(name))]
    print("\n".join(found))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
