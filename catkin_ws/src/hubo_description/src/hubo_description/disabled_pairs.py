"""Which pairs of links need no collision check: computed by sampling, written into the SRDF between two markers."""

from __future__ import annotations

import itertools
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fv_common.command import Parser
from fv_common.files import write_whole
from fv_robot_model import RobotModel
from hubo_description.collision import SelfCollision
from hubo_description.errors import RobotDescriptionError
from hubo_description.robot import Robot, list_robots, load_robot

BEGIN = "<!-- disabled pairs: begin (written by compute_disabled_pairs; edit above) -->"
END = "<!-- disabled pairs: end -->"
NEAR_M = 0.1  # pairs that come nearer than this without touching are searched further
DESCENT_STEPS = 200

Pair = tuple[str, str]


@dataclass(frozen=True)
class Sampled:
    """What sampling saw of one pair."""

    hits: int  # samples in which the links overlap
    nearest_m: float  # least distance seen; inf when never nearer than NEAR_M
    nearest_pose: dict[str, float]  # joint values of that sample


def solid_links(robot: Robot) -> list[str]:
    """Return the links that have a collision shape, parents before children."""
    return [link for link in robot.model.link_names if robot.model.shapes(link)]


def adjacent_pairs(model: RobotModel, solid: list[str]) -> set[Pair]:
    """Return the pairs joined by one joint, or by several across links that have no shape."""
    parent = {joint.child: joint.parent for joint in model.joints}
    pairs = set()
    for link in solid:
        above = parent.get(link)
        while above is not None and above not in solid:
            above = parent.get(above)
        if above is not None:
            pairs.add(_sorted(link, above))
    return pairs


def all_pairs(robot: Robot) -> list[Pair]:
    """Return every pair of links with a shape, names sorted within each pair."""
    return [_sorted(*pair) for pair in itertools.combinations(solid_links(robot), 2)]


def checked_pairs(robot: Robot) -> list[Pair]:
    """Return the pairs that a collision check must look at: all but the SRDF's disabled ones."""
    return [pair for pair in all_pairs(robot) if pair not in robot.disabled_pairs]


def _sorted(link_a: str, link_b: str) -> Pair:
    return (link_a, link_b) if link_a < link_b else (link_b, link_a)


def compute_disabled_pairs(robot: Robot, samples: int, seed: int) -> dict[Pair, str]:
    """Return pair -> reason: ``Adjacent``, ``Default``, ``Always`` or ``Never``.

    ``Default``: overlaps in the exploration's start pose, where an exploration could not even begin (fingers that
    touch when closed); ``Always``: in every sample.

    Uniform configurations within the limits; a pair that came near but never touched is then pushed together by a
    random descent from its nearest sample, so that rare contacts are not taken for impossible ones.

    :raises ValueError: samples < 1.
    """
    if samples < 1:
        raise ValueError(f"samples must be at least 1, got {samples}")
    rng = np.random.default_rng(seed)
    reasons = dict.fromkeys(adjacent_pairs(robot.model, solid_links(robot)), "Adjacent")
    pairs = [pair for pair in all_pairs(robot) if pair not in reasons]
    with SelfCollision(robot) as body:
        body.set_joints(start_pose(robot))
        reasons |= dict.fromkeys(body.colliding_pairs(pairs), "Default")
        pairs = [pair for pair in pairs if pair not in reasons]
        for pair, seen in _sample(robot, body, pairs, samples, rng).items():
            if seen.hits == samples:
                reasons[pair] = "Always"
            elif seen.hits == 0 and not _can_touch(robot, body, pair, seen, rng):
                reasons[pair] = "Never"
    return dict(sorted(reasons.items()))


def start_pose(robot: Robot) -> dict[str, float]:
    """Return all joints that move by themselves [rad, m] where exploring begins.

    The exploring group is at its start pose, the other groups at ``home``, what no group names at zero or at the
    limit nearest to it.
    """
    pose = {name: float(np.clip(0.0, *limits)) for name, limits in _bounds(robot).items()}
    for states in robot.group_states.values():
        pose |= states.get("home", {})
    exploration = robot.config.exploration
    return pose | robot.group_states[exploration.group][exploration.start_pose]


def _bounds(robot: Robot) -> dict[str, tuple[float, float]]:
    joints = zip(robot.model.joint_names, robot.model.limits, strict=True)
    return {name: (max(limit.lower, -np.pi), min(limit.upper, np.pi)) for name, limit in joints}


def _sample(
    robot: Robot, body: SelfCollision, pairs: list[Pair], samples: int, rng: np.random.Generator
) -> dict[Pair, Sampled]:
    bounds = _bounds(robot)
    seen = {pair: Sampled(0, np.inf, {}) for pair in pairs}
    for _ in range(samples):
        pose = {name: rng.uniform(*limits) for name, limits in bounds.items()}
        body.set_joints(pose)
        for pair in pairs:
            distance = body.distance(*pair, limit_m=NEAR_M)
            if distance < NEAR_M:
                seen[pair] = _nearer(seen[pair], distance, pose)
    return seen


def _nearer(seen: Sampled, distance: float, pose: dict[str, float]) -> Sampled:
    hits = seen.hits + (distance < 0.0)
    if distance < seen.nearest_m:
        return Sampled(hits, distance, pose)
    return Sampled(hits, seen.nearest_m, seen.nearest_pose)


def _can_touch(
    robot: Robot, body: SelfCollision, pair: Pair, seen: Sampled, rng: np.random.Generator
) -> bool:
    """Random descent of the pair's distance over the joints between its links, from the nearest sample."""
    names = joints_between(robot.model, *pair)
    if not names or not np.isfinite(seen.nearest_m):
        return False
    limits = np.array([_bounds(robot)[name] for name in names])
    best, nearest = np.array([seen.nearest_pose[name] for name in names]), seen.nearest_m
    for step in np.geomspace(0.5, 0.01, DESCENT_STEPS):
        trial = np.clip(best + step * rng.standard_normal(len(names)), limits[:, 0], limits[:, 1])
        body.set_joints(dict(zip(names, trial, strict=True)))
        distance = body.distance(*pair, limit_m=2.0 * NEAR_M)
        if distance < 0.0:
            return True
        if distance < nearest:
            best, nearest = trial, distance
    return False


def joints_between(model: RobotModel, link_a: str, link_b: str) -> list[str]:
    """Return the joints that move one link against the other, of mimics their leaders."""
    above = {joint.child: joint for joint in model.joints}
    ways = []
    for link in (link_a, link_b):
        way = []
        while link in above:
            way.append(above[link])
            link = above[link].parent
        ways.append({joint.name: joint.leader or joint.name for joint in way if joint.type != "fixed"})
    return sorted({ways[0].get(name) or ways[1][name] for name in ways[0].keys() ^ ways[1].keys()})


def _marked(srdf: str) -> str:
    """The SRDF with markers: its own, else an empty pair of them before its closing tag."""
    if BEGIN in srdf or END in srdf:
        return srdf
    head, tag, tail = srdf.rpartition("</robot>")
    return f"{head}\n  {BEGIN}\n  {END}\n{tag}{tail}"


def write_pairs(path: Path, reasons: dict[Pair, str]) -> None:
    """Replace what stands between the markers of an SRDF, put in at its end where there are none yet.

    The file is written beside and renamed.

    :raises RobotDescriptionError: the file holds half of the markers, or cannot be read or written.
    """
    line = '  <disable_collisions link1="{}" link2="{}" reason="{}"/>\n'
    try:
        head, rest = _marked(path.read_text(encoding="utf-8")).split(BEGIN)
        _, tail = rest.split(END)
        body = "".join(line.format(*pair, reason) for pair, reason in reasons.items())
        write_whole(path, f"{head}{BEGIN}\n{body}  {END}{tail}")
    except ValueError as err:
        raise RobotDescriptionError(f"{path}: needs each of these lines once: {BEGIN} {END}") from err
    except OSError as err:
        raise RobotDescriptionError(f"{path}: cannot be rewritten: {err}") from err


def main(argv: list[str] | None = None) -> int:
    """Command line: ``compute_disabled_pairs --robot NAME``; 0 on success."""
    parser = Parser(description="Compute the SRDF's disabled collision pairs by sampling.")
    parser.add_argument("--robot", required=True, help=f"name or folder; one of {', '.join(list_robots())}")
    parser.add_argument("--samples", type=int, default=3000, help="configurations to try (default 3000)")
    parser.add_argument("--seed", type=int, default=0, help="of the random configurations (default 0)")
    args = parser.parse_args(argv)
    try:
        robot = load_robot(args.robot)
        reasons = compute_disabled_pairs(robot, args.samples, args.seed)
        write_pairs(robot.folder / robot.config.srdf, reasons)
    except (RobotDescriptionError, ValueError) as err:
        print(f"compute_disabled_pairs: {err}", file=sys.stderr)
        return 1
    counts = {
        reason: list(reasons.values()).count(reason) for reason in ("Adjacent", "Default", "Always", "Never")
    }
    print(f"{robot.name}: {counts} of {len(all_pairs(robot))} pairs -> {robot.folder / robot.config.srdf}")
    return 0
