"""Off-screen pictures of a scene from any pose, as PNG files."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np

from fv_common.files import write_whole
from fv_common.transforms import look_at
from hubo_sim.robot_spec import RobotSpec
from hubo_sim.sensors.render import Pinhole, take_picture
from hubo_sim.sim_robot import SimRobot
from hubo_sim.worlds import ViewPoint, World
from hubo_sim.worlds.scene import Scene

_NEAR_M, _FAR_M = 0.05, 150.0
_SKY = np.array([0.86, 0.90, 0.94])


def picture_of(
    scene: Scene, view: ViewPoint, width: int = 960, height: int = 720, fine: int = 2
) -> np.ndarray:
    """(height, width, 3) uint8 picture of a scene from a viewpoint in world coordinates.

    fine: drawn that many times as fine in each direction and then averaged, for smooth edges.
    """
    fov = np.radians(view.fov_deg)
    vertical = 2.0 * np.arctan(np.tan(fov / 2.0) * height / width)
    camera = Pinhole(fine * width, fine * height, fov, vertical)
    picture = take_picture(scene, camera, look_at(view.eye_m, view.target_m), _NEAR_M, _FAR_M, shadows=True)
    rgb = np.where(np.isnan(picture.depth)[..., None], 255.0 * _SKY, picture.rgb)
    return rgb.reshape(height, fine, width, fine, 3).mean(axis=(1, 3)).astype(np.uint8)


def render_scene(
    world: World,
    spec: RobotSpec | None,
    joint_positions: dict[str, float] | None = None,
    view: ViewPoint | None = None,
    size: tuple[int, int] = (960, 720),
) -> bytes:
    """PNG picture of a world with a robot in it (none: the world alone).

    joint_positions [rad] by name; those left out are as at the robot's start. view: default the world's own camera.
    """
    with Scene() as scene:
        scene.load_world(world)
        if spec is not None:
            robot = SimRobot(scene, spec, spec.base_pose(world.robot))
            robot.set_positions(spec.start_positions() | (joint_positions or {}))
        return png_bytes(picture_of(scene, view or world.camera, *size))


def png_bytes(rgb: np.ndarray) -> bytes:
    """PNG (RFC 2083) of an image (H, W, 3) uint8."""
    height, width = rgb.shape[:2]
    rows = np.zeros((height, 1 + 3 * width), np.uint8)  # each row begins with its filter: 0, none
    rows[:, 1:] = rgb.reshape(height, -1)
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = [(b"IHDR", head), (b"IDAT", zlib.compress(rows.tobytes(), 6)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(kind, data) for kind, data in chunks)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def write_png(path: str | Path, rgb: np.ndarray) -> None:
    """Write an image (H, W, 3) uint8 as PNG, whole or not at all. Raises OSError."""
    write_whole(path, png_bytes(rgb))
