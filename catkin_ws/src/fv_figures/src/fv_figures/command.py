"""The command `figures`: every figure of the thesis from data of our own."""

from __future__ import annotations

import argparse
import shlex
import sys
import time
from pathlib import Path

import numpy as np

from fv_common.command import Parser
from fv_figures import compose, gallery, sources
from fv_figures.catalogue import CAPTIONS, FIGURES
from fv_figures.material import Material
from fv_figures.stage import Stage


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The command line."""
    text = "Draw the thesis's figures off-screen from data of our own."
    parser = Parser(prog="scripts/figures", description=text)
    parser.add_argument("--only", metavar="N,N", help=f"some of {','.join(FIGURES)}")
    parser.add_argument(
        "--out", type=Path, default=Path("figures"), help="folder for the pictures (%(default)s)"
    )
    parser.add_argument(
        "--cloud", type=Path, metavar="FILE", help="a recorded cloud (.pcd, .npy, .npz), not the simulator"
    )
    parser.add_argument("--world", default="office", help="world of hubo_sim (%(default)s)")
    parser.add_argument("--robot", default="hubo", help="robot of hubo_description (%(default)s)")
    parser.add_argument("--group", default="right_arm", help="group of the capability map (%(default)s)")
    parser.add_argument(
        "--map", type=Path, metavar="FILE", help="capability map; default: the one of the set-up"
    )
    parser.add_argument(
        "--resolution", type=float, default=0.05, help="edge of a voxel in metres (%(default)s)"
    )
    options = parser.parse_args(arguments)
    options.numbers = list(FIGURES) if not options.only else [k.strip() for k in options.only.split(",")]
    unknown = [number for number in options.numbers if number not in FIGURES]
    if unknown:
        parser.error(f"no figure {', '.join(unknown)}; known: {', '.join(FIGURES)}")
    if not options.resolution > 0.0:
        parser.error(f"--resolution must be positive, got {options.resolution}")
    return options


def main(arguments: list[str] | None = None) -> int:
    """Make the figures; returns 0 when all that were asked for are there and show what they should."""
    options = parse(arguments)
    try:
        options.out.mkdir(parents=True, exist_ok=True)
        with Stage() as stage:
            failed = make_all(Material(stage, options.robot, *_makers(options)), options)
        gallery.write(options.out)
    except (RuntimeError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"stopped; finished figures are in {options.out}", file=sys.stderr)
        return 130
    print(f"{len(options.numbers) - len(failed)} of {len(options.numbers)} figures in {options.out}")
    return 1 if failed else 0


def make_all(material: Material, options: argparse.Namespace) -> list[str]:
    """Make each figure; what cannot be made is said in one line and the rest goes on. Returns the failed ones."""
    failed = []
    for done, number in enumerate(options.numbers, 1):
        started = time.monotonic()
        try:
            words = _make(material, number, options.out, origin_of(options))
        except (RuntimeError, ValueError) as error:  # NoData, RvizFailed, no display
            words = f"not made: {error}"
        if words:
            failed.append(number)
        seconds = time.monotonic() - started
        print(
            f"[{done}/{len(options.numbers)}] figure {number}: {words or 'ok'} ({seconds:.1f} s)", flush=True
        )
    return failed


def _make(material: Material, number: str, folder: Path, origin: str) -> str:
    """Make and check one figure; returns what is wrong with it, empty when nothing is."""
    material.stage.errors.clear()
    figure = FIGURES[number](material)
    if not figure.panels:
        raise sources.NoData("its data hold nothing of what it shows")
    caption, command = CAPTIONS[number], f"scripts/figures --only {number} {origin}".strip()
    told = [f"Data: {figure.made_by}", f"Command: {command}", f"The thesis: {caption.thesis}"]
    scene = "recorded" if "--cloud" in origin else "simulated; the thesis's was recorded"
    compose.save(figure, number, folder, [*told, f"What differs: {caption.differs.format(scene=scene)}"])
    wrong = compose.figure_faults(figure)
    return "; ".join(wrong + [f"RViz: {line}" for line in np.unique(material.stage.errors)])


def origin_of(options: argparse.Namespace) -> str:
    """The arguments that say where the data come from, without those that are as they would be anyway."""
    standard, words = parse([]), []
    for name in ("cloud", "world", "robot", "group", "map", "resolution"):
        if getattr(options, name) != getattr(standard, name):
            words += [f"--{name}", str(getattr(options, name))]
    return shlex.join(words)


def _makers(options: argparse.Namespace):
    def scans() -> sources.Scans:
        if options.cloud:
            return sources.recorded(options.cloud, options.resolution)
        return sources.simulated(options.world, options.robot, options.resolution)

    def spheres() -> sources.Spheres:
        return sources.capability(
            options.map or sources.default_capability_path(options.robot, options.group)
        )

    return scans, spheres
