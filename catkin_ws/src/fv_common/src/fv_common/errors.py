"""What all errors and warnings that are meant for users are kinds of."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator


class UserError(Exception):
    """What a user can cause. Its message says in one line what is wrong and what is valid: nobody needs a traceback."""


class ConfigError(UserError, ValueError):
    """A file or a parameter holds what cannot be used; the text names file, key, value, and what would be valid."""


class MessageError(UserError, ValueError):
    """A message cannot be used; the text names the field and what would be valid."""


class Notice(UserWarning):
    """What a user is to know although it goes on, as a Python warning: told in one line. Others go into the log."""


@contextlib.contextmanager
def told_as(kind: type[UserError]) -> Iterator[None]:
    """Turn a ConfigError into the one kind of error that a package promises; for functions and for ``with``."""
    try:
        yield
    except ConfigError as error:
        raise kind(str(error)) from error
