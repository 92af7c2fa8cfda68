"""The commands that the documents of this project tell a reader to type, in the order in which they stand."""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[4]
PROGRAMS = re.compile(
    r"\.|scripts/.*|ros(run|core|bag|msg|node|param|service|test|topic)|apt-get|catkin_make|cd|chown|cp|dask|docker|"
    r"export|git|ip|kill|mkdir|mv|nft|nsenter|octovis|pip|pytest|python3|sudo|systemctl|unshare|xvfb-run"
)
FENCE = re.compile(r" *(`{3,}|~{3,})(.*)")
SHELLS = {"sh", "bash", "shell", "console"}
CODE_SPAN = re.compile(r"(?<!`)(`+)(?!`)(.+?)(?<!`)\1(?!`)", re.DOTALL)


@dataclass(frozen=True)
class Command:
    """What a document says one may type.

    :param text: as it stands there, without its comment; line breaks within quotes are kept.
    :param line: number of its first line, from 1.
    """

    text: str
    line: int


def all_documents() -> dict[str, Path]:
    """Every document by its name: README, those in docs/ by their files, each package's README by its package."""
    docs = {path.name: path for path in sorted((ROOT / "docs").glob("*.md"))}
    packages = {path.parent.name: path for path in sorted((ROOT / "catkin_ws/src").glob("*/README.md"))}
    top = {path.name: path for path in sorted(ROOT.glob("*.md"))}
    return {**top, **docs, **packages}


def commands_of(markdown: str) -> list[Command]:
    """Commands in shell fences, in other code blocks where a line begins with a program, and in code spans.

    A code span of one word (`` `rosrun` ``) is a mention: there is nothing to type yet. Scripts of this project are the
    exception to the exception: their bare name is a whole command where a fence has it, and a mention in a sentence.
    """
    found: list[Command] = []
    paragraph: list[str] = []
    lines = markdown.splitlines()
    number = 0
    while number < len(lines):
        fence = FENCE.fullmatch(lines[number])
        if fence is None and not _is_indented(lines, number):
            paragraph.append(lines[number])
            number += 1
            if not paragraph[-1].strip():
                found += _spans(paragraph, number - len(paragraph) + 1)
                paragraph = []
            continue
        found += _spans(paragraph, number - len(paragraph) + 1)
        paragraph = []
        end = _end_of_fence(lines, number, fence[1]) if fence else _end_of_indented(lines, number)
        body = range(number + 1, end) if fence else range(number, end)
        words = fence[2].split() if fence else []
        block = [(lines[i], i + 1) for i in body]
        if words and words[0] in SHELLS:
            found += _logical_lines(block)
        elif not words:
            found += [command for command in _logical_lines(block, lenient=True) if is_command(command.text)]
        number = end + 1 if fence else end
    return found + _spans(paragraph, number - len(paragraph) + 1)


def is_command(text: str) -> bool:
    """Whether a line begins with a program that readers of this project use."""
    words = text.split(maxsplit=1)
    return bool(words) and PROGRAMS.fullmatch(words[0]) is not None


def _spans(paragraph: list[str], first_line: int) -> list[Command]:
    text = "\n".join(paragraph)
    spans = [(" ".join(match[2].split()), match.start()) for match in CODE_SPAN.finditer(text)]
    return [
        Command(span, first_line + text.count("\n", 0, start))
        for span, start in spans
        if is_command(span) and len(span.split()) > 1
    ]


def _is_indented(lines: list[str], number: int) -> bool:
    """Indented code begins after an empty line; an indented line after text goes on with that text."""
    return lines[number].startswith("    ") and (number == 0 or not lines[number - 1].strip())


def _end_of_indented(lines: list[str], number: int) -> int:
    while number < len(lines) and lines[number].startswith("    "):
        number += 1
    return number


def _end_of_fence(lines: list[str], number: int, marks: str) -> int:
    for end in range(number + 1, len(lines)):
        if lines[end].strip().startswith(marks) and not lines[end].strip().strip(marks[0]):
            return end
    raise ValueError(f"the code block that begins in line {number + 1} has no end")


def _logical_lines(block: list[tuple[str, int]], lenient: bool = False) -> list[Command]:
    """Lines joined while a quote or a backslash is open; comments go.

    :param lenient: a line that never becomes whole stands alone (a drawing, not a shell's text).
    """
    found: list[Command] = []
    at = 0
    while at < len(block):
        for end in range(at + 1, len(block) + 1):
            text = "\n".join(line for line, _ in block[at:end])
            if _is_whole(text):
                break
        else:
            if not lenient:
                raise ValueError(f"the command that begins in line {block[at][1]} has no end")
            text, end = block[at][0], at + 1
        bare = without_comment(text).strip()
        if bare:
            found.append(Command(bare, block[at][1]))
        at = end
    return found


def _is_whole(text: str) -> bool:
    if text.endswith("\\"):
        return False
    try:
        shlex.split(text, comments=True)
    except ValueError:
        return False
    return True


def without_comment(text: str) -> str:
    """The text up to a # that begins a word outside of quotes."""
    quote = ""
    for at, letter in enumerate(text):
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "'\"":
            quote = letter
        elif letter == "#" and (at == 0 or text[at - 1].isspace()):
            return text[:at]
    return text
