"""Warnings that nodes have written to their logs, and what a run tells of them."""

import exploration_run
from log_warnings import logged
from progress import Progress

from fv_common.ros_session import SessionError

LOG = """[ INFO] [1700000000.123456789]: planning
\x1b[33m[ WARN] [1700000000.123456789, 12.500000000]: map not usable: sequence 0\x1b[0m
\x1b[31m[ERROR] [1700000001.123456789]: controller right_hand is away\x1b[0m
[WARN] [1700000002.5, 13.25]: joints are 0.5 s away
[WARN] [1700000003.5, 14.25]: joints are 0.75 s away
[ERROR] [1700000003.5]: exploration failed: nothing is there
UserWarning: [not a log line]
"""


def test_warnings_and_errors_of_all_logs_are_found_once(tmp_path):
    (tmp_path / "planner_node.log").write_text(LOG)
    (tmp_path / "sim_node.log").write_bytes(b"\xff\xfe\n[FATAL] [1.0]: no world\n")
    (tmp_path / "other.txt").write_text(LOG)
    assert logged(tmp_path, known=["nothing is there"]) == [
        "planner_node: map not usable: sequence 0",
        "planner_node: controller right_hand is away",
        "planner_node: joints are 0.5 s away (2 times)",
        "sim_node: no world",
    ]


def test_what_the_result_tells_is_not_repeated(tmp_path):
    (tmp_path / "explore_node.log").write_text("[WARN] [1.0]: joints are 0.5 s away\n")
    assert logged(tmp_path, known=["joints are 0.5 s away (3 times)"]) == []
    assert logged(tmp_path / "nowhere") == []


def test_a_picture_that_fails_takes_nothing_from_the_run(capsys):
    def fails():
        raise SessionError("render_scene failed:\n    no world")

    progress = Progress()
    assert exploration_run.unless_it_fails(progress, fails) is None
    assert exploration_run.unless_it_fails(progress, lambda a: a + 1, 2) == 3
    assert progress.warnings == ["render_scene failed: no world"]
    assert "warning: render_scene failed: no world" in capsys.readouterr().out


def test_a_failed_run_says_so_with_its_first_warnings(tmp_path):
    record = {
        "result": "FAILED",
        "reason": "the robot cannot move",
        "views": 0,
        "wall_s": 3.0,
        "known_share": 0.01,
        "explored_share": None,
        "contacts": None,
        "warnings": [f"warning {letter}" for letter in "abcdefg"],
    }
    lines = exploration_run.summary(record, tmp_path).splitlines()
    assert lines[0] == "Failed after 0 views in 3 s: the robot cannot move."
    assert "Warning: warning e" in lines
    assert not any("warning f" in line for line in lines)
    assert any("2 more warnings" in line for line in lines)
