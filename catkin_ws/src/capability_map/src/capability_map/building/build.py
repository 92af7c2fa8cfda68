"""Build a capability map with several processes, resumable after an interruption."""

from __future__ import annotations

import dataclasses
import io
import itertools
import shutil
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from capability_map import __name__ as package
from capability_map import check, store
from capability_map._core import ViewProbe, build_spheres
from capability_map.building.plan import BuildPlan
from capability_map.building.symmetry import Decided, spread
from capability_map.capability_map import CapabilityMap
from capability_map.errors import CapabilityMapError
from capability_map.shapes import fit_all
from fv_common.files import write_whole

CELLS_PER_CHUNK = 64
CALIBRATION_VIEWS = 60_000
CALIBRATION_SEED = 100  # not among those that `check` and the benches use by default
_MAX_POOL_DEATHS = 3


@dataclasses.dataclass(frozen=True)
class Progress:
    """How far a build is: cells done of all, seconds since the start and until the end by the rate so far."""

    done: int
    total: int
    elapsed_s: float
    left_s: float


# One probe per worker process: building the robot model takes longer than a chunk's first spheres.
_worker: dict = {}


def compute_chunk(plan: BuildPlan, number: int) -> dict:
    """Decide the spheres of one chunk; runs in a worker process, keeps its probe for the next chunk."""
    if _worker.get("key") != plan.key:
        model = plan.arm.model()
        probe = ViewProbe(model, plan.arm.group, plan.probe_options())
        _worker.update(key=plan.key, model=model, probe=probe, grid=plan.grid())
    cells = chunk_cells(plan, number)
    batch = build_spheres(_worker["probe"], _worker["grid"], plan.outward, cells.tolist())
    batch["valid"] = np.packbits(batch["valid"], axis=1, bitorder="little")
    batch["witnesses"] = _quantised(batch["witnesses"], plan.joint_limits)
    batch["manipulability"] = batch["manipulability"].astype(np.float16)
    return batch


def chunk_cells(plan: BuildPlan, number: int) -> np.ndarray:
    """Return the cells of a chunk. Chunks take every C-th cell, so that each costs about the same."""
    return plan.decided[number :: chunk_count(plan)]


def chunk_count(plan: BuildPlan) -> int:
    """Return how many chunks a build has."""
    return max(1, -(-len(plan.decided) // CELLS_PER_CHUNK))


def _quantised(q: np.ndarray, limits: np.ndarray) -> np.ndarray:
    lower, upper = limits.T
    span = np.where(upper > lower, upper - lower, 1.0)
    return np.rint(np.clip((q - lower) / span, 0.0, 1.0) * 65535.0).astype(np.uint16)


def build_map(
    plan: BuildPlan,
    out: Path,
    executor: Callable[[BuildPlan, list[int]], Iterator[tuple[int, dict]]],
    report: Callable[[Progress], None] = lambda progress: None,
) -> store.MapData:
    """Build the map and write it to `out`.

    Finished chunks are kept beside it in `<out>.parts/` until the map is written: a build that was interrupted goes on
    from there, one with other settings starts afresh.

    :param executor: computes chunks, in any order: `local_executor(workers)` or `dask_executor(address)`.
    """
    parts = out.with_name(out.name + ".parts")
    started = time.monotonic()
    ready = _resume(plan, parts)
    missing = [number for number in range(chunk_count(plan)) if number not in ready]
    done = len(ready)
    for number, batch in executor(plan, missing):
        _save_part(parts, number, batch)
        done += 1
        elapsed = time.monotonic() - started
        left = elapsed / (done - len(ready)) * (chunk_count(plan) - done)
        report(Progress(done, chunk_count(plan), elapsed, left))
    batches = [_load_part(parts, number) for number in range(chunk_count(plan))]
    data = assemble(plan, batches, time.monotonic() - started)
    data.threshold = calibrated_threshold(plan, data)
    store.save(out, data)
    shutil.rmtree(parts, ignore_errors=True)
    return data


def calibrated_threshold(plan: BuildPlan, data: store.MapData) -> float:
    """Return the threshold that suits this map best, found at random views decided by inverse kinematics."""
    cap = CapabilityMap(data)
    views = check.random_views(cap, CALIBRATION_VIEWS, CALIBRATION_SEED)
    truth = check.fresh_truth(cap, plan.arm, *views, plan.parameters.roll_step_deg)
    return check.best_threshold(cap.query(*views), truth) or store.DEFAULT_THRESHOLD


def _resume(plan: BuildPlan, parts: Path) -> set[int]:
    """Return the chunks that an earlier run with the same settings finished."""
    key = parts / "key"
    try:
        if parts.is_dir() and (not key.is_file() or key.read_text() != plan.key):
            shutil.rmtree(parts)
        parts.mkdir(parents=True, exist_ok=True)
        key.write_text(plan.key)
    except OSError as err:
        raise CapabilityMapError(f"cannot keep the parts of the build in {parts}: {err}") from err
    finished = set()
    for path in parts.glob("*.npz"):
        try:
            _load_part(parts, int(path.stem))
            finished.add(int(path.stem))
        except (OSError, ValueError, KeyError):
            path.unlink()  # half written or damaged: computed again
    return finished


def _save_part(parts: Path, number: int, batch: dict) -> None:
    buffer = io.BytesIO()
    np.savez(buffer, **batch)
    path = parts / f"{number}.npz"
    try:
        write_whole(path, buffer.getvalue())
    except OSError as err:
        raise CapabilityMapError(f"cannot write {path}: {err}") from err


def _load_part(parts: Path, number: int) -> dict:
    try:
        with np.load(parts / f"{number}.npz") as part:
            return dict(part)
    except Exception as err:  # a damaged zip raises many kinds
        raise ValueError(f"part {number}: {err}") from err


def local_executor(workers: int) -> Callable[[BuildPlan, list[int]], Iterator[tuple[int, dict]]]:
    """Compute chunks in `workers` processes; when one dies, what it had not finished is computed again."""

    def run(plan: BuildPlan, numbers: list[int]) -> Iterator[tuple[int, dict]]:
        if workers == 1:
            yield from ((number, timed_chunk(plan, number)) for number in numbers)
            return
        open_numbers = set(numbers)
        for _ in range(_MAX_POOL_DEATHS):
            try:
                for number, batch in _run_pool(plan, sorted(open_numbers), workers):
                    open_numbers.discard(number)
                    yield number, batch
            except BrokenProcessPool:
                continue
            return
        raise CapabilityMapError(
            f"worker processes of {package} died {_MAX_POOL_DEATHS} times (out of memory?); what is finished is "
            "kept: start the same build again to go on"
        )

    return run


def _run_pool(plan: BuildPlan, numbers: list[int], workers: int) -> Iterator[tuple[int, dict]]:
    # fork: catkin's relay scripts in devel space cannot be imported again by a spawned process. This process has no
    # threads of its own before the pool.
    workers = min(workers, len(numbers))  # a pool that forks starts them all at once
    with ProcessPoolExecutor(workers, mp_context=get_context("fork")) as pool:
        waiting, pending = iter(numbers), {}
        try:
            while True:
                for number in itertools.islice(waiting, 2 * workers - len(pending)):
                    pending[pool.submit(timed_chunk, plan, number)] = number
                if not pending:
                    return
                for future in wait(pending, return_when=FIRST_COMPLETED).done:
                    yield pending.pop(future), future.result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def timed_chunk(plan: BuildPlan, number: int) -> dict:
    """compute_chunk() with the seconds of processor time it took."""
    started = time.process_time()
    batch = compute_chunk(plan, number)
    batch["seconds"] = time.process_time() - started
    return batch


def assemble(plan: BuildPlan, batches: list[dict], seconds: float) -> store.MapData:
    """Put the chunks together: spheres in ascending order of their cells, empty ones left out."""
    spheres = spread(plan.symmetry, _joined(plan, batches), plan.cells, plan.size, plan.joint_limits)
    per_sphere = spheres.valid.sum(axis=1, dtype=np.int64)
    order = np.argsort(spheres.cells, kind="stable")
    order = order[per_sphere[order] > 0]
    points = _point_order(per_sphere, order)
    totals = {
        name: int(sum(int(batch[name]) for batch in batches))
        for name in ("ik_calls", "collision_checks", "points_skipped")
    }
    grid_cells = int(np.prod(plan.size))
    valid = spheres.valid[order]
    return store.MapData(
        robot=plan.arm.robot,
        group=plan.arm.group,
        base_frame=plan.base_frame,
        tip_frame=plan.tip_frame,
        urdf_sha256=plan.arm.urdf_sha256,
        backend=ViewProbe(plan.arm.model(), plan.arm.group, plan.probe_options()).solver_name,
        parameters={**dataclasses.asdict(plan.parameters), "key": plan.key},
        statistics={
            "seconds": seconds,
            "cpu_seconds": float(sum(float(batch["seconds"]) for batch in batches)),
            "cells": grid_cells,
            "cells_skipped_by_bound": grid_cells - len(plan.cells),
            "cells_turned": len(plan.cells) - len(plan.decided),
            **totals,
        },
        joint_names=list(plan.joint_names),
        joint_limits=plan.joint_limits,
        reach_center_m=plan.reach_center_m,
        arm_length_m=plan.arm_length_m,
        pivot_m=plan.pivot_m,
        grid_origin_m=plan.origin_m,
        grid_size=np.array(plan.size, np.int32),
        radius_m=plan.radius_m,
        outward=plan.outward,
        cells=spheres.cells[order],
        bits=_bit_rows(valid),
        witnesses=spheres.witnesses[points],
        manipulability=spheres.manipulability[points],
        shapes=fit_all(plan.outward, valid),
        symmetry=plan.symmetry.text,
    )


def _joined(plan: BuildPlan, batches: list[dict]) -> Decided:
    """Put the chunks one behind the other."""
    names = ("valid", "witnesses", "manipulability")
    packed, witnesses, manipulability = (np.concatenate([batch[name] for batch in batches]) for name in names)
    return Decided(
        np.concatenate([chunk_cells(plan, number) for number in range(len(batches))]),
        np.unpackbits(packed, axis=1, bitorder="little", count=len(plan.outward)).astype(bool),
        witnesses,
        manipulability,
    )


def _bit_rows(valid: np.ndarray) -> np.ndarray:
    """(S, N) bool to (S, ceil(N / 64)) uint64, bit k of a row for column k."""
    packed = np.packbits(valid, axis=1, bitorder="little")
    bits = np.zeros((len(valid), (valid.shape[1] + 63) // 64 * 8), np.uint8)
    bits[:, : packed.shape[1]] = packed
    return bits.view(np.uint64)


def _point_order(per_sphere: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Rows of per-point arrays (sphere by sphere as computed) that put the spheres into the given order."""
    ends = np.cumsum(per_sphere)
    pieces = [np.arange(ends[row] - per_sphere[row], ends[row]) for row in order]
    return np.concatenate(pieces) if pieces else np.zeros(0, np.int64)
