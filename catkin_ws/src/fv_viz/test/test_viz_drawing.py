"""Messages in, markers out."""

import io

import numpy as np
import pytest
import viz_synthetic
from fv_msgs.msg import Evaluation, Views
from scipy.spatial.transform import Rotation
from visualization_msgs.msg import Marker, MarkerArray

from fv_viz import decisions, packing
from fv_viz.config import VizConfig
from fv_viz.evaluation import EvaluationDrawing
from fv_viz.layers import unknown_cells, utility_values
from fv_viz.robot import RobotShapes

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
