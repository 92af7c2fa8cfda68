"""The robot's shapes at given joint positions: what the ghosts along a path are made of."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import Vector3
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from fv_common.conversions import pose_from_matrix
from fv_robot_model import RobotModel, Visual
from fv_viz.drawing import packing, shapes

_KINDS = {
    Visual.Kind.Box: Marker.CUBE,
    Visual.Kind.Cylinder: Marker.CYLINDER,
    Visual.Kind.Sphere: Marker.SPHERE,
    Visual.Kind.Mesh: Marker.MESH_RESOURCE,
}


class RobotShapes:
    """Kinematics and visuals of a URDF, drawn as markers.

    Raises ValueError for a URDF that cannot be used.
    """

    def __init__(self, urdf_xml: str) -> None:
        try:
            self._model = RobotModel.from_xml(urdf_xml, with_shapes=False)
        except ValueError as error:
            raise ValueError(f"robot description: {error}") from error
        self.root: str = self._model.root_link
        self.joint_names: list[str] = self._model.joint_names
        self.visuals = [
            (link, visual) for link in self._model.link_names for visual in self._model.visuals(link)
        ]

    def link_poses(self, positions: dict[str, float]) -> dict[str, np.ndarray]:
        """T_root_link (4, 4) of every link; joints not named stand at zero."""
        q = [positions.get(name, 0.0) for name in self.joint_names]
        return dict(zip(self._model.link_names, self._model.forward(q), strict=True))

    def markers(
        self,
        namespace: str,
        positions: dict[str, float],
        color,
        alpha: float,
        number: int,
        links: set[str] | None = None,
    ) -> list[bytes]:
        """The robot, or some links of it, as markers in the frame of its root link, numbered from `number`."""
        poses, out = self.link_poses(positions), []
        for link, visual in self.visuals:
            if links is None or link in links:
                one = shapes.marker(
                    Header(frame_id=self.root),
                    namespace,
                    _KINDS[visual.kind],
                    color,
                    alpha,
                    number + len(out),
                )
                one.frame_locked = True  # else RViz drops for good what comes before the first transform
                one.pose = pose_from_matrix(poses[link] @ visual.T_link_visual)
                one.scale, one.mesh_resource = Vector3(*marker_size(visual)), visual.mesh
                out.append(packing.pack_marker(one))
        return out

    def moved_by(self, joint_names: list[str]) -> set[str]:
        """Links whose pose depends on one of these joints; joints of other robots move nothing."""
        return set(self._model.moved_links([name for name in joint_names if name in self.joint_names]))


def marker_size(visual: Visual) -> tuple[float, float, float]:
    """A marker's scale: edges or diameters [m], or the scale of a mesh."""
    first, second, third = visual.dimensions
    if visual.kind == Visual.Kind.Cylinder:
        return 2.0 * first, 2.0 * first, second
    if visual.kind == Visual.Kind.Sphere:
        return 2.0 * first, 2.0 * first, 2.0 * first
    return first, second, third
