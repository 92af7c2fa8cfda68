"""Command line: drop the objects of a world file and write the file with the poses at which they come to rest."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

from fv_common.command import Parser
from fv_common.files import write_whole
from hubo_sim.errors import SimError
from hubo_sim.worlds import World, load_world
from hubo_sim.worlds.settle import largest_way, settle


def parse_args(argv: list[str]) -> argparse.Namespace:
    """The command line."""
    parser = Parser(prog="settle_world", description=__doc__)
    parser.add_argument("--world", required=True, help="path of a world's YAML file")
    parser.add_argument("--out", required=True, help="YAML file to write (comments are not kept)")
    parser.add_argument("--still", nargs="*", default=["floor"], help="objects that stay (default: floor)")
    parser.add_argument(
        "--fences", nargs="*", default=[], help="objects that stay at first, then are taken away for good"
    )
    return parser.parse_args(argv)


def content_of(path: Path, world: World) -> dict:
    """The content of a world file with the poses of `world`, without the objects that it has not got any more."""
    content = yaml.safe_load(path.read_text())
    poses = {item.name: item.T_world_object for item in world.objects}
    content["objects"] = [entry for entry in content["objects"] if entry["name"] in poses]
    for entry in content["objects"]:
        T = poses[entry["name"]]
        angles = Rotation.from_matrix(T[:3, :3]).as_euler("xyz", degrees=True)
        entry["position_m"], entry["rpy_deg"] = T[:3, 3].round(4).tolist(), np.round(angles, 3).tolist()
    return content


def run(args: argparse.Namespace) -> None:
    """Settle and write. Raises SimError or OSError."""
    path = Path(args.world)
    before = load_world(str(path))
    after = settle(before, (*args.still, *args.fences))
    if args.fences:
        kept = tuple(item for item in after.objects if item.name not in args.fences)
        after = settle(World(**(vars(after) | {"objects": kept})), tuple(args.still))
        before = World(
            **(vars(before) | {"objects": tuple(o for o in before.objects if o.name not in args.fences)})
        )
    text = yaml.safe_dump(content_of(path, after), sort_keys=False, default_flow_style=None, width=200)
    write_whole(args.out, text.encode())
    print(f"settled by up to {largest_way(before, after):.3f} m; written to {args.out}")


def main() -> int:
    """Exit status of the command."""
    try:
        run(parse_args(sys.argv[1:]))
    except (SimError, OSError) as err:
        print(f"settle_world: {err}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0
