"""Pinhole pictures of a scene: colour, depth along the optical axis, and which body each pixel shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fv_common.transforms import inverse
from hubo_sim.bullet import pybullet
from hubo_sim.errors import SimError
from hubo_sim.worlds.scene import Scene

# An optical frame has x right, y down, z forward; OpenGL's camera has x right, y up, z backward.
_OPTICAL_TO_GL = np.diag([1.0, -1.0, -1.0, 1.0])

# TinyRenderer samples a pixel at its lower left corner instead of its centre (measured: test_render.py).
_TINY_SHIFT_PX = (-0.5, 0.5)

# The EGL plugin draws into a window of this size and stretches its pixels where more are asked for.
_EGL_WINDOW_PX = (1024, 768)


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
        return self.tile_projection((0, 0, self.width, self.height), near_m, far_m, shift_px)

    def tile_projection(
        self,
        tile: tuple[int, int, int, int],
        near_m: float,
        far_m: float,
        shift_px: tuple[float, float] = (0.0, 0.0),
    ) -> list[float]:
        """As `projection`, for a part of the picture: first column, first row, width, height [pixel]."""
        u, v, width, height = tile
        # Twice the way that the content moves [pixel]:
        right = self.width - width - 2.0 * u + 2.0 * shift_px[0]
        down = self.height - height - 2.0 * v + 2.0 * shift_px[1]
        matrix = np.zeros((4, 4))
        matrix[0, 0] = 2.0 * self.fx / width
        matrix[1, 1] = 2.0 * self.fy / height
        matrix[0, 2] = -right / width
        matrix[1, 2] = down / height
        matrix[2, 2] = -(far_m + near_m) / (far_m - near_m)
        matrix[2, 3] = -2.0 * far_m * near_m / (far_m - near_m)
        matrix[3, 2] = -1.0
        return matrix.flatten(order="F").tolist()

    def tiles(self, largest_px: tuple[int, int]) -> list[tuple[int, int, int, int]]:
        """Parts of at most that width and height, rows of them from the top: first column, first row, width, height."""
        across, down = largest_px
        return [
            (u, v, min(across, self.width - u), min(down, self.height - v))
            for v in range(0, self.height, down)
            for u in range(0, self.width, across)
        ]


@dataclass(frozen=True)
class Picture:
    """What a camera sees.

    depth (H, W) float32 [m] along the optical axis, NaN where nothing is; rgba (H, W, 4) uint8, contiguous;
    body (H, W) ids, -1: none.
    """

    depth: np.ndarray
    rgba: np.ndarray
    body: np.ndarray | None

    @property
    def rgb(self) -> np.ndarray:
        """(H, W, 3) uint8."""
        return self.rgba[..., :3]


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
    with_bodies = with_bodies or not scene.uses_egl  # TinyRenderer's depth does not tell where nothing is
    view, flags = view_matrix(T_world_optical), _flags(scene, shadows, with_bodies)
    shift = (0.0, 0.0) if scene.uses_egl else _TINY_SHIFT_PX
    tiles = camera.tiles(_EGL_WINDOW_PX if scene.uses_egl else (camera.width, camera.height))
    parts = []
    for tile in tiles:
        projection = camera.tile_projection(tile, near_m, far_m, shift)
        parts.append(_draw(scene, tile[2:], (view, projection), shadows, flags))
    rgba, buffer, bodies = parts[0] if len(parts) == 1 else _joined(camera, tiles, parts)
    depth = _depth_of(buffer, near_m, far_m)
    if with_bodies:
        np.copyto(depth, np.nan, where=bodies < 0)
    return Picture(depth, rgba, bodies if with_bodies else None)


def _flags(scene: Scene, shadows: bool, with_bodies: bool) -> int:
    """The EGL plugin draws shadows always but in projective texture mode, which paints textures wrongly.

    Without the shadow map (4096 x 4096) a picture takes a third of the time; its depth is the same to the bit.
    """
    flags = 0 if with_bodies else pybullet.ER_NO_SEGMENTATION_MASK
    if scene.uses_egl and not shadows and not scene.has_textures:
        flags |= pybullet.ER_USE_PROJECTIVE_TEXTURE
    return flags


def _draw(
    scene: Scene, size: tuple[int, int], matrices: tuple[list[float], list[float]], shadows: bool, flags: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """rgba (H, W, 4) uint8, depth buffer (H, W) float32 within [0, 1] and body ids (H, W) of one drawing."""
    width, height = size
    _, _, rgba, buffer, bodies = scene.client.getCameraImage(
        width,
        height,
        *matrices,
        shadow=int(shadows),
        lightDirection=[1.0, -1.5, 3.0],
        renderer=pybullet.ER_BULLET_HARDWARE_OPENGL if scene.uses_egl else pybullet.ER_TINY_RENDERER,
        flags=flags,
    )
    return (
        np.asarray(rgba, np.uint8).reshape(height, width, 4),
        np.asarray(buffer, np.float32).reshape(height, width),
        np.asarray(bodies, np.int32).reshape(height, width),
    )


def _joined(camera: Pinhole, tiles: list, parts: list) -> list[np.ndarray]:
    """The arrays of the whole picture from those of its tiles."""
    out = [np.empty((camera.height, camera.width, *a.shape[2:]), a.dtype) for a in parts[0]]
    for (u, v, width, height), part in zip(tiles, parts, strict=True):
        for whole, piece in zip(out, part, strict=True):
            whole[v : v + height, u : u + width] = piece
    return out


def _depth_of(buffer: np.ndarray, near_m: float, far_m: float) -> np.ndarray:
    """(H, W) float32 depth [m] of OpenGL's depth buffer (H, W); NaN at the far plane, where nothing is."""
    depth = buffer * np.float32(near_m - far_m)
    depth += np.float32(far_m)
    with np.errstate(divide="ignore"):
        np.divide(np.float32(far_m * near_m), depth, out=depth)
    np.copyto(depth, np.nan, where=buffer >= 1.0)
    return depth
