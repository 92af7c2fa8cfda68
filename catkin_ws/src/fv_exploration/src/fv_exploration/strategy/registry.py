"""Strategies by name: ours, and those of anybody's own module."""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Mapping

from fv_common.one_line import one_line
from fv_common.schema import from_mapping
from fv_exploration.strategy.protocol import Strategy

STRATEGIES = {"frontier_void": "fv_exploration.strategy.frontier_void:FrontierVoid"}
"""Ours; whoever adds one adds it here."""


def load_strategy(policy: str, parameters: Mapping[str, object]) -> Strategy:
    """A new object of the strategy.

    :param policy: a name in ``STRATEGIES``, or ``package.module:Class`` of a module on the Python path.
    :param parameters: values of the class's fields, when it is a dataclass; others take none.
    :raises ValueError: there is no such strategy, it is none, or it does not take these parameters.
    """
    kind, where = _kind(policy), f"policy_parameters of {policy}"
    try:
        return _made(kind, parameters, where)
    except ValueError:
        raise
    except Exception as error:  # of somebody's own class
        raise ValueError(f"{where}: {_told(error)}") from error


def _made(kind: type[Strategy], parameters: Mapping[str, object], where: str) -> Strategy:
    if dataclasses.is_dataclass(kind):
        return from_mapping(kind, dict(parameters), where)
    if parameters:
        key = next(iter(parameters))
        raise ValueError(f"{where}: unknown key '{key}'; valid: none, for {kind.__name__} is no dataclass")
    return kind()


def _kind(policy: str) -> type[Strategy]:
    """The class."""
    place = STRATEGIES.get(policy, policy)
    module_name, _, class_name = place.partition(":")
    valid = f"valid: {', '.join(STRATEGIES)}, or package.module:Class of a module on PYTHONPATH"
    if not (module_name and class_name):
        raise ValueError(f"policy is {policy!r}; {valid}")
    try:
        module = importlib.import_module(module_name)
    except Exception as error:
        raise ValueError(f"policy is {policy!r}: {_told(error)}; {valid}") from error
    kind = getattr(module, class_name, None)
    if not (isinstance(kind, type) and callable(getattr(kind, "choose", None))):
        raise ValueError(
            f"policy is {policy!r}: {module_name} has no class {class_name} with a method choose; {valid}"
        )
    return kind


def _told(error: Exception) -> str:
    return one_line(f"{type(error).__name__}: {error}")
