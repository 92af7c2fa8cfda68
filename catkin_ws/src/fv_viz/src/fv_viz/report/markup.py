"""HTML of the house: a page, figures, tables, and values as people write them."""

from __future__ import annotations

import html
from collections.abc import Iterable
from importlib import resources
from typing import Any


class Number(str):
    """Text that is set as numbers are."""

    __slots__ = ()


def page(title: str, parts: Iterable[str]) -> str:
    """HTML document with the house's style sheet inside."""
    style = resources.files(__package__).joinpath("page.css").read_text()
    head = f'<meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{text(title)}</title>'
    head = f'<head>{head}<link rel="icon" href="data:,"><style>{style}</style></head>'
    return f'<!DOCTYPE html>\n<html lang="en">{head}<body>{"".join(parts)}</body></html>\n'


def figure(title: str, content: str, note: str = "") -> str:
    """A titled figure, with a note below it; empty content stays empty."""
    note = f'<p class="note">{text(note)}</p>' if note else ""
    return f"<figure><figcaption>{text(title)}</figcaption>{content}{note}</figure>" if content else ""


def table(rows: Iterable[Iterable[Any]], header: Iterable[str] = ()) -> str:
    """An HTML table; numbers are set right."""
    rows, header = [list(row) for row in rows], list(header)
    kinds = [_kind(value) for value in rows[0]] if rows else [""] * len(header)
    head = "".join(f"<th{kind}>{text(name)}</th>" for name, kind in zip(header, kinds, strict=False))
    body = "".join("<tr>" + "".join(_cell(value) for value in row) + "</tr>" for row in rows)
    head = f"<thead><tr>{head}</tr></thead>" if head else ""
    return f'<div class="scroll"><table>{head}{body}</table></div>'


def shown(value: Any) -> str:
    """A value as people write it."""
    if value is None or value != value:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if not isinstance(value, (int, float)):
        return str(value)
    return f"{int(value):,}" if float(value).is_integer() and abs(value) < 1e15 else f"{value:.4g}"


def is_number(value: Any) -> bool:
    """Whether a value of run.json is a number, and one that can be shown."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and value == value


def text(value: Any) -> str:
    """Any value as HTML text."""
    return html.escape(str(value))


def _cell(value: Any) -> str:
    return f"<td{_kind(value)}>{text(shown(value))}</td>"


def _kind(value: Any) -> str:
    number = isinstance(value, Number) or is_number(value) or value is None or value != value
    return ' class="number"' if number else ""
