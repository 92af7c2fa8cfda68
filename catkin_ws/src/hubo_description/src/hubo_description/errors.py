"""The one error of this package."""


class RobotDescriptionError(ValueError):
    """A robot's files are missing, broken or contradict each other; the text names file, value and valid choices."""
