"""Figures of the robot, its capability map and its plans. Numbers are those of the thesis."""

from __future__ import annotations

import numpy as np
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from fv_figures import plans, sources
from fv_figures.compose import Figure
from fv_figures.material import Material, index_scale, lines
from fv_viz.drawing import colors, framing, packing, shapes

TOPICS = {"Spheres as spikes": "spheres", "Index cuts": "index", "Shapes": "shapes"}


def figure_3_3(m: Material) -> Figure:
    """Two rows of spheres."""
    from capability_map.drawing import geometry

    s = m.spheres
    rows = geometry.two_rows(s.cap)
    eye = _around(m, rows, -1.2, 0.25)
    panel = _taken(m, "Spheres as spikes", _spikes(s, rows), eye, robot=True)
    shows = f"two rows of reachability spheres ({len(rows)}), coloured by their reachability index"
    return Figure([("two rows of spheres", panel)], shows, s.made_by, index_scale(s), {"blue": 0.002})


def figure_3_4(m: Material) -> Figure:
    """Index in cuts."""
    from capability_map.drawing import geometry

    s, panels = m.spheres, []
    for axis, words, yaw, pitch in (
        (2, "level cut through the shoulder", -0.9, 1.0),
        (1, "upright cut", -1.4, 0.2),
    ):
        rows = geometry.cut_rows(s.cap, axis)
        balls = shapes.marker(_header(s), "index", Marker.SPHERE_LIST, (1, 1, 1))
        balls.scale.x = balls.scale.y = balls.scale.z = 1.6 * s.cap.radius
        rgba = np.column_stack([s.colors()[rows], np.ones(len(rows))])
        blob = packing.pack_marker(balls, s.cap.centres[rows], rgba)
        panels.append((words, _taken(m, "Index cuts", [blob], _around(m, rows, yaw, pitch), robot=True)))
    shows = "reachability index in two cuts of the arm's workspace, dark: reachable from many directions"
    return Figure(panels, shows, s.made_by, index_scale(s), {"green": 0.003, "blue": 0.005})


def figure_3_5(m: Material) -> Figure:
    """Spheres and their structures."""
    s, panels = m.spheres, []
    kinds, errors = s.fitted("type"), s.fitted("error_percent")
    share = s.cap.index() / 100.0
    for number, kind in sources.KINDS.items():
        rows = np.flatnonzero((kinds == number) & (share > 0.08) & (share < 0.92))
        if len(rows):
            panels.append(_structure(m, s, int(rows[np.argmin(errors[rows])]), kind))
    shows = "reachability spheres of the map, one that each structure fits best, with axis and opening angle"
    return Figure(panels, shows, s.made_by, index_scale(s), {"blue": 0.01})


def figure_4_1(m: Material) -> Figure:
    """The robot."""
    places = plans.link_places(m.robot, m.joints)
    body, tip = np.array(list(places.values())), places[plans.camera_frame()]
    body, hand = np.vstack([body - 0.08, body + 0.08]), framing.corners(tip - 0.14, tip + 0.14)
    panels = [
        ("whole", m.stage.take(["Robot", "Grid"], m.look(body, -0.6, 0.15))),
        ("the hand with the sensor", m.stage.take(["Robot"], m.look(hand, -0.9, 0.35))),
    ]
    shows = f"robot {m.robot} in its start pose with the depth camera in its hand"
    made_by = f"rosrun hubo_description upload_robot --robot {m.robot}"
    return Figure(panels, shows, made_by, [], {"grey": 0.03})


def figure_5_6(m: Material) -> Figure:
    """Spheres near the base."""
    s = m.spheres
    distance = np.linalg.norm(s.cap.centres - s.shoulder, axis=1)
    rows = np.argsort(distance + np.where(s.cap.index() >= 20.0, 0.0, np.ptp(distance)))[:12]
    blobs = _spikes(s, rows)
    panels = [
        (
            "where they are",
            _taken(m, "Spheres as spikes", blobs, _around(m, rows, -1.2, 0.25, 2.5), robot=True),
        ),
        ("alone", _taken(m, "Spheres as spikes", blobs, _around(m, rows, -1.2, 0.25))),
    ]
    shows = "the twelve spheres nearest to the shoulder of at least 20 %: their spikes lie together in fans and cones"
    return Figure(panels, shows, s.made_by, index_scale(s), {"blue": 0.002})


def figure_5_8(m: Material) -> Figure:
    """Start, path and goal of a plan."""
    msg, made_by = plans.planned_path(m.stage, m.robot, m.joints)
    m.stage.path(msg)
    tips, _ = shapes.poses_to_arrays(msg.tip_poses)
    places = plans.link_places(m.robot, m.joints)
    points = np.vstack([tips, [place for place in places.values() if place[2] > tips[:, 2].min()]])
    box = framing.corners(points.min(axis=0) - 0.12, points.max(axis=0) + 0.17)
    panels = [
        ("from the front right", m.stage.take(["Path", "Robot"], m.look(box, -0.7, 0.2))),
        ("from the right", m.stage.take(["Path", "Robot"], m.look(box, -1.75, 0.3))),
    ]
    shows = "a plan of the right arm: start green, goal orange, poses between faint"
    return Figure(panels, shows, made_by, lines("path"), {"green": 0.004, "orange": 0.004})


def _header(s: sources.Spheres) -> Header:
    return Header(frame_id=s.cap.base_frame)


def _spikes(s: sources.Spheres, rows: np.ndarray) -> list[bytes]:
    """A line for each valid point of some spheres, coloured by reachability index."""
    from capability_map.drawing import geometry

    ends, owners = geometry.spikes(s.cap, rows, length=0.9)
    rgba = np.column_stack([s.colors(), np.ones(len(s.cap.centres))])[np.repeat(owners, 2)]
    return [shapes.lines(_header(s), "spheres", ends, rgba, 0.06 * s.cap.radius)]


def _around(m: Material, rows: np.ndarray, yaw: float, pitch: float, more: float = 1.0) -> list[float]:
    """A camera that sees some spheres, and more times their extent."""
    s = m.spheres
    centers = plans.in_world(m.robot, s.cap.base_frame, m.joints, s.cap.centres[rows])
    middle, half = (
        (centers.max(axis=0) + centers.min(axis=0)) / 2.0,
        np.ptp(centers, axis=0) / 2.0 + s.cap.radius,
    )
    return m.look(framing.corners(middle - more * half, middle + more * half), yaw, pitch)


def _taken(m: Material, display: str, blobs: list[bytes], eye: list[float], robot: bool = False):
    """A picture of capability markers, with the robot or without."""
    m.stage.draw(blobs, f"/fv_viz/capability/{TOPICS[display]}")
    return m.stage.take([display, "Robot"] if robot else [display], eye)


def _structure(m: Material, s: sources.Spheres, row: int, kind: str):
    """One sphere with its structure and axis."""
    from capability_map.drawing import geometry

    center, axis, opening = s.cap.centres[row], s.fitted("axis")[row], float(s.fitted("opening_rad")[row])
    surface, _ = geometry.shape_triangles(s.cap, np.array([row]), segments=48)
    color, radius = colors.rgb("views"), s.cap.radius
    shape = shapes.marker(_header(s), "shapes", Marker.TRIANGLE_LIST, color, 0.35)
    back = 0.0 if kind == "cone" else 1.5 * radius
    ends = np.array([center - axis * back, center + axis * 1.5 * radius])
    blobs = [*_spikes(s, np.array([row])), packing.pack_marker(shape, center + 1.15 * (surface - center))]
    blobs.append(shapes.lines(_header(s), "axis", ends, color, 0.04 * radius))
    words = f"{kind}: {np.degrees(opening):.0f}° about its axis, error {s.fitted('error_percent')[row]:.0f} %"
    return words, _taken(m, "Spheres as spikes", blobs, _around(m, np.array([row]), 0.6, 0.35, 1.2))


FIGURES = {
    name.removeprefix("figure_").replace("_", "."): function
    for name, function in list(globals().items())
    if name.startswith("figure_")
}
