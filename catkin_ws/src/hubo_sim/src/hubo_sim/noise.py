"""What a structured-light depth camera gets wrong, each part with its own switch."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hubo_sim.config import from_mapping, number
from hubo_sim.errors import SimError
from hubo_sim.render import Pinhole

# A pixel belongs to a depth edge when a neighbour's depth differs by more than this share of its own.
_EDGE_SHARE = 0.03


@dataclass(frozen=True)
class AxialNoise:
    """sigma_z(z) = base + quadratic (z - offset)^2; Nguyen, Izadi, Lovell, 3DIMPVT 2012, equation 3 without angle."""

    enabled: bool = False
    sigma_base_m: float = 0.0012
    sigma_quadratic_per_m: float = 0.0019
    offset_m: float = 0.4

    def sigma(self, depth_m: np.ndarray) -> np.ndarray:
        """Standard deviation [m] at depths [m], any shape."""
        out = np.subtract(depth_m, self.offset_m)
        out *= out
        out *= self.sigma_quadratic_per_m
        out += self.sigma_base_m
        return out


@dataclass(frozen=True)
class LateralNoise:
    """Normal jitter [pixel] of where each pixel looks: felt at depth edges (0.8 px: the same paper)."""

    enabled: bool = False
    sigma_px: float = 0.8


@dataclass(frozen=True)
class GrazingLoss:
    """No return where the ray meets the surface at a larger angle to its normal than this."""

    enabled: bool = False
    max_incidence_deg: float = 80.0


@dataclass(frozen=True)
class MixedPixels:
    """This share of the pixels at a depth edge measures something between foreground and background."""

    enabled: bool = False
    share: float = 0.3


_PARTS = {"axial": AxialNoise, "lateral": LateralNoise, "grazing": GrazingLoss, "mixed_pixels": MixedPixels}


@dataclass(frozen=True)
class NoiseConfig:
    """The `noise` entry of a depth camera in sensors.yaml; parts may be given as mappings. All are off by default."""

    seed: int = 0
    axial: Any = field(default_factory=AxialNoise)
    lateral: Any = field(default_factory=LateralNoise)
    grazing: Any = field(default_factory=GrazingLoss)
    mixed_pixels: Any = field(default_factory=MixedPixels)

    def __post_init__(self) -> None:
        if isinstance(self.seed, bool) or not isinstance(self.seed, int) or self.seed < 0:
            raise SimError(f"seed must be a non-negative integer, got {self.seed!r}")
        for name, cls in _PARTS.items():
            value = getattr(self, name)
            part = value if isinstance(value, cls) else from_mapping(cls, value, name)
            if not isinstance(part.enabled, bool):
                raise SimError(f"{name}: enabled must be true or false, got {part.enabled!r}")
            for key, entry in vars(part).items():
                if key != "enabled":
                    number(entry, f"{name}: {key}", 0.0)
            object.__setattr__(self, name, part)


class DepthNoise:
    """Applies a NoiseConfig to ideal depth images; the same seed and scan number give the same noise."""

    def __init__(self, config: NoiseConfig, camera: Pinhole, seed: int = 0) -> None:
        self.config = config
        self._rays = camera.rays().astype(np.float32)
        self._lengths = np.linalg.norm(self._rays, axis=-1)
        self._seed = [config.seed, seed]

    def apply(self, depth: np.ndarray, scan_number: int) -> np.ndarray:
        """Noisy copy of an ideal depth image (H, W) float32 [m], NaN = no return."""
        config, rng = self.config, np.random.default_rng([*self._seed, scan_number])
        lost = self._grazing(depth) if config.grazing.enabled else None
        if config.lateral.enabled:
            depth = self._jitter(depth, rng)
        if config.mixed_pixels.enabled:
            depth = self._mix(depth, rng)
        if config.axial.enabled:
            error = rng.standard_normal(depth.shape, np.float32)
            error *= config.axial.sigma(depth)
            depth = error + depth
        return depth if lost is None else np.where(lost, np.float32(np.nan), depth)

    def _jitter(self, depth: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Each pixel measures where a neighbour a little off looks."""
        rows, columns = np.indices(depth.shape)
        shift = np.rint(rng.standard_normal((2, *depth.shape)) * self.config.lateral.sigma_px).astype(int)
        height, width = depth.shape
        return depth[np.clip(rows + shift[0], 0, height - 1), np.clip(columns + shift[1], 0, width - 1)]

    def _mix(self, depth: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Some pixels left of a depth edge measure a random mean of both sides (flying pixels)."""
        right = np.roll(depth, -1, axis=1)
        right[:, -1] = depth[:, -1]
        with np.errstate(invalid="ignore"):
            mixed = np.abs(right - depth) > _EDGE_SHARE * depth
        mixed &= rng.random(depth.shape) < self.config.mixed_pixels.share
        weight = rng.random(depth.shape, np.float32)
        return np.where(mixed, weight * depth + (1.0 - weight) * right, depth)

    def _grazing(self, depth: np.ndarray) -> np.ndarray:
        """Pixels whose surface, by central differences, is seen at too flat an angle; beside NaN: none."""
        points = self._rays * depth[..., None]
        normals = np.cross(np.gradient(points, axis=1), np.gradient(points, axis=0))
        with np.errstate(invalid="ignore", divide="ignore"):
            cosine = np.abs(np.sum(normals * points, axis=-1))
            cosine /= np.linalg.norm(normals, axis=-1) * self._lengths * depth
            return cosine < np.cos(np.radians(self.config.grazing.max_incidence_deg))
