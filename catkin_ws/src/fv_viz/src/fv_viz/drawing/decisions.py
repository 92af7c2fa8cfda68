"""Drawing of what was decided: candidate views, the chosen one, the path, the exploration volume, contacts."""

from __future__ import annotations

import numpy as np
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from fv_viz.config import VizConfig
from fv_viz.drawing import colors, packing, shapes
from fv_viz.drawing.robot import RobotShapes

DARK = (0.1, 0.1, 0.1)


def views(header: Header, msg, config: VizConfig) -> list[bytes]:
    """Candidate views as pyramids, light to dark by score; the best carry their score."""
    out = [shapes.clear(header)]
    positions, matrices = shapes.poses_to_arrays([view.pose for view in msg.views])
    valid = np.isfinite(positions).all(axis=1) & np.isfinite(matrices).all(
        axis=(1, 2)
    )  # RViz drops a list with NaN
    scores = np.nan_to_num(np.array([view.score for view in msg.views], dtype=float))[valid]
    if not len(scores):
        return out
    pyramid = shapes.pyramid_points(msg.horizontal_fov, msg.vertical_fov, config.view_size_m)
    edges = shapes.pyramid_edges(pyramid, positions[valid], matrices[valid])
    share = np.clip(scores / max(scores.max(), 1e-12), 0.0, 1.0)
    rgba = np.column_stack([colors.rgb("views") + (1.0 - share[:, None]) * 0.55, np.ones(len(share))])
    rgba = np.repeat(np.clip(rgba, 0.0, 1.0), edges.shape[1], axis=0)
    out.append(shapes.lines(header, "views", edges.reshape(-1, 3), rgba, config.view_size_m / 20))
    ranks, height = np.flatnonzero(valid) + 1, 0.6 * config.view_size_m
    places = edges.mean(axis=1) + np.array([0.0, 0.0, 1.2 * config.view_size_m])
    for number in apart(places, 5.0 * height, config.max_view_scores):
        words = f"{ranks[number]}: {scores[number]:.2g}"
        out.append(shapes.text(header, "view_scores", places[number], words, height, DARK, number))
    return out


def apart(places: np.ndarray, distance_m: float, most: int) -> list[int]:
    """At most so many rows of places (N, 3) [m], the first ones, none nearer to another than the distance."""
    kept: list[int] = []
    for number, place in enumerate(places):
        if len(kept) < most and all(np.linalg.norm(place - places[k]) >= distance_m for k in kept):
            kept.append(number)
    return kept


def chosen_view(header: Header, msg, config: VizConfig) -> list[bytes]:
    """The view that is executed next: large pyramid and its line of sight."""
    out = [shapes.clear(header)]
    if not 0 <= msg.chosen < len(msg.views):
        return out
    view = msg.views[msg.chosen]
    positions, matrices = shapes.poses_to_arrays([view.pose])
    if not np.isfinite(matrices).all():
        return out
    pyramid = shapes.pyramid_points(msg.horizontal_fov, msg.vertical_fov, 2.5 * config.view_size_m)
    color, width = colors.rgb("chosen_view"), config.view_size_m / 10
    edges = shapes.pyramid_edges(pyramid, positions, matrices)[0]
    faces = shapes.marker(header, "chosen_view/cone", Marker.TRIANGLE_LIST, color, 0.25)
    sight = np.vstack([positions[0], positions[0] + matrices[0][:, 2] * (msg.max_range or 1.0)])
    at = positions[0] + np.array([0.0, 0.0, 2.0 * config.view_size_m])
    return [
        *out,
        shapes.lines(header, "chosen_view", edges, color, width),
        packing.pack_marker(faces, shapes.pyramid_faces(pyramid, positions[0], matrices[0])),
        shapes.lines(header, "chosen_view/sight", sight, color, width / 3),
        shapes.text(header, "chosen_view/text", at, "next", 0.8 * config.view_size_m, color),
    ]


def expectation(view) -> str:
    """What a view is expected to show, in words: the volume that is unseen yet, and how much of it is void.

    Neither is what the explorer goes by: that weighs the two, and trusts some views less.
    """
    return f"{view.unknown_gain:.2g} m³ unseen, {view.void_gain:.2g} m³ of it void"


def path(
    header: Header, msg, config: VizConfig, robot: RobotShapes | None, positions: dict[str, float]
) -> list[bytes]:
    """The tip's way as a line, and the robot as ghosts: start and goal in their colours, faint between them.

    positions: where the joints that the trajectory does not name stand.
    """
    out = [shapes.clear(header)]
    tips, _ = shapes.poses_to_arrays(msg.tip_poses)
    if len(tips) > 1:
        segments = np.repeat(tips, 2, axis=0)[1:-1]
        out.append(shapes.lines(header, "path", segments, colors.rgb("path"), config.view_size_m / 8))
    if robot is not None and msg.trajectory.points and config.ghosts:
        out += ghosts(msg.trajectory, config.ghosts, robot, positions)
    return out


def ghosts(trajectory, count: int, robot: RobotShapes, positions: dict[str, float]) -> list[bytes]:
    """Robot poses at equal joint-space distances of a trajectory; only the links that it moves."""
    names = list(trajectory.joint_names)
    way = np.array([point.positions for point in trajectory.points], dtype=float)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1))])
    moved, out = robot.moved_by(names), []
    shares = np.linspace(0.0, 1.0, count) if count > 1 else np.array([1.0])
    for share in shares:
        at = [np.interp(share * length[-1], length, way[:, k]) for k in range(len(names))]
        tone = {0.0: colors.rgb("start"), 1.0: colors.rgb("goal")}.get(float(share), DARK)
        alpha = 0.6 if share in (0.0, 1.0) else 0.12
        one = {**positions, **dict(zip(names, at, strict=True))}
        out += robot.markers("ghosts", one, tone, alpha, len(out), moved)
    return out


def volume(header: Header, msg) -> list[bytes]:
    """Edges of the exploration volume; clearance boxes and spheres, which the operator vouches for."""
    low, high = corners(msg.bounds)
    out = [
        shapes.clear(header),
        shapes.lines(header, "bounds", shapes.box_edges(low, high), colors.rgb("bounds"), 0.012),
    ]
    color = colors.rgb("clearance")
    for number, one in enumerate(msg.clearance_boxes):
        ends = corners(one)
        out.append(shapes.lines(header, "clearance/edges", shapes.box_edges(*ends), color, 0.008, number))
        out.append(shapes.box(header, "clearance", *ends, color, 0.12, number))
    first = len(msg.clearance_boxes)
    for number, (center, radius) in enumerate(
        zip(msg.clearance_centers, msg.clearance_radii, strict=False), first
    ):
        ball = shapes.marker(header, "clearance", Marker.SPHERE, color, 0.2, number)
        ball.pose.position = center
        ball.scale.x = ball.scale.y = ball.scale.z = 2.0 * radius
        out.append(packing.pack_marker(ball))
    return out


def contacts(header: Header, msg) -> list[bytes]:
    """A red ball at each link in contact, with the names of both; empty when nothing touches."""
    out = [shapes.clear(header)]
    for number, pair in enumerate(msg.pairs):
        link = Header(frame_id=pair.split("|")[0])
        ball = shapes.marker(link, "contacts", Marker.SPHERE, colors.rgb("contacts"), 0.6, number)
        ball.scale.x = ball.scale.y = ball.scale.z = 0.15
        words = pair.replace("|", " touches ")
        out += [
            packing.pack_marker(ball),
            shapes.text(link, "contacts/text", (0, 0, 0.15), words, 0.05, DARK, number),
        ]
    return out


def corners(box) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corner (3,) of a fv_msgs/Box."""
    return tuple(np.array([p.x, p.y, p.z]) for p in (box.min, box.max))
