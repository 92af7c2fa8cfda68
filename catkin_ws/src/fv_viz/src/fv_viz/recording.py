"""Recording a run's topics into a bag, playing it into RViz, and turning it into MCAP for Foxglove."""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
from pathlib import Path

import rospkg
import rospy
from std_msgs.msg import String

from fv_common.command import Parser
from fv_common.processes import die_with_parent
from fv_common.ros_master import require_master
from fv_common.ros_session import RosSession

DESCRIPTION = "/fv_viz/robot_description"  # carries the parameter of that name, which no bag would hold
BAG = "recording.bag"
LISTENER_S = 120.0
TOPICS = (
    "/tf",
    "/tf_static",
    "/joint_states",
    "/camera/depth/points",
    "/fv_exploration/map",
    "/fv_exploration/evaluation",
    "/fv_exploration/views",
    "/fv_exploration/volume",
    "/fv_exploration/removed",
    "/ompl_planner/path",
    "/hubo_sim/contacts",
    DESCRIPTION,
)


def record_main(arguments: list[str] | None = None) -> int:
    """rosrun fv_viz record FILE: record until interrupted; returns the exit code."""
    parser = Parser(prog="rosrun fv_viz record", description="Record a run's topics until Ctrl-C.")
    parser.add_argument("file", type=Path, help=f"bag to write, such as RUN_DIR/{BAG}")
    parser.add_argument(
        "--topic", action="append", default=[], metavar="NAME", help="another topic to record"
    )
    options = parser.parse_args(rospy.myargv(arguments or sys.argv)[1:])
    if not options.file.parent.is_dir():
        return _failed(f"no folder {options.file.parent}")
    require_master()
    rospy.init_node("fv_record", disable_signals=True)
    publisher = rospy.Publisher(DESCRIPTION, String, latch=True, queue_size=1)
    publisher.publish(rospy.get_param("/robot_description", ""))
    command = ["rosrun", "rosbag", "record", "--lz4", "-O", str(options.file), *TOPICS, *options.topic]
    return _until_interrupted(subprocess.Popen(command, start_new_session=True), options.file)


def _until_interrupted(recorder: subprocess.Popen, file: Path) -> int:
    """Wait for a signal, then let rosbag close its file: it does that at SIGINT only."""

    def stop(*_) -> None:
        recorder.send_signal(signal.SIGINT)

    signal.signal(signal.SIGINT, stop)
    signal.signal(signal.SIGTERM, stop)
    code = recorder.wait()
    if not file.is_file():
        return _failed(f"rosbag left no {file} (code {code})")
    print(f"recorded: {file} ({file.stat().st_size / 1e6:.1f} MB)")
    return 0


def replay_main(arguments: list[str] | None = None) -> int:
    """rosrun fv_viz replay BAG|RUN_DIR: play with /clock into RViz; returns the exit code."""
    parser = Parser(prog="rosrun fv_viz replay", description="Play a recorded run into RViz.")
    parser.add_argument("bag", type=Path, help=f"bag, or run folder with {BAG}")
    parser.add_argument("--rate", type=float, default=1.0, help="speed (%(default)s)")
    parser.add_argument("--no-rviz", action="store_true", help="only play")
    options = parser.parse_args(arguments)
    bag = options.bag / BAG if options.bag.is_dir() else options.bag
    try:
        description = description_of(bag)
        with RosSession() as session:
            return _play(session, bag, description, options)
    except (OSError, RuntimeError, ValueError) as error:
        return _failed(error)
    except KeyboardInterrupt:
        return 130


def description_of(bag: Path) -> str:
    """The robot description in a bag, empty when it has none.

    Raises FileNotFoundError, or ValueError for a file that is no bag.
    """
    from rosbags.highlevel import AnyReader, AnyReaderError

    if not bag.is_file():
        raise FileNotFoundError(f"no bag {bag}; scripts/explore --record makes one")
    try:
        with AnyReader([bag]) as reader:
            wanted = [one for one in reader.connections if one.topic == DESCRIPTION]
            for connection, _, data in (
                reader.messages(connections=wanted) if wanted else ()
            ):  # none means all there
                return reader.deserialize(data, connection.msgtype).data
    except AnyReaderError as error:
        raise ValueError(f"{bag} cannot be read: {error}") from error
    return ""


def _play(session: RosSession, bag: Path, description: str, options: argparse.Namespace) -> int:
    rospy.set_param("/use_sim_time", True)
    if description:
        rospy.set_param("/robot_description", description)
    session.rosrun("fv_viz", "viz_node")
    rviz = None
    if not options.no_rviz and os.environ.get("DISPLAY"):
        config = os.path.join(rospkg.RosPack().get_path("fv_viz"), "rviz", "exploration.rviz")
        rviz = session.rosrun("rviz", "rviz", "-d", config)
    elif not options.no_rviz:
        print("no DISPLAY: playing without RViz", file=sys.stderr)
    print(f"playing {bag}; ROS_MASTER_URI={os.environ['ROS_MASTER_URI']}", flush=True)
    topic = "/fv_exploration/evaluation"
    session.wait_until(lambda: session.has_subscriber(topic), f"somebody who listens to {topic}", LISTENER_S)
    command = ["rosrun", "rosbag", "play", "--quiet", "--clock", "--rate", str(options.rate), str(bag)]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    code = subprocess.call(command, preexec_fn=die_with_parent, **quiet)  # not a node: it takes keys to pause
    if rviz is not None and code == 0:
        print("the recording is over; close RViz to end")
        rviz.process.wait()
    return code


def mcap_main(arguments: list[str] | None = None) -> int:
    """rosrun fv_viz to_mcap BAG OUT: convert for Foxglove; returns the exit code."""
    parser = Parser(prog="rosrun fv_viz to_mcap", description="Turn a bag into MCAP for Foxglove.")
    parser.add_argument("bag", type=Path, help=f"bag, or run folder with {BAG}")
    parser.add_argument("out", type=Path, help="folder to make, with the .mcap file in it")
    options = parser.parse_args(arguments)
    bag = options.bag / BAG if options.bag.is_dir() else options.bag
    try:
        to_mcap(bag, options.out)
    except (OSError, ValueError) as error:
        return _failed(error)
    print(f"converted: {next(options.out.glob('*.mcap'))}")
    return 0


def to_mcap(bag: Path, out: Path) -> None:
    """Convert a bag to MCAP. Raises FileNotFoundError, FileExistsError, or ValueError when it cannot be converted."""
    from rosbags.convert import ConverterError, convert

    if not bag.is_file():
        raise FileNotFoundError(f"no bag {bag}")
    if out.exists():
        raise FileExistsError(f"{out} is there already")
    everything = {"exclude_topics": [], "include_topics": [], "exclude_msgtypes": [], "include_msgtypes": []}
    try:
        convert([bag], out, "mcap", 9, "zstd", "storage", None, None, **everything)
    except ConverterError as error:
        raise ValueError(f"{bag} cannot be converted: {error}") from error


def _failed(why: object) -> int:
    print(f"error: {why}", file=sys.stderr)
    return 1
