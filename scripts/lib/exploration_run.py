"""One run of scripts/explore: start the nodes, explore, and leave a run folder that explains itself."""

from __future__ import annotations

import argparse
import contextlib
import datetime
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import own_network
from log_warnings import logged
from nodes import ExplorationNodes
from progress import Progress
from truth import compare_with_world

from fv_common.files import write_whole
from fv_common.ros_session import RosSession, SessionError
from fv_exploration.run_folder import write_json

ROOT = Path(__file__).resolve().parents[2]
MIN_FREE_BYTES = 200 * 2**20
SHOWN_WARNINGS = 5

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


def explore(
    arguments: argparse.Namespace, nodes: ExplorationNodes, folder: Path, open_doors: str
) -> dict[str, Any]:
    """Run one exploration; the content of run.json."""
    started = time.monotonic()
    progress = Progress()
    with RosSession(folder / "logs", arguments.port) as session:
        where = "a network of its own" if own_network.is_own() else "this machine's network"
        progress.say(f"starting the nodes (ROS master on port {session.port} of {where})")
        if open_doors:
            progress.warn(open_doors)
        nodes.start(session, folder, progress)
        result = nodes.run_exploration(progress)
        contacts = unless_it_fails(progress, nodes.contacts)
        if not arguments.no_screenshots:
            progress.say("taking the last pictures")
            unless_it_fails(progress, nodes.scene_picture, folder)
            unless_it_fails(progress, nodes.last_picture, result["views"], result["known_share"])
        told = [*result["warnings"], *progress.warnings]
        result["warnings"] = [*told, *logged(session.log_dir, [*told, result["reason"]])]
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
    progress.end()
    return record


def unless_it_fails(progress: Progress, work: Callable[..., Any], *arguments: Any) -> Any:
    """What the work gives; None, and a warning, when it fails: the exploration is done and its record is kept."""
    try:
        return work(*arguments)
    except SessionError as error:
        progress.warn(" ".join(str(error).split()))
        return None


def add_truth(record: dict[str, Any], nodes: ExplorationNodes, folder: Path) -> None:
    """Compare the map with the simulated world, into the record; an interrupt leaves the record as it was."""
    progress = Progress()
    progress.say(
        "comparing the map with the world (the first time in a world it is found out what the camera could see "
        "at all, which takes minutes; --no-truth leaves it out)"
    )
    try:
        truth = compare_with_world(nodes.world, record["robot"], nodes.camera, folder, progress)
    except KeyboardInterrupt:
        progress.say("interrupted: left out")
        return
    finally:
        progress.end()
    record["truth"] = truth
    record["explored_share"] = truth["explored_share"]
    record["explored_share_is"] = "exact" if truth["observable_settled"] else "at most"


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
    write_whole(folder / "README.txt", text)


def summary(record: dict[str, Any], folder: Path) -> str:
    """What a person wants to know at the end."""
    explored = record["explored_share"]
    truth = record.get("truth")
    seen = ""
    if truth:
        bound = "" if truth["observable_settled"] else "at most "
        seen = f", {bound}{100 * explored:.1f} % of what its camera can see at all"
    ended = "Failed" if record["result"] == "FAILED" else "Ended"
    contacts = "unknown" if record["contacts"] is None else record["contacts"]
    lines = [
        f"{ended} after {record['views']} views in {record['wall_s']:.0f} s: {record['reason']}.",
        f"Known: {100 * record['known_share']:.1f} % of the volume{seen}.",
        f"Contacts with the world: {contacts}.",
    ]
    if truth:
        lines.append(
            f"Against the truth: {100 * truth['free_in_solid_share']:.3f} % of the free voxels lie inside solids, "
            f"{100 * truth['occupied_far_share']:.2f} % of the occupied ones away from any surface."
        )
    lines += warning_lines([text for text in record["warnings"] if text not in record["reason"]])
    return "\n".join([*lines, f"Results: {folder} (README.txt says what is what)"])


def warning_lines(warnings: list[str]) -> list[str]:
    """The first few, and where the others are."""
    lines = [f"Warning: {text}" for text in warnings[:SHOWN_WARNINGS]]
    more = len(warnings) - SHOWN_WARNINGS
    return [*lines, f"... and {more} more warnings, in run.json and report.html"] if more > 0 else lines


def run(arguments: argparse.Namespace, open_doors: str = "") -> int:
    """The whole command; the exit code.

    :param open_doors: what a user has to know when the nodes can be reached from elsewhere and nobody asked for it.
    """
    nodes = ExplorationNodes(arguments)
    folder = make_run_folder(arguments)
    try:
        record = explore(arguments, nodes, folder, open_doors)
        # At once: the comparison may take minutes, and be interrupted.
        write_json(folder / "run.json", record)
        # Who cancels wants an end; and where the robot has not moved there is little to compare.
        wanted = not arguments.no_truth and record["result"] != "CANCELLED" and record["views"]
        if wanted and (folder / "map_points.npz").exists():
            add_truth(record, nodes, folder)
            write_json(folder / "run.json", record)
        write_report(folder)
    except KeyboardInterrupt:
        raise SessionError(f"interrupted; what there is so far lies in {folder}") from None
    finally:
        write_readme(folder)
    print(summary(record, folder))
    return 0 if record["result"] in ("COMPLETE", "VIEW_BUDGET", "TIME_BUDGET", "CANCELLED") else 1
