"""Command line of the ground truth: compute, cache and summarise it for a world and a robot."""

from __future__ import annotations

import argparse
import sys

import numpy as np

from fv_common.command import Parser
from fv_common.files import write_whole
from hubo_sim.errors import SimError
from hubo_sim.ground_truth import TruthRequest, octree_bytes, true_voxels
from hubo_sim.paths import cache_folder
from hubo_sim.robot_source import load_robot_spec
from hubo_sim.worlds import load_world


def parse_args(argv: list[str]) -> argparse.Namespace:
    """The command line."""
    parser = Parser(prog="ground_truth", description=__doc__)
    parser.add_argument("--world", required=True, help="name of a world or path of its YAML file")
    parser.add_argument("--robot", default="hubo", help="robot of hubo_description (default: %(default)s)")
    parser.add_argument(
        "--resolution", type=float, default=0.05, help="voxel size in metres (default: %(default)s)"
    )
    parser.add_argument(
        "--seed", type=int, default=0, help="of the sampled configurations (default: %(default)s)"
    )
    parser.add_argument("--no-observable", action="store_true", help="only the world's own voxels")
    parser.add_argument("--out", help="also write all voxel centres to this .npz file")
    parser.add_argument("--bt", help="also write surface and solid voxels as occupied to this OctoMap file")
    return parser.parse_args(argv)


def report(args: argparse.Namespace) -> None:
    """Compute (or take from the cache) and print."""
    world, robot = load_world(args.world), load_robot_spec(args.robot)
    voxels = {}
    for what in ("surface", "solid") if args.no_observable else ("surface", "solid", "observable"):
        request = TruthRequest(world, robot, what, args.resolution, args.seed)
        found = true_voxels(request, _show_progress)
        voxels[what] = found.centres
        if what == "observable":
            end = "settled" if found.settled else "did NOT settle"
            print(
                f"observable: {found.samples} views of {found.tried} configurations drawn; {end}; {cache_folder()}"
            )
    for name, centres in voxels.items():
        print(f"{name + ':':12}{len(centres)} voxels of {args.resolution} m")
    if args.out:
        np.savez_compressed(args.out, resolution_m=args.resolution, **voxels)
        print(f"written to {args.out}")
    if args.bt:
        occupied = np.concatenate([voxels["surface"], voxels["solid"]])
        write_whole(args.bt, octree_bytes(occupied, np.zeros((0, 3)), args.resolution))
        print(f"written to {args.bt}")


def _show_progress(samples: int, voxels: int) -> None:
    print(f"\robservable: {samples} views, {voxels} voxels", end="", file=sys.stderr, flush=True)


def main() -> int:
    """Exit status of the command."""
    try:
        report(parse_args(sys.argv[1:]))
    except (SimError, OSError) as err:
        print(f"ground_truth: {err}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0
