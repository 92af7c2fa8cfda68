"""A pybullet world in this process: one physics client, the objects of a world file, their names."""

from __future__ import annotations

import importlib.util
import logging
import os
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from fv_common.native_output import native_output_hidden
from fv_common.transforms import inverse, quaternion_of, transform
from hubo_sim.bullet import BulletClient, pybullet, pybullet_data
from hubo_sim.errors import SimError
from hubo_sim.worlds.models import sdf_for_bullet, urdf_for_bullet
from hubo_sim.worlds.textures import has_texture
from hubo_sim.worlds.world import World, WorldObject

GRAVITY_M_S2 = 9.81
_log = logging.getLogger(__name__)


class Scene:
    """Physics client with gravity and a fixed step, filled from a world file.

    Not thread safe: one thread owns it. `close` (or the context manager) frees the client.
    """

    def __init__(self, physics_rate_hz: float = 240.0, gui: bool = False, egl: bool = True) -> None:
        if gui and not os.environ.get("DISPLAY"):
            raise SimError("gui: there is no display")
        with native_output_hidden():
            try:
                self.client = BulletClient(pybullet.GUI if gui else pybullet.DIRECT)
            except pybullet.error as err:
                raise SimError(f"the physics engine does not start: {err}") from err
            self._egl_plugin = _load_egl(self.client) if egl and not gui else -1
        if egl and not gui and not self.uses_egl:
            _log.warning(
                "pybullet's EGL renderer does not load (it needs libegl1 and libgl1-mesa-dri): TinyRenderer draws, "
                "the same geometry more slowly"
            )
        self.client.setAdditionalSearchPath(pybullet_data.getDataPath())
        self.client.setGravity(0.0, 0.0, -GRAVITY_M_S2)
        self.client.setPhysicsEngineParameter(
            fixedTimeStep=1.0 / physics_rate_hz, deterministicOverlappingPairs=1
        )
        self.step_s = 1.0 / physics_rate_hz
        self.bodies: dict[str, int] = {}  # name -> body id, the world's objects only
        self._items: dict[str, WorldObject] = {}  # what they were made from
        self._textured: set[int] = set()  # bodies with pictures on their surfaces

    @property
    def uses_egl(self) -> bool:
        """Whether pictures come from the EGL plugin rather than TinyRenderer."""
        return self._egl_plugin >= 0

    @property
    def has_textures(self) -> bool:
        """Whether any body has a picture on its surface."""
        return bool(self._textured)

    def note_textures(self, body: int, description: str = "") -> None:
        """Remember whether a body that was loaded has textures; description: its URDF or SDF, if it came from one."""
        if has_texture(self.client, body, description):
            self._textured.add(body)

    def __enter__(self) -> Scene:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def close(self) -> None:
        """Free the client; the scene is unusable afterwards. A second call does nothing."""
        if self.client is not None:
            with native_output_hidden():
                self.client.disconnect()
            self.client = None

    def load_world(self, world: World) -> None:
        """Add every object of a world. Raises SimError naming the object that does not load."""
        self.client.configureDebugVisualizer(
            pybullet.COV_ENABLE_RENDERING, 0
        )  # a window would redraw each time
        try:
            for item in world.objects:
                self.add_object(item)
        finally:
            self.client.configureDebugVisualizer(pybullet.COV_ENABLE_RENDERING, 1)

    def add_object(self, item: WorldObject) -> int:
        """Add one object and return its body id. Raises SimError when the name is taken or the file is broken."""
        if item.name in self.bodies:
            raise SimError(f"an object named {item.name!r} exists already")
        try:
            with native_output_hidden():
                body, description = self._create(item)
        except pybullet.error as err:
            raise SimError(f"object {item.name!r} does not load: {err}") from err
        self.bodies[item.name], self._items[item.name] = body, item
        self.note_textures(body, description)
        return body

    def remove_object(self, name: str) -> None:
        """Remove an object of the world. Raises SimError, listing the names, when there is none of that name."""
        if name not in self.bodies:
            raise SimError(f"no object named {name!r}; there are: {', '.join(sorted(self.bodies)) or 'none'}")
        body = self.bodies.pop(name)
        del self._items[name]
        self._textured.discard(body)
        self.client.removeBody(body)

    def object_pose(self, name: str) -> np.ndarray:
        """T_world_object (4, 4) of the root link's frame."""
        return root_pose(self.client, self.bodies[name])

    def current_objects(self) -> tuple[WorldObject, ...]:
        """The world's objects where they are now; the joints of URDF and SDF models are taken at zero."""
        return tuple(
            replace(item, T_world_object=self.object_pose(name)) for name, item in self._items.items()
        )

    def _create(self, item: WorldObject) -> tuple[int, str]:
        """Body id, and the URDF or SDF that it comes from, if any."""
        if item.shape in ("urdf", "sdf"):
            return self._create_from_file(item)
        position, quaternion = item.T_world_object[:3, 3], quaternion_of(item.T_world_object)
        collision, visual = self._shapes(item)
        if collision < 0 or visual < 0:
            raise SimError(f"object {item.name!r}: its mesh cannot be read")
        body = self.client.createMultiBody(
            baseMass=0.0 if item.fixed else item.mass_kg,
            baseCollisionShapeIndex=collision,
            baseVisualShapeIndex=visual,
            basePosition=position,
            baseOrientation=quaternion,
        )
        self.client.changeDynamics(body, -1, lateralFriction=0.8)
        return body, ""

    def _shapes(self, item: WorldObject) -> tuple[int, int]:
        """Collision and visual shape; a fixed mesh collides as exactly the triangles that are seen."""
        kinds = {"box": pybullet.GEOM_BOX, "cylinder": pybullet.GEOM_CYLINDER, "sphere": pybullet.GEOM_SPHERE}
        kind = kinds.get(item.shape, pybullet.GEOM_MESH)
        size = item.size
        if item.shape == "box":
            collision = visual = {"halfExtents": size["size_m"] / 2.0}
        elif item.shape == "cylinder":
            collision = {"radius": size["radius_m"], "height": size["length_m"]}
            visual = {"radius": size["radius_m"], "length": size["length_m"]}
        elif item.shape == "sphere":
            collision = visual = {"radius": size["radius_m"]}
        else:
            visual = {"fileName": size["file"], "meshScale": size["scale"]}
            collision = dict(visual, flags=pybullet.GEOM_FORCE_CONCAVE_TRIMESH if item.fixed else 0)
        return (
            self.client.createCollisionShape(kind, **collision),
            self.client.createVisualShape(
                kind, rgbaColor=item.color, specularColor=[0.1, 0.1, 0.1], **visual
            ),
        )

    def _create_from_file(self, item: WorldObject) -> tuple[int, str]:
        source, scale = Path(item.size["file"]), float(item.size["scale"])
        prepare = urdf_for_bullet if item.shape == "urdf" else sdf_for_bullet
        try:
            text = prepare(source.read_text(), source.parent)
        except (SimError, OSError, UnicodeDecodeError) as err:
            raise SimError(f"object {item.name!r}: {err}") from err
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / f"model.{item.shape}"
            file.write_text(text)
            if item.shape == "urdf":
                body = self.client.loadURDF(str(file), useFixedBase=item.fixed, globalScaling=scale)
            else:
                (body,) = self.client.loadSDF(str(file), globalScaling=scale)
                if item.fixed:
                    self.client.changeDynamics(body, -1, mass=0.0)
        place_root(self.client, body, item.T_world_object)
        return body, text


def root_pose(client: BulletClient, body: int) -> np.ndarray:
    """T_world_root (4, 4) of a body's root link frame; pybullet itself speaks of the inertial frame."""
    T_world_inertial = transform(*client.getBasePositionAndOrientation(body))
    return T_world_inertial @ inverse(_inertial_offset(client, body))


def place_root(client: BulletClient, body: int, T_world_root: np.ndarray) -> None:
    """Put a body's root link frame at T_world_root (4, 4), at rest."""
    T = T_world_root @ _inertial_offset(client, body)
    client.resetBasePositionAndOrientation(body, T[:3, 3], quaternion_of(T))


def _inertial_offset(client: BulletClient, body: int) -> np.ndarray:
    """T_root_inertial (4, 4)."""
    info = client.getDynamicsInfo(body, -1)
    return transform(info[3], info[4])


def _load_egl(client: BulletClient) -> int:
    """Load the EGL renderer into a client; -1 when it is not there or has no GL to run on."""
    spec = importlib.util.find_spec("eglRenderer")
    if spec is None or spec.origin is None:
        return -1
    return client.loadPlugin(spec.origin, "_eglRendererPlugin")
