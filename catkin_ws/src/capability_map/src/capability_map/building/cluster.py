"""Building on a Dask cluster; `dask` and `distributed` are only needed here."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from capability_map.building.build import timed_chunk
from capability_map.building.plan import BuildPlan
from capability_map.errors import CapabilityMapError


def dask_executor(
    address: str, timeout_s: float = 10.0
) -> Callable[[BuildPlan, list[int]], Iterator[tuple[int, dict]]]:
    """Compute chunks on the Dask cluster whose scheduler is at `address`; its workers need this workspace sourced.

    Dask itself computes again what a lost worker had not finished.

    :raises CapabilityMapError: dask is not installed, or no scheduler answers.
    """
    try:
        from distributed import Client, as_completed
    except ImportError as err:
        raise CapabilityMapError("--dask needs the Python packages dask and distributed") from err

    def run(plan: BuildPlan, numbers: list[int]) -> Iterator[tuple[int, dict]]:
        try:
            client = Client(address, timeout=timeout_s)
        except (OSError, TimeoutError, ValueError) as err:
            raise CapabilityMapError(f"no Dask scheduler at {address}: {err}") from err
        with client:
            futures = {client.submit(timed_chunk, plan, number, pure=False): number for number in numbers}
            for future in as_completed(list(futures)):
                number = futures.pop(future)  # frees the result on the cluster
                yield number, future.result()

    return run
