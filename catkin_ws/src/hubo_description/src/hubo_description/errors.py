"""The one error of this package."""

from fv_common.errors import UserError


class RobotDescriptionError(UserError, ValueError):
    """A robot's files are missing, broken or contradict each other; the text names file, value and valid choices."""
