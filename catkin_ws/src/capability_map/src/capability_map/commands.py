"""The commands `build`, `info`, `check` and `show`: their arguments, and what they print."""

from __future__ import annotations

import argparse
import dataclasses
import functools
import sys
import time
from collections.abc import Callable
from pathlib import Path

from capability_map import shapes, store
from capability_map.errors import CapabilityMapError
from capability_map.parameters import BuildParameters
from capability_map.paths import default_map_path
from fv_common.command import Parser
from fv_common.errors import told_as

MOST_WORKERS = 512


def run_command(command: Callable[[list[str]], None], arguments: list[str] | None = None) -> int:
    """Run a command; an expected failure becomes one line on stderr and exit code 1, Ctrl-C 130.

    The rest is fv_common.command's.
    """
    try:
        command(sys.argv[1:] if arguments is None else arguments)
    except CapabilityMapError as err:
        print(f"capability_map: {err}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("\ncapability_map: interrupted; start the same command again to go on", file=sys.stderr)
        return 130
    return 0


def _build_arguments(arguments: list[str]) -> argparse.Namespace:
    parser = Parser(
        prog="build",
        description="Build the capability map of an arm; goes on where an interrupted build stopped.",
    )
    which = parser.add_mutually_exclusive_group(required=True)
    which.add_argument("--robot", help="name of a robot of hubo_description, or its folder")
    which.add_argument(
        "--all", action="store_true", help="every map of config/maps.yaml, one after the other"
    )
    parser.add_argument(
        "--group", help="SRDF group that is a chain (default: capability_group of robot.yaml)"
    )
    parser.add_argument(
        "--out", type=Path, help="map file (default: data/capability_maps/<robot>_<group>.h5)"
    )
    parser.add_argument("--config", type=Path, help="YAML file like config/build.yaml")
    parser.add_argument(
        "--radius", type=float, dest="radius_m", help="sphere radius [m] (default: arm length / 30)"
    )
    parser.add_argument("--points", type=int, help="points on a sphere (default: 200)")
    parser.add_argument(
        "--roll-step", type=float, dest="roll_step_deg", help="step between rolls [deg] (default: 5)"
    )
    parser.add_argument(
        "--no-self-collision",
        action="store_const",
        const=False,
        dest="self_collision",
        help="ignore self-collision",
    )
    parser.add_argument("--workers", type=int, default=2, help="processes on this machine (default: 2)")
    parser.add_argument("--dask", metavar="tcp://HOST:PORT", help="compute on a Dask cluster instead")
    parser.add_argument(
        "--coarse",
        action="store_true",
        help="spheres of twice the radius, in seconds; a finer map will do as well",
    )
    parser.add_argument("--force", action="store_true", help="build even when the map is up to date")
    options = parser.parse_args(arguments)
    if not 1 <= options.workers <= MOST_WORKERS:
        raise CapabilityMapError(f"--workers is {options.workers}; valid: 1 to {MOST_WORKERS}")
    if options.all and (options.group or options.out):
        raise CapabilityMapError("--all builds several maps: --group and --out make no sense with it")
    return options


@told_as(CapabilityMapError)
def _parameters(options: argparse.Namespace, fine: bool = False) -> BuildParameters:
    """Return the settings: defaults or the YAML file, then the arguments. `fine` ignores --coarse."""
    base = BuildParameters.from_yaml(options.config) if options.config else BuildParameters()
    names = ("radius_m", "points", "roll_step_deg", "self_collision")
    given = {name: getattr(options, name) for name in names if getattr(options, name) is not None}
    if options.coarse and not fine:
        given["radii_per_arm_length"] = 0.5 * base.radii_per_arm_length
    return dataclasses.replace(base, **given)


def build_command(arguments: list[str]) -> None:
    """`rosrun capability_map build`."""
    options = _build_arguments(arguments)
    if not options.all:
        _build_one(options, options.robot, options.group)
        return
    for robot, group in listed_maps():
        _build_one(options, robot, group)


def listed_maps() -> list[tuple[str, str]]:
    """Return robot and group of every map in config/maps.yaml."""
    import rospkg
    import yaml

    path = Path(rospkg.RosPack().get_path("capability_map")) / "config" / "maps.yaml"
    try:
        return [(entry["robot"], entry["group"]) for entry in yaml.safe_load(path.read_text())["maps"]]
    except (OSError, yaml.YAMLError, TypeError, KeyError) as err:
        raise CapabilityMapError(f"{path}: {err}") from err


def _build_one(options: argparse.Namespace, robot: str, group: str | None) -> None:
    from capability_map.building.build import build_map, local_executor
    from capability_map.building.plan import plan_build
    from capability_map.robots import load_arm

    arm = load_arm(robot, group)
    out = options.out or default_map_path(arm.robot, arm.group)
    plan = plan_build(arm, _parameters(options))
    keys = {plan.key, plan_build(arm, _parameters(options, fine=True)).key}
    if not options.force and is_up_to_date(out, keys):
        print(f"{out} is up to date (URDF {arm.urdf_sha256[:12]}, same settings); nothing to do")
        return
    print(
        f"{arm.robot}/{arm.group}: {plan.base_frame} -> {plan.tip_frame}, arm length {plan.arm_length_m:.3f} m, "
        f"radius {plan.radius_m * 1000:.1f} mm, {plan.parameters.points} points, "
        f"{'x'.join(map(str, plan.size))} cells, {len(plan.cells)} within reach\n"
        f"symmetry of the first joint: {plan.symmetry.text} ({len(plan.decided)} cells to decide)",
        flush=True,
    )
    executor = _dask(options.dask) if options.dask else local_executor(options.workers)
    bar = ProgressBar()
    data = build_map(plan, out, executor, bar)
    bar.finish()
    print(summary(data))
    print(f"written to {out} ({out.stat().st_size / 1e6:.1f} MB)")


def _dask(address: str):
    from capability_map.building.cluster import dask_executor

    return dask_executor(address)


def is_up_to_date(path: Path, keys: set[str]) -> bool:
    """Return whether the file is a sound map whose BuildPlan.key is one of these."""
    try:
        return store.load(path).parameters.get("key") in keys
    except CapabilityMapError:
        return False


class ProgressBar:
    """Progress on a terminal as one line that renews itself, else as a line every ten seconds."""

    def __init__(self) -> None:
        self._terminal = sys.stdout.isatty()
        self._last = time.monotonic() if not self._terminal else 0.0

    def __call__(self, progress) -> None:
        """Show a Progress."""
        now = time.monotonic()
        if now - self._last < (0.2 if self._terminal else 10.0) and progress.done < progress.total:
            return
        self._last = now
        share = progress.done / progress.total
        bar = "#" * int(30 * share)
        text = f"[{bar:<30}] {100 * share:3.0f} %  {progress.elapsed_s:.0f} s, {progress.left_s:.0f} s left"
        print(f"\r{text}  " if self._terminal else text, end="" if self._terminal else "\n", flush=True)

    def finish(self) -> None:
        """End the line."""
        if self._terminal:
            print()


def summary(data: store.MapData) -> str:
    """Return what a map is, in a few lines."""
    from capability_map.capability_map import CapabilityMap

    cap = CapabilityMap(data)
    index = cap.index()
    counts = data.statistics
    return (
        f"inverse kinematics: {data.backend}\n"
        f"spheres with a valid point: {len(index)} of {counts['cells']} "
        f"({counts['cells_skipped_by_bound']} skipped by the reach bound); reachability index mean "
        f"{index.mean() if len(index) else 0.0:.1f} %, largest {index.max() if len(index) else 0.0:.1f} %\n"
        f"{counts['seconds']:.1f} s ({counts['cpu_seconds']:.0f} s of processor time), "
        f"{counts['ik_calls']} calls of inverse kinematics, "
        f"{counts['collision_checks']} collision checks, {len(data.manipulability)} valid points\n"
        f"{shapes.report(data.shapes)}\n"
        f"reachable from {data.threshold:g} on"
    )


def info_command(arguments: list[str]) -> None:
    """`rosrun capability_map info`."""
    parser = Parser(prog="info", description="Say what a capability map holds.")
    parser.add_argument("map", type=Path, help="map file")
    data = store.load(parser.parse_args(arguments).map)
    print(f"{data.robot}/{data.group}: {data.base_frame} -> {data.tip_frame}, URDF {data.urdf_sha256}")
    print(
        f"arm length {data.arm_length_m:.4f} m about {data.reach_center_m}, wrist {data.pivot_m:.4f} m behind the tip"
    )
    size = "x".join(str(count) for count in data.grid_size)
    print(
        f"grid {size} from {data.grid_origin_m}, radius {data.radius_m:.5f} m, {len(data.outward)} points a sphere"
    )
    print(f"parameters: {data.parameters}")
    print(f"symmetry of the first joint: {data.symmetry}")
    print(summary(data))


def check_command(arguments: list[str]) -> None:
    """`rosrun capability_map check`."""
    from capability_map import check
    from capability_map.capability_map import CapabilityMap
    from capability_map.robots import load_arm

    parser = Parser(prog="check", description="Compare a map's answers with fresh inverse kinematics.")
    parser.add_argument("map", type=Path, help="map file")
    parser.add_argument("--robot", help="robot of hubo_description (default: the one named in the map)")
    parser.add_argument("--views", type=int, default=20000, help="random views (default: 20000)")
    parser.add_argument(
        "--roll-step", type=float, default=2.5, help="step between rolls [deg] (default: 2.5)"
    )
    parser.add_argument("--seed", type=int, default=0, help="of the random views (default: 0)")
    options = parser.parse_args(arguments)
    if options.views < 1 or not options.roll_step > 0.0:
        raise CapabilityMapError("--views and --roll-step must be positive")
    if options.seed < 0:
        raise CapabilityMapError(f"--seed is {options.seed}; valid: 0 or a whole number above")
    cap = CapabilityMap.load(options.map)
    arm = load_arm(options.robot or cap.data.robot, cap.data.group)
    views = check.random_views(cap, options.views, options.seed)
    truth = check.fresh_truth(cap, arm, *views, options.roll_step)
    print(f"{options.views} random views of the map's box, {truth.mean():.1%} of them can be held")
    print(f"{'method':<22}{'accuracy':>10}{'found':>10}{'false pos.':>12}")
    for row in check.compare(cap, truth, *views):
        print(f"{row.method:<22}{row.accuracy:>10.2%}{row.found:>10.2%}{row.false_positives:>12.2%}")


def show_command(arguments: list[str]) -> None:
    """`rosrun capability_map show`."""
    from capability_map.capability_map import CapabilityMap
    from capability_map.drawing.pictures import draw_all

    parser = Parser(prog="show", description="Draw a map: spikes, index in two cuts, shapes (PNG).")
    parser.add_argument("map", type=Path, help="map file")
    parser.add_argument("--out", type=Path, help="folder for the pictures (default: <map>_pictures)")
    options = parser.parse_args(arguments)
    cap = CapabilityMap.load(options.map)
    folder = options.out or options.map.with_name(options.map.stem + "_pictures")
    try:
        for path in draw_all(cap, folder):
            print(f"wrote {path}")
    except OSError as err:
        raise CapabilityMapError(f"cannot write pictures: {err}") from err


build_main = functools.partial(run_command, build_command)
info_main = functools.partial(run_command, info_command)
check_main = functools.partial(run_command, check_command)
show_main = functools.partial(run_command, show_command)
