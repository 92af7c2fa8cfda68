"""Where meshes of other ROS packages lie."""

from __future__ import annotations

from fv_robot_model._core import ModelError

PACKAGE = "package://"


def package_file(uri: str) -> str:
    """Return the absolute file name of a ``package://`` URI: the resolver for ``RobotModel.from_xml`` under ROS.

    :raises ModelError: another kind of URI, or a package that this environment does not have.
    """
    import rospkg  # slow to import, and most robots need none

    if not uri.startswith(PACKAGE):
        raise ModelError(f"mesh '{uri}' is neither absolute, file:// nor package://")
    package, _, rest = uri.removeprefix(PACKAGE).partition("/")
    try:
        return f"{rospkg.RosPack().get_path(package)}/{rest}"
    except rospkg.ResourceNotFound:
        raise ModelError(
            f"mesh '{uri}': ROS package '{package}' is not installed; install it, add its workspace to "
            "ROS_PACKAGE_PATH, or name the mesh by a path relative to the URDF"
        ) from None
