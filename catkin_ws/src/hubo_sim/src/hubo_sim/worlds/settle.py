"""Let the objects of a world fall until they rest: heaps are dropped, not posed by hand.

The worlds that ship hold the poses that came out, so that a world loads at once and is the same on every machine.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from hubo_sim.errors import SimError
from hubo_sim.worlds.scene import Scene
from hubo_sim.worlds.world import World, WorldObject

_DENSITY_KG_M3 = 500.0  # of wood and rubble, voids included
_PHYSICS_HZ = 480.0
_LARGEST_SPEED_M_S = 0.8  # objects that overlap at the start are pushed apart, not shot away
_REST_M = 1e-3  # at rest: nothing has moved further than this within a second (velocities do not tell: piles tremble)
_DYNAMICS = {
    "lateralFriction": 0.9,
    "rollingFriction": 0.003,
    "spinningFriction": 0.003,
    "linearDamping": 0.2,
    "angularDamping": 0.3,
}


def settle(world: World, still: tuple[str, ...] = ("floor",), limit_s: int = 30) -> World:
    """The world with all objects but `still` where they come to rest. Deterministic.

    Raises SimError naming an object that still moves after limit_s simulated seconds.
    """
    with Scene(_PHYSICS_HZ, egl=False) as scene:
        loose = [item for item in world.objects if item.name not in still]
        for item in world.objects:
            is_loose = item.name not in still
            body = scene.add_object(replace(item, fixed=False, mass_kg=_mass(item)) if is_loose else item)
            scene.client.changeDynamics(body, -1, **_DYNAMICS)
        _run_until_rest(scene, [item.name for item in loose], limit_s)
        rested = {item.name: item.T_world_object for item in scene.current_objects()}
    return replace(
        world, objects=tuple(replace(item, T_world_object=rested[item.name]) for item in world.objects)
    )


def largest_way(before: World, after: World) -> float:
    """How far the object that moved furthest has moved between two states of a world [m]."""
    ways = [
        float(np.linalg.norm(a.T_world_object[:3, 3] - b.T_world_object[:3, 3]))
        for a, b in zip(before.objects, after.objects, strict=True)
    ]
    return max(ways, default=0.0)


def _run_until_rest(scene: Scene, loose: list[str], limit_s: int) -> None:
    last = _positions(scene, loose)
    for _ in range(limit_s):
        for _ in range(round(_PHYSICS_HZ)):
            scene.client.stepSimulation()
            for name in loose:
                _hold_back(scene, scene.bodies[name])
        now = _positions(scene, loose)
        moved = np.linalg.norm(now - last, axis=1)
        if moved.max(initial=0.0) < _REST_M:
            return
        last = now
    raise SimError(f"still moves after {limit_s} s: {loose[int(moved.argmax())]}")


def _hold_back(scene: Scene, body: int) -> None:
    linear, angular = scene.client.getBaseVelocity(body)
    slower = _LARGEST_SPEED_M_S / max(math.hypot(*linear), math.hypot(*angular) / 5.0, _LARGEST_SPEED_M_S)
    if slower < 1.0:
        scene.client.resetBaseVelocity(body, [slower * v for v in linear], [slower * v for v in angular])


def _positions(scene: Scene, names: list[str]) -> np.ndarray:
    return np.array([scene.object_pose(name)[:3, 3] for name in names]).reshape(-1, 3)


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
