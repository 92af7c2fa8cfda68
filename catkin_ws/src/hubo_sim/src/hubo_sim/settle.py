"""Let the objects of a world fall until they rest: for heaps, which nobody can pose by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from hubo_sim.errors import SimError
from hubo_sim.scene import Scene
from hubo_sim.worlds import World, WorldObject

_DENSITY_KG_M3 = 500.0  # of wood and rubble, voids included
_REST_M = 1e-3  # at rest: nothing has moved further than this ...
_REST_S = 2.0  # ... for this long (velocities do not tell: piles tremble)
_PHYSICS_HZ = 960.0  # thin slabs under load creep at 240 Hz


def settle(world: World, still: tuple[str, ...] = ("floor",), limit_s: float = 30.0) -> tuple[World, float]:
    """The world with all objects but `still` where they come to rest, and the largest way that one moved [m].

    Deterministic. Raises SimError when something still moves after limit_s simulated seconds.
    """
    loose = {item.name for item in world.objects} - set(still)
    with Scene(_PHYSICS_HZ, egl=False) as scene:
        for item in world.objects:
            body = scene.add_object(
                replace(item, fixed=False, mass_kg=_mass(item)) if item.name in loose else item
            )
            scene.client.changeDynamics(body, -1, lateralFriction=0.9, linearDamping=0.1, angularDamping=0.1)
        _run_until_rest(scene, limit_s)
        poses = {item.name: item.T_world_object for item in scene.current_objects()}
    objects = tuple(
        replace(item, T_world_object=poses[item.name]) if item.name in loose else item
        for item in world.objects
    )
    ways = [np.linalg.norm(poses[item.name][:3, 3] - item.T_world_object[:3, 3]) for item in world.objects]
    return replace(world, objects=objects), float(max(ways))


def _run_until_rest(scene: Scene, limit_s: float) -> None:
    last = _positions(scene)
    for _ in range(round(limit_s / _REST_S)):
        for _ in range(round(_REST_S / scene.step_s)):
            scene.client.stepSimulation()
        now = _positions(scene)
        moved = np.linalg.norm(now - last, axis=1)
        if moved.max() < _REST_M:
            return
        last = now
    raise SimError(f"still moves after {limit_s:g} s: {list(scene.bodies)[int(moved.argmax())]}")


def _positions(scene: Scene) -> np.ndarray:
    return np.array([scene.object_pose(name)[:3, 3] for name in scene.bodies])


def _mass(item: WorldObject) -> float:
    """Of a solid of that shape; what is no primitive keeps its own."""
    size = item.size
    if item.shape == "box":
        return _DENSITY_KG_M3 * float(np.prod(size["size_m"]))
    if item.shape == "cylinder":
        return _DENSITY_KG_M3 * math.pi * size["radius_m"] ** 2 * size["length_m"]
    if item.shape == "sphere":
        return _DENSITY_KG_M3 * 4.0 / 3.0 * math.pi * size["radius_m"] ** 3
    return item.mass_kg
