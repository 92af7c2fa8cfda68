"""Command line for a picture of a world, with or without a robot in it."""

from __future__ import annotations

import argparse
import sys

from fv_common.command import Parser
from fv_common.files import write_whole
from hubo_sim.errors import SimError
from hubo_sim.pictures import render_scene
from hubo_sim.robot_source import load_robot_spec
from hubo_sim.worlds import ViewPoint, load_world


def parse_args(argv: list[str]) -> argparse.Namespace:
    """The command line."""
    parser = Parser(prog="render_scene", description=__doc__)
    parser.add_argument("--world", required=True, help="name of a world or path of its YAML file")
    parser.add_argument(
        "--robot", default="hubo", help="robot of hubo_description, '' for none (default: %(default)s)"
    )
    parser.add_argument("--pose", default="", help="SRDF group_state of the robot (default: its start pose)")
    parser.add_argument(
        "--eye", type=float, nargs=3, metavar=("X", "Y", "Z"), help="where the camera stands [m]"
    )
    parser.add_argument("--target", type=float, nargs=3, metavar=("X", "Y", "Z"), help="where it looks [m]")
    parser.add_argument("--fov", type=float, help="horizontal field of view [deg]")
    parser.add_argument("--size", type=int, nargs=2, default=(960, 720), metavar=("W", "H"), help="pixels")
    parser.add_argument("--out", required=True, help="PNG file to write")
    return parser.parse_args(argv)


def render(args: argparse.Namespace) -> None:
    """Write the picture. Raises SimError or OSError."""
    world = load_world(args.world)
    spec = load_robot_spec(args.robot) if args.robot else None
    positions = spec.group_state(args.pose) if spec and args.pose else None
    own = world.camera
    view = ViewPoint(args.eye or own.eye_m, args.target or own.target_m, args.fov or own.fov_deg)
    write_whole(args.out, render_scene(world, spec, positions, view, tuple(args.size)))
    print(f"written to {args.out}")


def main() -> int:
    """Exit status of the command."""
    try:
        render(parse_args(sys.argv[1:]))
    except (SimError, OSError, ValueError) as err:
        print(f"render_scene: {err}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0
