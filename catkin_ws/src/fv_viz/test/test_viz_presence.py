"""What legends list, and which decisions are old news."""

import pytest
import rospy
import viz_synthetic
from fv_msgs.msg import Contacts, Evaluation, ExplorationVolume, Views
from std_msgs.msg import Header

from fv_viz import presence


@pytest.fixture
def messages():
    evaluation = viz_synthetic.evaluation(viz_synthetic.scan(0.1, [(0.2, 0.0, 0.5, 0.1)]))
    return {
        "evaluation": evaluation,
        "views": viz_synthetic.views(evaluation),
        "path": viz_synthetic.path(),
        "volume": viz_synthetic.volume(),
        "contacts": viz_synthetic.contacts(True),
    }


def stamp(message, seconds):
    message.header = Header(frame_id="world", stamp=rospy.Time(seconds))
    return message


def test_everything_that_is_there_is_listed(messages):
    assert presence.filled(messages) >= {"occupied", "unknown", "utility", "views", "chosen_view", "path"}
    assert presence.filled(messages) >= {"volume", "clearance", "contacts"}


def test_nothing_and_empty_messages_list_nothing():
    assert presence.filled({}) == set()
    empty = {"evaluation": Evaluation(), "views": Views(chosen=-1), "contacts": Contacts()}
    assert presence.filled(empty) == set()
    assert presence.filled({"volume": ExplorationVolume()}) == {"volume"}


def test_a_decision_ends_with_the_next_evaluation(messages):
    for name, seconds in (("views", 12), ("path", 12), ("evaluation", 10)):
        stamp(messages[name], seconds)
    assert not presence.is_stale(messages, "views")
    stamp(messages["evaluation"], 13)
    assert presence.is_stale(messages, "views")
    assert presence.is_stale(messages, "path")
    assert not presence.filled(messages) & {"views", "chosen_view", "path"}
    assert not presence.is_stale(messages, "contacts")


def test_what_has_no_stamp_is_never_old(messages):
    stamp(messages["evaluation"], 13)
    assert not presence.is_stale(messages, "path")
    assert not presence.is_stale({"path": stamp(messages["path"], 1)}, "path")


def test_the_state_comes_back_from_its_text(messages):
    stamp(messages["views"], 3)
    messages["evaluation"].map_sequence = 7
    state = presence.State.of(messages)
    assert (state.map_sequence, state.views_ns) == (7, 3_000_000_000)
    assert presence.State.from_text(state.to_text()) == state
    assert "/fv_viz/occupied" in state.topics()
    assert presence.State.of({}) == presence.State()
