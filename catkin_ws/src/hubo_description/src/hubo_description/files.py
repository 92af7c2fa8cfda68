"""Text files of a robot, read with care: size, encoding, and what XML and YAML can hide."""

from __future__ import annotations

import re
from pathlib import Path

import yaml

from hubo_description.errors import RobotDescriptionError

LARGEST_XML = 16 << 20  # bytes; URDFs of whole humanoids have half a megabyte
LARGEST_YAML = 1 << 20
LARGEST_YAML_TREE = 100_000  # nodes, with aliases written out
_DECLARATION = re.compile(r"^\s*<\?xml[^>]*\?>")
_ENCODING = re.compile(rb"""^\s*<\?xml[^>]*encoding\s*=\s*["']([\w.-]+)["']""")
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_MARKS = {b"\xef\xbb\xbf": "utf-8-sig", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}


def read_bytes(path: Path, largest: int) -> bytes:
    """Return a file's content.

    :raises RobotDescriptionError: it cannot be read, or has more than ``largest`` bytes.
    """
    try:
        with path.open("rb") as file:
            content = file.read(largest + 1)
    except OSError as err:
        raise RobotDescriptionError(f"{path}: cannot be read: {err.strerror or err}") from err
    if len(content) > largest:
        raise RobotDescriptionError(f"{path}: more than {largest} bytes long, which no robot needs")
    return content


def read_xml(path: Path) -> str:
    """Return the text of an XML file without its declaration, whatever encoding that declares.

    :raises RobotDescriptionError: it cannot be read, or declares a document type: entities can grow without end.
    """
    content = read_bytes(path, LARGEST_XML)
    declared = _ENCODING.match(content)
    marked = next((name for mark, name in _MARKS.items() if content.startswith(mark)), None)
    encoding = marked or (declared[1].decode() if declared else "utf-8")
    try:
        text = content.decode(encoding)
    except (LookupError, UnicodeDecodeError) as err:
        raise RobotDescriptionError(f"{path}: cannot be read as {encoding}: {err}") from err
    if "<!DOCTYPE" in _COMMENT.sub("", text):
        raise RobotDescriptionError(f"{path}: has a <!DOCTYPE>, which is not read; remove it")
    return _DECLARATION.sub("", text, count=1)


def read_yaml_file(path: Path) -> object:
    """Return what a YAML file holds.

    :raises RobotDescriptionError: it cannot be read, or as read_yaml_text.
    """
    try:
        text = read_bytes(path, LARGEST_YAML).decode("utf-8-sig")
    except UnicodeDecodeError as err:
        raise RobotDescriptionError(f"{path}: cannot be read: {err}") from err
    return read_yaml_text(text, str(path))


def read_yaml_text(text: str, where: str) -> object:
    """Return what a YAML text holds.

    :raises RobotDescriptionError: no YAML, too long, nested too deep, a key that a mapping has twice, or aliases that
        refer to themselves or would grow to more than LARGEST_YAML_TREE nodes.
    """
    if len(text) > LARGEST_YAML:
        raise RobotDescriptionError(
            f"{where}: more than {LARGEST_YAML} characters long, which no robot needs"
        )
    try:
        root = yaml.compose(text, Loader=yaml.SafeLoader)
        if root is not None and _tree_size(root, {}) > LARGEST_YAML_TREE:
            raise RobotDescriptionError(
                f"{where}: its aliases (*name) grow to more than {LARGEST_YAML_TREE} values"
            )
        return yaml.safe_load(text)
    except (yaml.YAMLError, ValueError) as err:  # ValueError: dates and numbers that are none
        raise RobotDescriptionError(f"{where}: no valid YAML: {' '.join(str(err).split())}") from err
    except RecursionError as err:
        raise RobotDescriptionError(f"{where}: nested too deep, or an alias that holds itself") from err


def _tree_size(node: yaml.Node, known: dict[int, int]) -> int:
    """Return the number of nodes below and with this one, those behind aliases each time they are named."""
    if id(node) not in known:
        parts: list[yaml.Node] = []
        if isinstance(node, yaml.SequenceNode):
            parts = node.value
        elif isinstance(node, yaml.MappingNode):
            _require_single_keys(node)
            parts = [part for pair in node.value for part in pair]
        known[id(node)] = 1 + sum(_tree_size(part, known) for part in parts)
    return known[id(node)]


def _require_single_keys(mapping: yaml.MappingNode) -> None:
    """PyYAML would take the last of two values, without a word."""
    seen: set[tuple[str, str]] = set()
    for key, _ in mapping.value:
        if isinstance(key, yaml.ScalarNode):
            if (key.tag, key.value) in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key '{key.value}' is there twice", key.start_mark
                )
            seen.add((key.tag, key.value))
