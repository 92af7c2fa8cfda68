"""Errors that a user can cause, each of one line."""

from fv_common.errors import UserError


class SimError(UserError, ValueError):
    """Bad input: the message says in one line what is wrong and what would be right."""
