"""What a structured-light depth camera gets wrong, each part with its own switch."""

from __future__ import annotations

import numpy as np

from hubo_description.sensors import AxialNoise
from hubo_description.sensors import DepthNoise as NoiseConfig
from hubo_sim.sensors.render import Pinhole

# A pixel belongs to a depth edge when a neighbour's depth differs by more than this share of its own.
_EDGE_SHARE = 0.03


def axial_sigma(noise: AxialNoise, depth_m: np.ndarray) -> np.ndarray:
    """Standard deviation [m] at depths [m], any shape: Nguyen et al. 2012, equation 3 without the angle."""
    out = np.subtract(depth_m, noise.offset_m)
    out *= out
    out *= noise.sigma_quadratic_per_m
    out += noise.sigma_base_m
    return out


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
            error *= axial_sigma(config.axial, depth)
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
