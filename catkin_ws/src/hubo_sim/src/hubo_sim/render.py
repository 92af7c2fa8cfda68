"""Pinhole pictures of a scene: colour, depth along the optical axis, and which body each pixel shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hubo_sim.bullet import pybullet
from hubo_sim.errors import SimError
from hubo_sim.scene import Scene
from hubo_sim.transforms import inverse

# An optical frame has x right, y down, z forward; OpenGL's camera has x right, y up, z backward.
_OPTICAL_TO_GL = np.diag([1.0, -1.0, -1.0, 1.0])

# TinyRenderer samples a pixel at its lower left corner instead of its centre (measured: test_render.py).
_TINY_SHIFT_PX = (-0.5, 0.5)


@dataclass(frozen=True)
class Pinhole:
    """An ideal camera. Pixel (u, v) has its centre at integer u, v, as in sensor_msgs/CameraInfo."""

    width: int
    height: int
    horizontal_fov_rad: float
    vertical_fov_rad: float

    def __post_init__(self) -> None:
        if not (self.width >= 1 and self.height >= 1):
            raise SimError(f"a camera needs at least one pixel, got {self.width} x {self.height}")
        for name in ("horizontal_fov_rad", "vertical_fov_rad"):
            if not 0.0 < getattr(self, name) < np.pi:
                raise SimError(f"{name} must be within (0, pi), got {getattr(self, name)}")

    @property
    def fx(self) -> float:
        """Focal length in pixels, horizontal."""
        return self.width / 2.0 / np.tan(self.horizontal_fov_rad / 2.0)

    @property
    def fy(self) -> float:
        """Focal length in pixels, vertical."""
        return self.height / 2.0 / np.tan(self.vertical_fov_rad / 2.0)

    @property
    def cx(self) -> float:
        """Principal point, horizontal [pixel]."""
        return (self.width - 1) / 2.0

    @property
    def cy(self) -> float:
        """Principal point, vertical [pixel]."""
        return (self.height - 1) / 2.0

    def rays(self) -> np.ndarray:
        """(height, width, 3) points at depth 1 in the optical frame, one per pixel centre."""
        x = (np.arange(self.width) - self.cx) / self.fx
        y = (np.arange(self.height) - self.cy) / self.fy
        out = np.ones((self.height, self.width, 3))
        out[..., 0], out[..., 1] = np.meshgrid(x, y)
        return out

    def projection(
        self, near_m: float, far_m: float, shift_px: tuple[float, float] = (0.0, 0.0)
    ) -> list[float]:
        """OpenGL projection matrix, column-major; shift_px moves the picture's content right and down [pixel]."""
        matrix = np.zeros((4, 4))
        matrix[0, 0] = 1.0 / np.tan(self.horizontal_fov_rad / 2.0)
        matrix[1, 1] = 1.0 / np.tan(self.vertical_fov_rad / 2.0)
        matrix[0, 2] = -2.0 * shift_px[0] / self.width
        matrix[1, 2] = 2.0 * shift_px[1] / self.height
        matrix[2, 2] = -(far_m + near_m) / (far_m - near_m)
        matrix[2, 3] = -2.0 * far_m * near_m / (far_m - near_m)
        matrix[3, 2] = -1.0
        return matrix.flatten(order="F").tolist()


@dataclass(frozen=True)
class Picture:
    """depth (H, W) [m] along the optical axis, NaN where nothing is; rgb (H, W, 3) uint8; body (H, W) ids, -1: none."""

    depth: np.ndarray
    rgb: np.ndarray
    body: np.ndarray | None


def view_matrix(T_world_optical: np.ndarray) -> list[float]:
    """OpenGL view matrix, column-major, of a camera at any orientation: no up vector is assumed."""
    return inverse(T_world_optical @ _OPTICAL_TO_GL).flatten(order="F").tolist()


def take_picture(
    scene: Scene,
    camera: Pinhole,
    T_world_optical: np.ndarray,
    near_m: float,
    far_m: float,
    shadows: bool = False,
    with_bodies: bool = False,
) -> Picture:
    """Render the scene from T_world_optical (4, 4), with whatever renderer the scene has.

    with_bodies: fill Picture.body, which costs the EGL plugin a second drawing.
    """
    with_bodies = (
        with_bodies or not scene.uses_egl
    )  # TinyRenderer's depth buffer does not tell where nothing is
    renderer = pybullet.ER_BULLET_HARDWARE_OPENGL if scene.uses_egl else pybullet.ER_TINY_RENDERER
    _, _, rgba, buffer, bodies = scene.client.getCameraImage(
        camera.width,
        camera.height,
        view_matrix(T_world_optical),
        camera.projection(near_m, far_m, (0.0, 0.0) if scene.uses_egl else _TINY_SHIFT_PX),
        shadow=int(shadows),
        lightDirection=[1.0, -1.5, 3.0],
        renderer=renderer,
        flags=0 if with_bodies else pybullet.ER_NO_SEGMENTATION_MASK,
    )
    shape = (camera.height, camera.width)
    buffer = np.asarray(buffer, np.float64).reshape(shape)
    with np.errstate(divide="ignore"):
        depth = far_m * near_m / (far_m - (far_m - near_m) * buffer)
    seen, body = buffer < 1.0, None
    if with_bodies:
        body = np.asarray(bodies, np.int32).reshape(shape)
        seen &= body >= 0
    return Picture(
        np.where(seen, depth, np.nan), np.asarray(rgba, np.uint8).reshape(*shape, 4)[..., :3], body
    )
