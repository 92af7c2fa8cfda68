"""How a finished map compares with the simulated world, which the explorer never saw but through its camera."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
from progress import Progress

from fv_common.files import write_replacing
from fv_exploration.run_folder import COLUMNS
from hubo_sim.ground_truth import ObservableRequest, ObservableSet, TrueWorld, observable_set, score_map
from hubo_sim.robot_source import load_robot_spec
from hubo_sim.worlds import World


def noise_sigma_m(sensor: Any) -> float:
    """Standard deviation [m] of the sensor's axial noise at the far end of its range; 0 when it is switched off."""
    axial = sensor.noise.axial
    if not axial.enabled:
        return 0.0
    return axial.sigma_base_m + axial.sigma_quadratic_per_m * (sensor.max_range_m - axial.offset_m) ** 2


def compare_with_world(
    world: World, robot_name: str, sensor: Any, folder: Path, progress: Progress
) -> dict[str, Any]:
    """Scores of the map in a run folder; metrics.csv gets the explored share of each view.

    :return: the shares of ``hubo_sim.ground_truth.score_map``, and how the observable set was found.
    """
    with np.load(folder / "map_points.npz") as points:
        free, occupied, resolution_m = points["free"], points["occupied"], float(points["resolution"])
    request = ObservableRequest(world, load_robot_spec(robot_name), resolution_m)
    observable = observable_set(
        request,
        lambda samples, voxels: progress.show(
            f"what the camera can see at all: {samples} views, {voxels} voxels"
        ),
    )
    scores = score_map(TrueWorld(world), free, occupied, resolution_m, observable, noise_sigma_m(sensor))
    write_explored_shares(folder, observable)
    return {**scores, "observable_samples": observable.samples, "observable_settled": observable.settled}


def explored_shares(folder: Path, observable: ObservableSet) -> dict[int, float]:
    """View number to the share of the observable voxels that the map knew after it."""
    with np.load(folder / "known_since.npz") as known:
        keys = np.argwhere(known["view"] >= 0)
        views = known["view"][tuple(keys.T)]
        centres = (keys + known["first_key"] + 0.5) * float(known["resolution"])
    return {int(view): observable.known_share(centres[views <= view]) for view in np.unique(views)}


def write_explored_shares(folder: Path, observable: ObservableSet) -> None:
    """Fill the columns explored_share and observable_settled of metrics.csv."""
    shares = explored_shares(folder, observable)
    path = folder / "metrics.csv"
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    newest = 0.0
    for row in rows:
        newest = shares.get(int(row["view"]), newest)
        row["explored_share"] = round(newest, 5)
        row["observable_settled"] = int(observable.settled)

    def write(beside: Path) -> None:
        with beside.open("w", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS)
            writer.writeheader()
            writer.writerows(rows)

    write_replacing(path, write)
