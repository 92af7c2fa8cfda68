"""A capability map in memory: which views can the arm hold?"""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np

from capability_map import shapes, store
from capability_map._core import CapabilityQuery, SeedLookup, SphereGrid, unit_directions
from capability_map.errors import CapabilityMapError
from capability_map.identity import urdf_hash


class CapabilityMap:
    """Reachability spheres of one arm (thesis 3.2), ready to be asked.

    A view is a tip position and a viewing direction (the tip's z axis), both in `base_frame`; any roll about the
    direction will do. S is the number of spheres with at least one valid point, N of points on each.
    """

    def __init__(self, data: store.MapData) -> None:
        self.data = data
        self.base_frame: str = data.base_frame
        self.tip_frame: str = data.tip_frame
        self.threshold: float = data.threshold  #: an interpolated answer at or above it counts as reachable
        self.grid = SphereGrid(data.grid_origin_m, data.radius_m, data.grid_size)
        row_of_cell = np.full(self.grid.cell_count, -1, np.int32)
        row_of_cell[data.cells] = np.arange(len(data.cells), dtype=np.int32)
        self._row_of_cell = row_of_cell
        self._seeds = SeedLookup(self.grid, -data.outward, row_of_cell, data.bits.reshape(-1))
        self._query = CapabilityQuery(
            self.grid, -data.outward, row_of_cell, data.bits.reshape(-1), data.pivot_m, data.reach_center_m
        )

    @classmethod
    def load(cls, path: str | Path, urdf_xml: str | None = None) -> CapabilityMap:
        """Read a map file.

        :param urdf_xml: text of the robot's URDF; a map that was made for another one is refused.
        :raises CapabilityMapError: missing or damaged file, or another URDF (both hashes are named).
        """
        data = store.load(Path(path))
        if urdf_xml is not None and urdf_hash(urdf_xml) != data.urdf_sha256:
            raise CapabilityMapError(
                f"{path} was made for another URDF: its hash is {data.urdf_sha256}, that of the robot "
                f"{urdf_hash(urdf_xml)}; build the map again"
            )
        try:
            return cls(data)
        except ValueError as err:
            raise CapabilityMapError(f"{path}: {err}") from err

    def query(self, positions: np.ndarray, directions: np.ndarray, interpolate: bool = True) -> np.ndarray:
        """Return how surely each view can be held, (N,) float32 in 0..1.

        :param positions: (N, 3) tip positions, base frame [m].
        :param directions: (N, 3) viewing directions, base frame; their length does not matter.
        :param interpolate: weigh the 8 spheres and the directions around the view (capability_query.h says how); else
            the bit of the nearest.

        Views outside the map get 0.

        :raises ValueError: a position or direction is not finite, or a direction is 0; names the view. All queries
            hold to this.
        """
        return self._query.query(positions, directions, interpolate)

    def query_poses(self, T_base_tip: np.ndarray, interpolate: bool = True) -> np.ndarray:
        """As query() for tip poses (N, 4, 4); their roll does not count."""
        T = np.asarray(T_base_tip, float)
        if T.ndim != 3 or T.shape[1:] != (4, 4):
            raise CapabilityMapError(f"poses must be (N, 4, 4), not {T.shape}")
        return self._query.query(T[:, :3, 3], T[:, :3, 2], interpolate)

    def reachable(
        self, positions: np.ndarray, directions: np.ndarray, interpolate: bool = True
    ) -> np.ndarray:
        """Return (N,) bool: query() at or above `threshold`."""
        return self.query(positions, directions, interpolate) >= self.threshold

    def covered(self, positions: np.ndarray, directions: np.ndarray, rule: str = "least_error") -> np.ndarray:
        """Return (N,) bool by the shapes alone, which are compact but coarse: does that of the view's sphere cover it?

        :param rule: "least_error", or "cover_all", the thesis's opening angle.
        """
        d = unit_directions(positions, directions)
        return shapes.covered(self.data.shapes, rule, self._rows(positions, d), -d)

    @property
    def radius(self) -> float:
        """Radius of the spheres [m]."""
        return self.data.radius_m

    @property
    def directions(self) -> np.ndarray:
        """(N, 3) n-vectors (thesis 3.9), outward: sphere point k stands at centre + radius * directions[k] and looks
        along -directions[k]."""
        return self.data.outward

    @functools.cached_property
    def centres(self) -> np.ndarray:
        """(S, 3) sphere centers, base frame [m]."""
        return self.grid.centers(self.data.cells.tolist())

    @functools.cached_property
    def valid(self) -> np.ndarray:
        """(S, N) bool: which points of each sphere the arm can hold."""
        packed = self.data.bits.view(np.uint8)
        return np.unpackbits(packed, axis=1, bitorder="little", count=len(self.data.outward)).astype(bool)

    def index(self) -> np.ndarray:
        """Return the reachability index D of each sphere, (S,) in percent (thesis 3.7)."""
        return 100.0 * self.valid.mean(axis=1)

    def sphere_rows(self, positions: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return (N,) the row of the sphere that each view belongs to: the one around p + r d; -1 where it is empty."""
        return self._rows(positions, unit_directions(positions, directions))

    def _rows(self, positions: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """As sphere_rows() for unit vectors."""
        centers = np.asarray(positions, float) + self.radius * np.asarray(directions, float)
        place = np.floor((centers - self.grid.origin) / (2.0 * self.radius))
        inside = ((place >= 0) & (place < self.data.grid_size)).all(axis=1)
        x, y, z = np.where(inside[:, None], place, 0).astype(np.int64).T
        cells = (x * self.data.grid_size[1] + y) * self.data.grid_size[2] + z
        return np.where(inside, self._row_of_cell[cells], -1)

    def seeds(self, positions: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return a stored configuration near each view: where a planner may start its inverse kinematics.

        :return: (N, J) joint values [rad], NaN where the view's sphere is empty, and (N,) angles [rad] between the
            view's direction and that of the stored point.
        """
        points, angles = self._seeds.nearest(positions, directions)
        q = np.full((len(points), len(self.data.joint_names)), np.nan)
        q[points >= 0] = self.witnesses(points[points >= 0])
        return q, np.where(points >= 0, angles, np.nan)

    def witnesses(self, rows: np.ndarray | None = None) -> np.ndarray:
        """Return stored configurations (V, J) [rad], one per valid point, sphere by sphere, direction by direction.

        :param rows: only these of the V valid points.
        """
        shares = self.data.witnesses if rows is None else self.data.witnesses[rows]
        lower, upper = self.data.joint_limits.T
        return lower + (upper - lower) * (shares / 65535.0)
