"""Errors that a user can cause, each of one line."""


class SimError(ValueError):
    """Bad input: the message says in one line what is wrong and what would be right."""
