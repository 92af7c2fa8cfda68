"""scripts/explore: start the nodes, explore, and leave a run folder that explains itself."""

from __future__ import annotations

import argparse
import contextlib
import datetime
import errno
import math
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from nodes import ExplorationNodes
from progress import Progress
from ros_session import RosSession, SessionError
from truth import compare_with_world

from fv_exploration.run_folder import write_json, write_replacing

ROOT = Path(__file__).resolve().parents[2]
MIN_FREE_BYTES = 200 * 2**20

FILES = {
    "report.html": "the whole run on one page, with the map in 3D; opens in any browser",
    "run.json": "what was run, with which configuration and versions, and how it ended",
    "metrics.csv": "one row a view: seconds of each step, voxels of each class, expected and real gain",
    "map.bt": "the map as OctoMap file (free, occupied, unknown); opens in octovis",
    "map.ot": "the same map with its occupancy probabilities",
    "map_points.npz": "voxel centres of each class as numpy arrays",
    "known_since.npz": "for each voxel of the volume, the view at which it became known (-1: never)",
    "views.json": "camera poses that were reached, with joints, expected and real gain",
    "screenshots": "one picture a view, and the finished map",
    "recording.bag": "topics of the run; rosrun fv_viz replay plays it into RViz",
    "scene.gif": "the robot at work, in simulated time, without the pauses in which it thinks",
    "scene.png": "the simulated world itself, as the robot never sees it",
    "logs": "what each node said",
}


def parse_arguments(words: list[str]) -> argparse.Namespace:
    """The command line, checked as far as it can be without starting anything."""
    parser = argparse.ArgumentParser(
        prog="scripts/explore",
        description="Explore a simulated world with a robot arm that carries a depth camera.",
        epilog="Ctrl-C ends the exploration and keeps what there is.",
    )
    parser.add_argument("--world", default="office", help="name of a world, or a YAML file (default: office)")
    parser.add_argument("--robot", default="hubo", help="name of a robot, or its folder (default: hubo)")
    parser.add_argument("--views", type=int, default=0, metavar="N", help="end after N views (0: no limit)")
    parser.add_argument(
        "--seconds", type=float, default=0.0, metavar="S", help="end after S simulated seconds"
    )
    parser.add_argument("--seed", type=int, default=1, help="of everything that draws at random (default: 1)")
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
    arguments = parser.parse_args(words)
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
    return arguments


def make_run_folder(arguments: argparse.Namespace) -> Path:
    """A new, empty folder with room in it."""
    stamp = datetime.datetime.now().strftime("%Y%m%d-%H%M%S")
    words = (Path(arguments.robot).name, Path(arguments.world).stem, str(arguments.seed))
    name = re.sub(r"[^\w.-]+", "_", "-".join((stamp, *words)))  # some file systems know no colon
    folder = (arguments.out or ROOT / "runs" / name).resolve()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise SessionError(f"the run folder {folder} is not empty; name another one with --out")
        (folder / "screenshots").mkdir()
    except OSError as error:
        raise SessionError(f"cannot write the run folder {folder}: {error.strerror}") from error
    free = shutil.disk_usage(folder).free
    if free < MIN_FREE_BYTES:
        raise SessionError(
            f"only {free // 2**20} MiB are free for the run folder {folder}; 200 MiB are needed"
        )
    return folder


def explore(arguments: argparse.Namespace, nodes: ExplorationNodes, folder: Path) -> dict[str, Any]:
    """Run one exploration; the content of run.json."""
    started = time.monotonic()
    progress = Progress()
    with RosSession(folder / "logs", arguments.port) as session:
        progress.say(f"starting the nodes (ROS master on port {session.port})")
        nodes.start(session, folder, progress)
        result = nodes.run_exploration(progress)
        contacts = nodes.contacts()
        if not arguments.no_screenshots:
            progress.say("taking the last pictures")
            nodes.scene_picture(folder)
            nodes.last_picture(result["views"], result["known_share"])
    record = {
        "world": arguments.world,
        "robot": arguments.robot,
        "seed": arguments.seed,
        "explored_share": None,
        "explored_share_is": None,
        "contacts": contacts,
        "wall_s": round(time.monotonic() - started, 2),
        **result,
        **nodes.description(),
    }
    if not arguments.no_truth and (folder / "map_points.npz").exists():
        progress.say(
            "comparing the map with the world (the first time in a world it is found out what the camera could see "
            "at all, which takes minutes; --no-truth leaves it out)"
        )
        record["truth"] = compare_with_world(nodes.world, arguments.robot, nodes.camera, folder, progress)
        record["explored_share"] = record["truth"]["explored_share"]
        record["explored_share_is"] = "exact" if record["truth"]["observable_settled"] else "at most"
    progress.end()
    return record


def write_report(folder: Path) -> None:
    """report.html; what goes wrong with it is said and takes nothing away from the run."""
    done = subprocess.run(["rosrun", "fv_viz", "report", str(folder)], capture_output=True, text=True)
    if done.returncode != 0:
        print(f"no report.html: {done.stderr.strip().splitlines()[-1:]}", file=sys.stderr)


def write_readme(folder: Path) -> None:
    """One line for each thing that is in the run folder."""
    with contextlib.suppress(OSError):
        (folder / "screenshots").rmdir()  # when it is empty
    lines = [f"{name:16} {text}" for name, text in FILES.items() if (folder / name).exists()]
    text = "What is in this folder:\n\n" + "\n".join(lines) + "\n"
    write_replacing(folder / "README.txt", lambda beside: beside.write_text(text))


def summary(record: dict[str, Any], folder: Path) -> str:
    """What a person wants to know at the end."""
    explored = record["explored_share"]
    truth = record.get("truth")
    seen = ""
    if truth:
        bound = "" if truth["observable_settled"] else "at most "
        seen = f", {bound}{100 * explored:.1f} % of what its camera can see at all"
    lines = [
        f"Ended after {record['views']} views in {record['wall_s']:.0f} s: {record['reason']}.",
        f"Known: {100 * record['known_share']:.1f} % of the volume{seen}.",
        f"Contacts with the world: {record['contacts']}.",
    ]
    if truth:
        lines.append(
            f"Against the truth: {100 * truth['free_in_solid_share']:.3f} % of the free voxels lie inside solids, "
            f"{100 * truth['occupied_far_share']:.2f} % of the occupied ones away from any surface."
        )
    return "\n".join([*lines, f"Results: {folder} (README.txt says what is what)"])


def run(words: list[str]) -> int:
    """The whole command; the exit code."""
    arguments = parse_arguments(words)
    nodes = ExplorationNodes(arguments)
    folder = make_run_folder(arguments)
    try:
        record = explore(arguments, nodes, folder)
        write_json(folder / "run.json", record)
        write_report(folder)
    except KeyboardInterrupt:
        raise SessionError(f"interrupted; what there is so far lies in {folder}") from None
    finally:
        write_readme(folder)
    print(summary(record, folder))
    return 0 if record["result"] in ("COMPLETE", "VIEW_BUDGET", "TIME_BUDGET", "CANCELLED") else 1


def main() -> int:
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        return run(sys.argv[1:])
    except SessionError as error:
        print(f"explore: {error}", file=sys.stderr)
    except OSError as error:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        print(f"explore: {'the disk is full' if full else error}", file=sys.stderr)
    except KeyboardInterrupt:
        print("explore: interrupted before the exploration began", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
