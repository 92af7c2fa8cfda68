"""scripts/explore: its command line, and one line of text for whatever goes wrong.

Only the standard library is imported up here, so that --help needs nothing that set-up installs.
"""

from __future__ import annotations

import argparse
import errno
import math
import os
import sys
from pathlib import Path

import last_resort
import own_network
from interrupts import INTERRUPTED, interrupt_on_signals

from fv_common.ros_session import SessionError

SOURCES = Path(__file__).resolve().parents[2] / "catkin_ws" / "src"
KINDS = "hubo_sim/src/hubo_sim/worlds/kinds/[!_]*.py"


def names(pattern: str) -> str:
    """What worlds or robots come with the workspace, by their files."""
    files = SOURCES.glob(pattern)
    return ", ".join(sorted(file.parent.name if file.stem == "robot" else file.stem for file in files))


def parse_arguments(words: list[str]) -> argparse.Namespace:
    """The command line, checked."""
    parser = last_resort.Parser(
        prog="scripts/explore",
        description="Explore a simulated world with a robot arm that carries a depth camera.",
        epilog="Ctrl-C ends the exploration and keeps what there is.",
    )
    parser.add_argument(
        "--world",
        default="office",
        help=f"a YAML file, or {names('hubo_sim/worlds/*.yaml')}, or of a kind ({names(KINDS)}) "
        "what a seed makes, such as room:7 (default: office)",
    )
    parser.add_argument(
        "--robot",
        default="hubo",
        help=f"a folder, or {names('hubo_description/robots/*/robot.yaml')} (default: hubo)",
    )
    parser.add_argument("--views", type=int, default=0, metavar="N", help="end after N views (0: no limit)")
    parser.add_argument(
        "--seconds", type=float, default=0.0, metavar="S", help="end after S simulated seconds"
    )
    parser.add_argument("--seed", type=int, default=1, help="of everything that draws at random (default: 1)")
    parser.add_argument(
        "--policy",
        metavar="NAME",
        help="strategy that chooses the views: frontier_void (default), or package.module:Class of your own",
    )
    parser.add_argument("--resolution", type=float, metavar="M", help="edge of a voxel [m] (default: 0.05)")
    parser.add_argument(
        "--config", type=Path, metavar="FILE", help="YAML over the defaults in exploration.yaml"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="run folder (default: runs/<time>-<robot>-<world>-<seed>)"
    )
    parser.add_argument("--rviz", action="store_true", help="open RViz and watch")
    parser.add_argument("--record", action="store_true", help="write a rosbag; rosrun fv_viz replay plays it")
    parser.add_argument("--video", action="store_true", help="film the robot at work (scene.gif)")
    parser.add_argument("--no-screenshots", action="store_true", help="take no pictures: faster")
    parser.add_argument(
        "--no-truth", action="store_true", help="do not compare the map with the world at the end"
    )
    parser.add_argument("--port", type=int, default=0, help="of the ROS master (default: a free one)")
    parser.add_argument(
        "--shared-network",
        action="store_true",
        help="let other shells and hosts reach the run's nodes (default: a network of its own; docs/security.md)",
    )
    arguments = parser.parse_args(words)
    check(arguments)
    return arguments


def check(arguments: argparse.Namespace) -> None:
    """Raise SessionError for what can be seen to be wrong without starting anything."""
    for name in ("views", "seconds", "seed"):
        if not math.isfinite(getattr(arguments, name)) or getattr(arguments, name) < 0:
            raise SessionError(f"--{name} is {getattr(arguments, name)}; valid: 0 or a number above")
    if not 0 <= arguments.port <= 65535:
        raise SessionError(f"--port is {arguments.port}; valid: 1 to 65535, or 0 for a free one")
    if arguments.resolution is not None and not 0.005 <= arguments.resolution <= 0.5:
        raise SessionError(f"--resolution is {arguments.resolution}; valid: 0.005 to 0.5 (metres)")
    if arguments.rviz and not os.environ.get("DISPLAY"):
        raise SessionError(
            "--rviz needs a display, and DISPLAY is not set; leave it out: pictures are taken anyway"
        )


def close_doors(arguments: argparse.Namespace) -> str:
    """Move into a network of the run's own where that is wanted; where it is not possible, what a user has to know."""
    if arguments.shared_network:
        return ""
    display = os.environ.get("DISPLAY", "")
    if arguments.rviz and not own_network.reaches_display(display):
        refused = f"RViz reaches DISPLAY={display} over the network only"
    else:
        refused = own_network.enter()
    return refused and own_network.OPEN_DOORS.format(refused)


def main() -> int:
    interrupt_on_signals()
    try:
        arguments = parse_arguments(sys.argv[1:])
        open_doors = close_doors(arguments)  # before the imports below, which start threads
        from exploration_run import run  # here, not above: see there

        return run(arguments, open_doors)
    except SessionError as error:
        print(f"explore: {error}", file=sys.stderr)
    except OSError as error:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        print(f"explore: {'the disk is full' if full else error}", file=sys.stderr)
    except KeyboardInterrupt:
        print("explore: interrupted before the exploration began", file=sys.stderr)
        return INTERRUPTED
    return 1


if __name__ == "__main__":
    last_resort.run(main, "explore")
