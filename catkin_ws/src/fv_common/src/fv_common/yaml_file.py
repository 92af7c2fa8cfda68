"""YAML read with care: size, encoding, keys that are there twice, and what aliases can hide."""

from __future__ import annotations

from pathlib import Path

import yaml

from fv_common.errors import ConfigError

LARGEST_YAML = 1 << 20  # bytes
LARGEST_YAML_TREE = 100_000  # nodes, with aliases written out


def read_bytes(path: Path, largest: int) -> bytes:
    """Return a file's content.

    :raises ConfigError: it cannot be read, or has more than ``largest`` bytes.
    """
    try:
        with path.open("rb") as file:
            content = file.read(largest + 1)
    except OSError as err:
        raise ConfigError(f"{path}: cannot be read: {err.strerror or err}") from err
    if len(content) > largest:
        raise ConfigError(f"{path}: more than {largest} bytes long, which no such file needs")
    return content


def read_yaml(path: Path) -> object:
    """Return what a YAML file holds.

    :raises ConfigError: it cannot be read, or as read_yaml_text.
    """
    try:
        text = read_bytes(path, LARGEST_YAML).decode("utf-8-sig")
    except UnicodeDecodeError as err:
        raise ConfigError(f"{path}: cannot be read: {err}") from err
    return read_yaml_text(text, str(path))


def read_yaml_text(text: str, where: str) -> object:
    """Return what a YAML text holds.

    :raises ConfigError: no YAML, too long, nested too deep, a key that a mapping has twice, or aliases that refer to
        themselves or would grow to more than LARGEST_YAML_TREE nodes.
    """
    if len(text) > LARGEST_YAML:
        raise ConfigError(f"{where}: more than {LARGEST_YAML} characters long, which no such file needs")
    try:
        root = yaml.compose(text, Loader=yaml.SafeLoader)
        if root is not None and _tree_size(root, {}) > LARGEST_YAML_TREE:
            raise ConfigError(f"{where}: its aliases (*name) grow to more than {LARGEST_YAML_TREE} values")
        return yaml.safe_load(text)
    except ConfigError:
        raise
    except (yaml.YAMLError, ValueError) as err:  # ValueError: dates and numbers that are none
        raise ConfigError(f"{where}: no valid YAML: {' '.join(str(err).split())}") from err
    except RecursionError as err:
        raise ConfigError(f"{where}: nested too deep, or an alias that holds itself") from err


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
