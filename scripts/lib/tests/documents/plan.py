"""How a test runs the commands of the documents: what stands for a placeholder, what is shortened, what goes on.

What is not named here is run as it stands, and must end with code 0. Texts are those of `documents.commands_of`. Every
entry must be in use; a test looks for those that no document needs any more.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from documents import ROOT

SHORT_RUN = "--views 1 --no-screenshots --no-truth"
TINY = "--radius 0.3 --points 20"  # of a capability map
ARM = "my_arm"  # the reader's own robot


@dataclass(frozen=True)
class Entry:
    """One command of the documents.

    :param form: what is run in its place; empty: the command itself, with PLACEHOLDERS filled in.
    :param why: the reason for a form.
    :param ready: for a command that goes on, how one sees that it does: the topic or service that it offers or reads
        (with a slash), a text that it says, or empty for the master, which answers.
    :param until: a command that goes on, and a text that its output has at last: waited for when this one has ended.
    :param timeout_s: for one that ends; several times what it takes on two cores without other load.
    """

    form: str = ""
    why: str = ""
    ready: str | None = None
    until: tuple[str, str] | None = None
    timeout_s: float = 240.0


PLACEHOLDERS = {
    "FOLDER": ARM,  # a changed copy of the youBot arm: see CHANGES
    "RUN...": "run2",
    "RUN_DIR": "run",
    "RUN": "run",  # left by the first command of README.md, else by BEFORE
    "DIR": "made",
    "HOST": "localhost",
    "NAME": "hubo",
}

NOT_HERE = "the tests that are running are these; what it takes is checked by its --help"
MEASURES = "measures for minutes; README.md's own line is run, here only the names are checked"
MAP = "data/capability_maps/hubo_right_arm.h5"
CHECK_BENCHES = (
    "PYTHONPATH=scripts/lib python3 -c 'import run_bench, sys; run_bench.parse_arguments(sys.argv[1:])' "
)

GOAL = (
    "rostopic pub -1 /explore/goal fv_msgs/ExploreActionGoal '{goal: {bounds: {min: {x: -0.5, y: -1.1, z: 0.1},\n"
    "  max: {x: 1.8, y: 0.9, z: 1.6}}, max_views: 20, seed: 1}}'"
)

FIRST_VIEW = (
    "rostopic pub -1 /explore/goal fv_msgs/ExploreActionGoal '{goal: {bounds: {min: {x: -0.6, y: -1.0, z: 0.1},\n"
    "  max: {x: 1.4, y: 1.0, z: 2.1}}, max_views: 1, seed: 1}}'"
)

ENTRIES: dict[str, Entry] = {
    # scripts
    "scripts/explore": Entry(f"scripts/explore {SHORT_RUN} --record --out run", "a whole one takes minutes"),
    "scripts/explore --world office --robot hubo --seed 1": Entry(
        f"scripts/explore --world office --robot hubo --seed 1 {SHORT_RUN} --out run2",
        "a whole one takes minutes",
    ),
    "scripts/explore --robot kuka_iiwa --world tabletop:1": Entry(
        "cp -r catkin_ws/src/hubo_description/robots/kuka_iiwa kuka; "
        "sed -i 's/capability_group: .*/capability_group: \"\"/' kuka/robot.yaml; "
        f"scripts/explore --robot kuka --world tabletop:1 {SHORT_RUN} --out run_kuka",
        "a whole one takes minutes, and its capability map some more",
    ),
    "scripts/explore --robot FOLDER --world tabletop:1": Entry(
        f"scripts/explore --robot {ARM} --world tabletop:1 {SHORT_RUN} --out run_arm",
        "a whole one takes minutes",
    ),
    "scripts/explore --shared-network": Entry(
        f"scripts/explore --shared-network --robot free_camera --world empty {SHORT_RUN} --out $(mktemp -d -p .)",
        "a whole one takes minutes",
    ),
    "PYTHONPATH=$PWD/examples scripts/explore --policy nearest_frontier:NearestFrontier": Entry(
        f"PYTHONPATH={ROOT}/examples scripts/explore --policy nearest_frontier:NearestFrontier "
        f"--robot free_camera --world empty {SHORT_RUN} --out $(mktemp -d -p .)",
        "a whole one takes minutes",
    ),
    "python3 scripts/lib/own_network.py rosrun fv_viz replay RUN": Entry(
        "python3 scripts/lib/own_network.py rosrun fv_viz replay run --rate 20", "a run is as long as it was"
    ),
    "scripts/test": Entry("scripts/test --help", NOT_HERE),
    "scripts/test [--fast] [--sanitize] [--fuzz MINUTES] [PACKAGE...]": Entry(
        "scripts/test --help", NOT_HERE
    ),
    "scripts/test --sanitize": Entry("scripts/test --help | grep -e --sanitize", NOT_HERE),
    "scripts/bench [NAME...] [--quick] [--json FILE]": Entry(
        "scripts/bench gain --quick --json rows.json", "all of them measure for many minutes"
    ),
    "scripts/figures [--only 3.1,5.7] [--out DIR]": Entry("scripts/figures --only 3.1,5.7 --out figures"),
    "rosrun fv_figures figures": Entry(
        "rosrun fv_figures figures --only 3.1 --out figure", "all of them take minutes"
    ),
    "pytest test": Entry('ls "$(rospack find PACKAGE)"/test/test_*.py', "scripts/test runs it"),
    "rostest test/viz.test": Entry('ls "$(rospack find fv_viz)/test/viz.test"', "scripts/test runs it"),
    "rostest hubo_sim sim.test": Entry('ls "$(rospack find hubo_sim)/test/sim.test"', "scripts/test runs it"),
    # commands that end
    "rosrun fv_viz replay RUN": Entry("rosrun fv_viz replay run --rate 20", "a run is as long as it was"),
    "rostopic list": Entry("! rostopic list", "the page says that it must fail; no master runs there"),
    "rosrun fv_viz replay BAG": Entry(
        "rosrun fv_viz replay run/recording.bag --rate 20", "a run is as long as it was"
    ),
    "rosrun fv_viz to_mcap BAG DIR": Entry("rosrun fv_viz to_mcap run/recording.bag mcap"),
    "rosrun fv_viz compare RUN_DIR...": Entry("rosrun fv_viz compare run run2 --out compared.html"),
    "rosrun fv_exploration evaluate_cloud FILE...": Entry("rosrun fv_exploration evaluate_cloud sphere.pcd"),
    "rosrun fv_exploration evaluate_cloud FILE... --out DIR": Entry(
        "rosrun fv_exploration evaluate_cloud sphere.pcd --out clouds"
    ),
    "rosrun capability_map build --robot kuka_iiwa --dask tcp://HOST:8786": Entry(
        f"rosrun capability_map build --robot kuka_iiwa --dask tcp://localhost:8786 {TINY} --out kuka.h5",
        "at full size it takes many minutes",
    ),
    "rosrun capability_map build --all": Entry(
        f"FV_DATA=$PWD/all rosrun capability_map build --all {TINY}",
        "at full size they take an hour",
    ),
    "rosrun capability_map info FILE": Entry(f"rosrun capability_map info {MAP}"),
    "rosrun capability_map check FILE": Entry(
        f"rosrun capability_map check {MAP} --views 500", "20,000 take long"
    ),
    "rosrun capability_map show FILE": Entry(f"rosrun capability_map show {MAP} --out pictures"),
    "rosrun capability_map query FILE < VIEWS": Entry(
        f"echo '0.2 -0.2 0.1 1 0 0' >views; rosrun capability_map query {MAP} <views"
    ),
    "rosrun hubo_description compute_disabled_pairs --robot hubo --samples 20000": Entry(
        "cp -r catkin_ws/src/hubo_description/robots/hubo hubo_copy; "
        "rosrun hubo_description compute_disabled_pairs --robot hubo_copy --samples 500",
        "it writes into the robot's folder",
    ),
    "rosrun hubo_sim ground_truth --world shelf --robot hubo --resolution 0.05": Entry(
        "rosrun hubo_sim ground_truth --world empty --robot hubo --resolution 0.1 --no-observable",
        "meshes, and what a camera could see, take minutes",
    ),
    # commands that go on
    "roscore": Entry("roscore -p PORT", "two of these tests may run at a time", ready=""),
    "dask scheduler": Entry(ready="Scheduler at"),
    "dask worker tcp://HOST:8786": Entry(ready="Registered to"),
    "rosrun hubo_sim sim_node _world:=shelf": Entry(ready="/joint_states"),
    "rosrun hubo_sim sim_node _world:=tabletop:1": Entry(ready="/joint_states"),
    "rosrun hubo_sim sim_node _world:=office _seed:=1 _lockstep:=true _real_time_factor:=0": Entry(
        ready="/joint_states"
    ),
    "rosrun robot_state_publisher robot_state_publisher": Entry(ready="/tf"),
    "rosrun tf2_ros static_transform_publisher 0 0 0.6 0 0 0 world base_link": Entry(ready="/tf_static"),
    "rosrun ompl_planner planner_node": Entry(ready="/ompl_planner/plan/status"),
    "rosrun fv_exploration explore_node": Entry(ready="/explore/status"),
    "rosrun fv_exploration explore_node _map_frame:=world _out_dir:=$PWD/run": Entry(ready="/explore/status"),
    "rosrun fv_viz viz_node": Entry(ready="/fv_viz/state"),
    "rosrun fv_viz screenshot_node _out_dir:=DIR": Entry(ready="/fv_viz/screenshot"),
    "rosrun fv_viz record FILE": Entry(
        "rosrun fv_viz record recorded.bag", ready="/fv_exploration/evaluation"
    ),
    "rosrun capability_map capability_node": Entry(ready="/capability_map/query"),
    "rosrun capability_map capability_node _map:=FILE": Entry(
        f"rosrun capability_map capability_node _map:={MAP}", ready="/capability_map/query"
    ),
    "rostopic echo /explore/feedback": Entry(ready="/explore/feedback"),
    "rostopic echo /explore/result": Entry(ready="/explore/result"),
    # two views: the arm has moved. Then the page's next command cancels.
    GOAL: Entry(until=("rostopic echo /explore/feedback", "views: 2")),
    "rostopic pub -1 /explore/cancel actionlib_msgs/GoalID -- {}": Entry(
        until=("rostopic echo /explore/result", "it was cancelled")
    ),
}


def entry_of(text: str) -> Entry:
    """How a command is run; one without an entry as it stands, and benches by their names."""
    names = text.removeprefix("scripts/bench ")
    if text not in ENTRIES and names != text:
        return Entry(CHECK_BENCHES + names, MEASURES)
    return ENTRIES.get(text, Entry())


# What the sentences around the commands ask for, when nothing before in the same document has done it.
RUNS = f"test -e run || scripts/explore {SHORT_RUN} --record --out run; test -e run2 || cp -r run run2"
BEFORE: dict[str, list[str]] = {
    "interfaces.md": ["roscore"],
    "capability_map": ["roscore"],
    "security.md": [RUNS],
    "fv_viz": [RUNS, "roscore", "rosrun hubo_description upload_robot --robot hubo"],
    "hubo_description": ["roscore"],
    "hubo_sim": ["roscore"],
}


def own_robot(folder: Path) -> None:
    """Change the copied robot as docs/own_robot.md says: a name and limits of its own."""
    config = folder / ARM / "robot.yaml"
    config.write_text(config.read_text().replace("name: youbot_arm", f"name: {ARM}"))
    limits = folder / ARM / "joint_limits.yaml"
    limits.write_text(limits.read_text().replace("max_velocity: 1.57", "max_velocity: 1.2"))


AFTER: dict[str, Callable[[Path], None]] = {
    "cp -r catkin_ws/src/hubo_description/robots/youbot_arm FOLDER": own_robot,
}

HEAP = """
description: boxes that lean on fences
bounds: {min_m: [-1, -1, 0], max_m: [1, 1, 1]}
objects:
  - {name: floor, box: {size_m: [4, 4, 0.1]}, position_m: [0, 0, -0.05]}
  - {name: left, box: {size_m: [0.02, 0.6, 0.6]}, position_m: [-0.3, 0, 0.3]}
  - {name: right, box: {size_m: [0.02, 0.6, 0.6]}, position_m: [0.3, 0, 0.3]}
  - {name: low, box: {size_m: [0.2, 0.2, 0.2]}, mass_kg: 1.0, position_m: [0, 0, 0.12]}
  - {name: high, box: {size_m: [0.2, 0.2, 0.2]}, mass_kg: 1.0, position_m: [0.05, 0, 0.35]}
"""


def write_inputs(folder: Path) -> None:
    """The files that the commands read and no command before has made."""
    (folder / "heap.yaml").write_text(HEAP)
    rng = random.Random(1)
    points = []
    for _ in range(2000):  # a bowl in front of a camera at the origin
        azimuth, polar = rng.uniform(0, 2 * math.pi), rng.uniform(0, 0.6)
        ring = 1.5 * math.sin(polar)
        points.append((ring * math.cos(azimuth), ring * math.sin(azimuth), 1.5 * math.cos(polar)))
    header = (
        "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {0}\nHEIGHT 1\n"
        "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA ascii\n"
    )
    rows = "".join(f"{x:.4f} {y:.4f} {z:.4f}\n" for x, y, z in points)
    (folder / "sphere.pcd").write_text(header.format(len(points)) + rows)
