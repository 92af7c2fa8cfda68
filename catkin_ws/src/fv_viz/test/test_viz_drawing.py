"""Messages in, markers out."""

import io
import itertools

import numpy as np
import pytest
import viz_synthetic
from fv_msgs.msg import Ellipsoid, Evaluation, FrontierVoid, Views
from geometry_msgs.msg import Point, Quaternion, Vector3
from rospy.numpy_msg import numpy_msg
from scipy.spatial.transform import Rotation
from visualization_msgs.msg import Marker, MarkerArray

from fv_viz import viz_node
from fv_viz.config import VizConfig
from fv_viz.drawing import decisions, packing
from fv_viz.drawing.evaluation import EvaluationDrawing
from fv_viz.drawing.layers import unknown_cells, utility_values
from fv_viz.drawing.robot import RobotShapes

HEADER = viz_synthetic.HEADER
VOXEL_LAYERS = ("occupied", "free", "unknown", "frontier", "frontier_clusters", "frontier_voids", "utility")


def read(blobs):
    return MarkerArray().deserialize(packed(blobs)).markers


def packed(blobs):
    stream = io.BytesIO()
    packing.PackedMarkers(blobs).serialize(stream)
    return stream.getvalue()


@pytest.fixture(scope="module")
def evaluation():
    return viz_synthetic.evaluation(viz_synthetic.scan(0.1, [(0.2, -0.2, 0.5, 0.1)]))


@pytest.fixture
def drawing():
    out = EvaluationDrawing(VizConfig())
    out.set_bounds(viz_synthetic.LOW, viz_synthetic.HIGH)
    return out


@pytest.mark.parametrize("name", VOXEL_LAYERS)
def test_every_layer_has_triangles_in_its_own_namespace(drawing, evaluation, name):
    markers = read(getattr(drawing, name)(HEADER, evaluation, True))
    assert markers
    assert all(m.ns.startswith(name.removesuffix("s")) for m in markers)
    for marker in markers:
        assert len(marker.points) % 3 == 0
        assert len(marker.colors) * 3 == len(marker.points)
    assert any(m.points for m in markers)


@pytest.mark.parametrize("name", VOXEL_LAYERS)
def test_the_same_evaluation_again_sends_nothing(drawing, evaluation, name):
    getattr(drawing, name)(HEADER, evaluation, True)
    assert getattr(drawing, name)(HEADER, evaluation, False) == []


def test_voxels_that_are_gone_are_deleted(drawing, evaluation):
    drawing.occupied(HEADER, evaluation, False)
    markers = read(drawing.occupied(HEADER, Evaluation(resolution=evaluation.resolution), False))
    assert markers
    assert all(m.action == Marker.DELETE for m in markers)


def test_an_empty_evaluation_draws_nothing(drawing):
    for name in VOXEL_LAYERS:
        if name != "unknown":
            assert getattr(drawing, name)(HEADER, Evaluation(resolution=0.1), True) == []


def as_received(msg):
    """The message as the node gets it: sequences of numbers are read-only arrays."""
    stream = io.BytesIO()
    msg.serialize(stream)
    return numpy_msg(Evaluation)().deserialize_numpy(stream.getvalue(), np)


def shown_after(shown, blobs):
    """What RViz holds, by namespace and number, after these markers: how many points, and where the first is."""
    for marker in read(blobs):
        if marker.action == Marker.DELETEALL:
            shown = {}
        elif marker.action == Marker.DELETE:
            shown.pop((marker.ns, marker.id), None)
        else:
            corner = marker.points[0] if marker.points else marker.pose.position
            shown[marker.ns, marker.id] = marker.ns, len(marker.points), corner.x, corner.y, corner.z
    return shown


GROUPS = {
    "frontier": ("frontier", "frontier_cluster"),
    "void": ("void", "void_ellipsoid", "ellipsoids", "initial_ellipsoids", "frontier_voids"),
    "utility": ("utility_points", "utility", "utility_direction"),
    "known": ("occupied", "free"),
}


def few_voxels():
    """An evaluation with a few voxels of each kind, which lie in two blocks."""
    rng = np.random.default_rng(4)
    size = 0.1
    frontier, void, free, occupied, useful = (
        ((rng.integers((4, 0, 0), (12, 8, 8), (12, 3)) + 0.5) * size).astype(np.float32).ravel()
        for _ in range(5)
    )
    ellipsoid = Ellipsoid(Point(), Quaternion(w=1.0), Vector3(0.2, 0.1, 0.1), 12, 0.8)
    return Evaluation(
        resolution=size,
        **{"frontier": frontier, "void": void, "free": free, "occupied": occupied, "utility_points": useful},
        frontier_cluster=np.arange(12, dtype=np.uint32) % 2,
        void_ellipsoid=np.zeros(12, dtype=np.uint32),
        ellipsoids=[ellipsoid],
        initial_ellipsoids=[ellipsoid, ellipsoid],
        frontier_voids=[FrontierVoid(0, np.array([1], dtype=np.uint32))],
        utility=rng.uniform(0.1, 1.0, 12).astype(np.float32),
        utility_direction=np.tile(np.float32([0, 0, 1]), 12),
    )


def emptied(evaluation, kept):
    """The evaluation with only these of its groups of sequences filled."""
    fields = [field for group in kept for field in GROUPS[group]]
    return Evaluation(resolution=evaluation.resolution, **{f: getattr(evaluation, f) for f in fields})


@pytest.mark.parametrize("first", [(), tuple(GROUPS)])
def test_sequences_that_become_empty_or_filled_leave_what_a_new_display_would_show(first):
    evaluation = few_voxels()
    names = [n for n in viz_node.EVALUATION_LAYERS if n != "void"]
    for count in range(len(GROUPS) + 1):
        for kept in itertools.combinations(GROUPS, count):
            old, new = (EvaluationDrawing(VizConfig(block_voxels=8)) for _ in range(2))
            for drawing in (old, new):
                drawing.set_bounds(np.zeros(3), np.array([1.2, 0.8, 0.8]))
            messages = [as_received(emptied(evaluation, part)) for part in (first, kept)]
            for name in names:
                shown = {}
                for number, message in enumerate(messages):
                    shown = shown_after(shown, getattr(old, name)(HEADER, message, number == 0))
                expected = shown_after({}, getattr(new, name)(HEADER, messages[-1], True))
                assert sorted(shown.values()) == sorted(expected.values()), (name, kept)
            cloud = old.void(HEADER, messages[-1], False)
            assert bool(cloud.width) == ("void" in kept)


def test_broken_lists_are_refused(drawing):
    with pytest.raises(ValueError, match="triples"):
        drawing.occupied(HEADER, Evaluation(resolution=0.1, occupied=[1.0, 2.0]), False)
    with pytest.raises(ValueError, match="resolution"):
        drawing.occupied(HEADER, Evaluation(occupied=[1.0, 2.0, 3.0]), False)


def test_a_void_and_its_frontiers_share_a_colour(drawing, evaluation):
    markers = read(drawing.frontier_voids(HEADER, evaluation, True))
    hue = {}
    for kind in ("void", "frontier"):
        colors = [c for m in markers if m.ns == f"frontier_void/{kind}" for c in m.colors]
        hue[kind] = {(round(c.r / (c.r + c.g + c.b), 2), round(c.g / (c.r + c.g + c.b), 2)) for c in colors}
    assert hue["frontier"]
    assert hue["frontier"] <= hue["void"]


def test_unknown_is_what_is_neither_free_nor_occupied():
    known = np.array([[0.05, 0.05, 0.05], [5.0, 5.0, 5.0]])
    first, cells = unknown_cells((0.1, -0.2, 0), (0.4, 0.1, 0.1), 0.1, known + 0.1)
    assert first.tolist() == [0, -2, 1]
    assert cells.shape == (1, 3, 3)
    assert cells.sum() == 9
    _, cells = unknown_cells((0, 0, 0), (0.3, 0.2, 0.1), 0.1, known)
    assert cells.sum() == 3 * 2 * 1 - 1
    assert cells[0, 0, 0] == 0


def test_the_roof_has_a_namespace_of_its_own(drawing):
    top, middle = viz_synthetic.HIGH - 0.05, (viz_synthetic.LOW + viz_synthetic.HIGH) / 2.0
    msg = Evaluation(resolution=0.1, occupied=[*top, *middle])
    heights = {m.ns: max(p.z for p in m.points) for m in read(drawing.occupied(HEADER, msg, True))}
    assert heights["occupied_roof"] > heights["occupied"]


def test_low_and_nan_utilities_are_not_drawn():
    assert utility_values(np.array([1.0, 0.5, 0.01, np.nan, np.inf]), 4, 0.05).tolist() == [4, 2, 0, 0, 0]
    assert utility_values(np.zeros(3), 4, 0.05).tolist() == [0, 0, 0]


def test_views_show_pyramids_and_scores(evaluation):
    msg, config = viz_synthetic.views(evaluation), VizConfig(max_view_scores=3)
    markers = read(decisions.views(HEADER, msg, config))
    assert len(markers[1].points) == 20 * len(msg.views)
    ranks = [int(m.text.split(":")[0]) for m in markers[2:]]
    assert ranks[0] == 1
    assert ranks == sorted(ranks)
    assert len(ranks) <= 3
    assert len(read(decisions.chosen_view(HEADER, msg, config))) == 5


def test_what_the_next_view_is_expected_to_show_says_which_volume_is_meant(evaluation):
    view = viz_synthetic.views(evaluation).views[0]
    view.void_gain, view.unknown_gain = 0.618, 1.902
    assert decisions.expectation(view) == "1.9 m³ unseen, 0.62 m³ of it void"


def test_scores_that_would_cover_each_other_are_left_out():
    line = np.column_stack([[0.0, 0.1, 0.3, 0.35, 0.9], np.zeros(5), np.zeros(5)])
    assert decisions.apart(line, 0.25, 10) == [0, 2, 4]
    assert decisions.apart(line, 0.25, 2) == [0, 2]
    assert decisions.apart(line, 0.0, 0) == []


def test_the_pyramid_opens_along_the_view(evaluation):
    msg = viz_synthetic.views(evaluation)
    chosen = read(decisions.chosen_view(HEADER, msg, VizConfig()))
    apex, end = (np.array([p.x, p.y, p.z]) for p in chosen[3].points)
    turn = msg.views[0].pose.orientation
    target = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()[:, 2]
    np.testing.assert_allclose((end - apex) / np.linalg.norm(end - apex), target, atol=1e-5)


def test_no_views_and_nothing_chosen_clear_the_display(evaluation):
    assert len(decisions.views(HEADER, Views(chosen=-1), VizConfig())) == 1
    assert len(decisions.chosen_view(HEADER, Views(chosen=-1), VizConfig())) == 1
    wrong = viz_synthetic.views(evaluation)
    wrong.chosen = 99
    assert len(decisions.chosen_view(HEADER, wrong, VizConfig())) == 1


def test_a_pose_nobody_filled_in_does_not_stop_the_drawing(evaluation):
    msg = viz_synthetic.views(evaluation)
    msg.views[0].pose.orientation.w = msg.views[0].pose.orientation.x = 0.0
    msg.views[0].pose.orientation.y = msg.views[0].pose.orientation.z = 0.0
    markers = read(decisions.views(HEADER, msg, VizConfig()))
    assert all(np.isfinite([p.x, p.y, p.z]).all() for p in markers[1].points)


def test_ghosts_stand_at_start_and_goal():
    model, msg = RobotShapes(viz_synthetic.urdf()), viz_synthetic.path()
    markers = read(decisions.path(HEADER, msg, VizConfig(ghosts=3), model, {}))
    ghosts = [m for m in markers if m.ns == "ghosts"]
    assert len(ghosts) == 3 * 3
    goal = model.link_poses(
        dict(zip(msg.trajectory.joint_names, msg.trajectory.points[-1].positions, strict=True))
    )
    middle = goal["l2"] @ np.array([0.15, 0, 0, 1])
    at = ghosts[-1].pose.position
    np.testing.assert_allclose([at.x, at.y, at.z], middle[:3], atol=1e-9)


def test_bounds_clearance_and_contacts():
    names = [m.ns for m in read(decisions.volume(HEADER, viz_synthetic.volume()))]
    assert names == ["", "bounds", "clearance/edges", "clearance", "clearance"]
    touching = read(decisions.contacts(HEADER, viz_synthetic.contacts(True)))
    assert touching[1].header.frame_id == "l2"
    assert len(read(decisions.contacts(HEADER, viz_synthetic.contacts(False)))) == 1
