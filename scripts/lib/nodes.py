"""The nodes of an exploration, and what a script asks of them."""

from __future__ import annotations

import argparse
import importlib.metadata
import subprocess
import time
from pathlib import Path
from typing import Any

import actionlib
import rospy
import yaml
from fv_msgs.msg import Box, Contacts, ExploreAction, ExploreGoal, ExploreResult
from fv_msgs.srv import Screenshot
from geometry_msgs.msg import Point
from progress import Progress, bar

from capability_map import default_map_path
from capability_map.robots import load_arm
from fv_common.errors import ConfigError
from fv_common.ros_session import RosSession, SessionError
from fv_common.schema import from_mapping
from fv_common.yaml_file import read_yaml
from fv_exploration.explore_config import ExploreConfig
from fv_exploration.strategy import load_strategy
from fv_robot_model.ik import make_ik_solver
from hubo_description import RobotDescriptionError, load_robot
from hubo_description.check import check_explorer
from hubo_sim.errors import SimError
from hubo_sim.worlds import load_world

ROOT = Path(__file__).resolve().parents[2]
STATUS_NAMES = {
    getattr(ExploreResult, name): name
    for name in ("COMPLETE", "VIEW_BUDGET", "TIME_BUDGET", "CANCELLED", "FAILED")
}
RECORDING = "recording.bag"
VIDEO = "scene.gif"
CANCEL_TIMEOUT_S = 60.0
PICTURE_TIMEOUT_S = 60.0


def read_config(arguments: argparse.Namespace) -> dict[str, Any]:
    """Explorer parameters: the shipped defaults, a user's file over them, the command line over both."""
    values = yaml.safe_load((ROOT / "catkin_ws/src/fv_exploration/config/exploration.yaml").read_text())
    for section, content in (read_overlay(arguments.config) if arguments.config else {}).items():
        known = isinstance(content, dict) and isinstance(values.get(section), dict)
        values[section] = {**values[section], **content} if known else content
    if arguments.policy and arguments.policy != values["policy"]:
        values["policy"], values["policy_parameters"] = arguments.policy, {}  # those of the other
    try:
        config = from_mapping(ExploreConfig, values, "exploration parameters")
        load_strategy(config.policy, config.policy_parameters)  # said now if there is none
    except ValueError as error:
        raise SessionError(str(error)) from error
    values["map"]["resolution_m"] = arguments.resolution or values["map"]["resolution_m"]
    values["stop"]["max_views"] = arguments.views or values["stop"]["max_views"]
    values["stop"]["max_seconds"] = arguments.seconds or values["stop"]["max_seconds"]
    if not arguments.no_screenshots:
        values["snapshot_service"] = "/fv_viz/screenshot"
    return values


def read_overlay(path: Path) -> dict[str, Any]:
    """A user's file of parameters; SessionError of one line when it cannot be read."""
    try:
        overlay = read_yaml(path) or {}
    except ConfigError as error:
        raise SessionError(f"--config {error}") from error
    if not isinstance(overlay, dict):
        raise SessionError(f"--config {path}: a mapping of parameters is needed, got {overlay!r:.60}")
    return overlay


class ExplorationNodes:
    """Starts what an exploration needs, runs it, and asks for pictures, contacts and the truth.

    :param arguments: the command line of scripts/explore.
    :raises SessionError: for an unknown world or robot, or a broken file, before anything is started.
    """

    def __init__(self, arguments: argparse.Namespace) -> None:
        self._arguments = arguments
        self._session: RosSession | None = None
        self.has_capability_map = False
        self.config = read_config(arguments)
        try:
            self.robot = load_robot(arguments.robot)
            check_explorer(self.robot)
            self.world = load_world(arguments.world)
        except (RobotDescriptionError, SimError) as error:
            raise SessionError(str(error)) from error
        self.camera = camera = self.robot.sensors[self.robot.config.exploration.camera]
        self.config["scan"]["cloud_topic"] = f"{camera.topic}/depth/points"
        self.config["scan"]["trigger_service"] = f"{camera.topic}/trigger"

    def start(self, session: RosSession, folder: Path, progress: Progress) -> None:
        """Start every node; results go to the folder."""
        self._session = session
        arguments = self._arguments
        self.has_capability_map = self._require_capability_map(progress)
        rospy.set_param("/use_sim_time", True)  # before the node: it asks once
        rospy.init_node("explore_script", anonymous=True, disable_signals=True)
        rospy.set_param("/fv_exploration/config", self.config)
        rospy.set_param("/fv_exploration/out_dir", str(folder))
        session.run_once("hubo_description", "upload_robot", "--robot", arguments.robot)
        if not self.has_capability_map:
            rospy.set_param("/robot/exploration/capability_group", "")
        session.rosrun("robot_state_publisher", "robot_state_publisher")
        session.rosrun(
            "hubo_sim",
            "sim_node",
            *(f"_world:={arguments.world}", f"_seed:={arguments.seed}"),
            *("_lockstep:=true", "_real_time_factor:=0"),
            *([f"_video:={folder / VIDEO}"] if arguments.video else []),
        )
        session.wait_until(lambda: session.has_publisher("/joint_states"), "the simulator", 60.0)
        session.rosrun("ompl_planner", "planner_node")
        session.rosrun("fv_exploration", "explore_node")
        if arguments.rviz or not arguments.no_screenshots:
            session.rosrun("fv_viz", "viz_node")
        if not arguments.no_screenshots:
            session.rosrun("fv_viz", "screenshot_node", f"_out_dir:={folder / 'screenshots'}")
        if arguments.record:
            session.rosrun("fv_viz", "record", str(folder / RECORDING))
        if arguments.rviz:
            config = ROOT / "catkin_ws/src/fv_viz/rviz/exploration.rviz"
            session.rosrun("rviz", "rviz", "-d", str(config))

    def scene_picture(self, folder: Path) -> None:
        """A picture of the simulated world with the robot in it."""
        self._session.run_once(
            "hubo_sim",
            "render_scene",
            *("--world", self._arguments.world, "--robot", self._arguments.robot),
            *("--out", str(folder / "scene.png")),
        )

    def run_exploration(self, progress: Progress) -> dict[str, Any]:
        """Explore to the end, or until Ctrl-C; a dictionary of how it ended."""
        client = actionlib.ActionClient("/explore", ExploreAction)
        self._session.wait_until(
            lambda: client.wait_for_server(rospy.Duration(0.1)), "the exploration node", 60.0
        )
        started_s = rospy.get_time()
        handle = client.send_goal(
            self._goal(), feedback_cb=lambda _handle, feedback: progress.show(self._line(feedback))
        )
        try:
            self._watch(handle)
        except KeyboardInterrupt:
            progress.say("stopping; what there is will be kept")
            handle.cancel()
            self._watch(handle, CANCEL_TIMEOUT_S)
        result: ExploreResult = handle.get_result()
        if result.status not in STATUS_NAMES:
            raise SessionError(f"the exploration was dropped; logs are in {self._session.log_dir}")
        return {
            "result": STATUS_NAMES[result.status],
            "reason": result.message,
            "views": result.views,
            "known_share": round(result.known_share, 5),
            "sim_s": round(rospy.get_time() - started_s, 2),
            "warnings": list(result.warnings),
        }

    def last_picture(self, views: int, known_share: float) -> None:
        """The finished map. :raises SessionError: there is none."""
        try:
            rospy.wait_for_service("/fv_viz/screenshot", timeout=PICTURE_TIMEOUT_S)
            answer = rospy.ServiceProxy("/fv_viz/screenshot", Screenshot)(
                path="finished.png",
                title="Finished",
                facts=[f"{views} views", f"known {100 * known_share:.1f} %"],
            )
        except (rospy.ROSException, rospy.ServiceException) as error:
            raise SessionError(f"no picture of the finished map: {error}") from error
        if not answer.success:
            raise SessionError(f"no picture of the finished map: {answer.message}")

    def contacts(self) -> int:
        """Physics steps in which the robot touched anything. :raises SessionError: the simulator does not tell."""
        try:
            return int(rospy.wait_for_message("/hubo_sim/contacts", Contacts, timeout=10.0).total)
        except rospy.ROSException as error:
            raise SessionError(f"no count of contacts: {error}") from error

    def description(self) -> dict[str, Any]:
        """The part of run.json that says what was run."""
        bounds = self.world.bounds
        return {
            "resolution_m": self.config["map"]["resolution_m"],
            "bounds_min": list(map(float, bounds.min_m)),
            "bounds_max": list(map(float, bounds.max_m)),
            "capability_map": self.has_capability_map,
            "config": self.config,
            "versions": self._versions(),
        }

    def _versions(self) -> dict[str, str]:
        """What the figures of this run depend on."""
        names = ("numpy", "scipy", "pybullet", "toppra")
        return {
            "workspace": self._commit(),
            **{name: importlib.metadata.version(name) for name in names},
        }

    @staticmethod
    def _commit() -> str:
        """The commit that this is, or that it cannot be told: without git, or unpacked from an archive."""
        try:
            described = subprocess.run(
                ["git", "-C", str(ROOT), "describe", "--always", "--dirty"], capture_output=True, text=True
            )
        except FileNotFoundError:
            return "unknown (git is not installed)"
        return described.stdout.strip() or "unknown (no git repository)"

    def _require_capability_map(self, progress: Progress) -> bool:
        """Build the arm's capability map where set-up has not done so; False when it is to be done without one."""
        group = self.robot.config.exploration.capability_group
        if not group:
            return False
        if self._would_take_hours(group):
            progress.warn(
                f"{self.robot.name}'s {group} has no closed-form inverse kinematics, so its capability map would take "
                f"hours (rosrun capability_map build --robot {self._arguments.robot}); views are drawn without one"
            )
            return False
        progress.say(f"capability map of {self.robot.name}'s {group}")
        self._session.run_once(
            "capability_map",
            "build",
            *("--robot", self._arguments.robot, "--group", group, "--coarse"),
            watch=lambda node: progress.show(f"  {node.last_lines(1).strip()}"),
        )
        return True

    def _would_take_hours(self, group: str) -> bool:
        """True for an arm without a map whose every pose is sought by iteration: tenths of a second each."""
        if default_map_path(self.robot.name, group).exists():
            return False
        model = load_arm(self._arguments.robot, group).model()
        return make_ik_solver(model, group).numerical

    def _goal(self) -> ExploreGoal:
        bounds = self.world.bounds
        return ExploreGoal(
            bounds=Box(Point(*bounds.min_m), Point(*bounds.max_m)),
            max_views=self._arguments.views,
            max_seconds=self._arguments.seconds,
            seed=self._arguments.seed,
        )

    def _watch(self, handle: actionlib.ClientGoalHandle, timeout_s: float = float("inf")) -> None:
        """Wait for the result; SessionError when a node dies meanwhile."""
        deadline = time.monotonic() + timeout_s
        # A cancel that crosses the answer takes the handle back out of DONE: the result itself tells.
        while handle.get_comm_state() != actionlib.CommState.DONE and handle.get_result() is None:
            self._session.require_alive()
            if time.monotonic() > deadline:
                raise SessionError(f"the exploration did not end; logs are in {self._session.log_dir}")
            time.sleep(0.1)

    @staticmethod
    def _line(feedback: Any) -> str:
        share = feedback.known_share
        return (
            f"view {feedback.views:3d} {bar(share)} {100 * share:5.1f} % known  "
            f"best gain {feedback.best_gain:.3f} m^3  {feedback.activity}"
        )
