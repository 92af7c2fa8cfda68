"""What all errors and warnings that are meant for users are kinds of."""


class UserError(Exception):
    """What a user can cause. Its message says in one line what is wrong and what is valid: nobody needs a traceback."""


class Notice(UserWarning):
    """What a user is to know although it goes on, as a Python warning: told in one line. Others go into the log."""
