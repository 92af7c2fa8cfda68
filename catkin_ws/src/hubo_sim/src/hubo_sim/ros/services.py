"""Services about the world and about time, under the names that Gazebo's have."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import numpy as np
import rospy
from fv_msgs import srv
from std_srvs.srv import Empty, EmptyResponse

from fv_common.conversions import pose_from_matrix
from hubo_sim.config import SimConfig
from hubo_sim.errors import SimError
from hubo_sim.paths import resolve_file
from hubo_sim.ros.conversions import header, place_from_pose, time_from_ns
from hubo_sim.ros.requests import RequestQueue
from hubo_sim.simulator import Simulator
from hubo_sim.worlds import WorldObject
from hubo_sim.worlds.scene import place_root


class Node(Protocol):
    """What these services ask of the node; all but `request_steps` are called in the simulator's thread."""

    sim: Simulator
    config: SimConfig
    requests: RequestQueue

    def pause(self) -> None: ...

    def unpause(self) -> None: ...

    def reset(self) -> None: ...

    def publish_base_transform(self) -> None: ...

    def request_steps(self, count: int) -> float: ...


class WorldServices:
    """Pause, step and reset; spawn, delete, move and list models. Every answer is given once it is so."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._sim = node.sim
        self._ask = node.requests.ask
        self._folder = tempfile.TemporaryDirectory(prefix="hubo_sim_")
        self._models = 0

    def open(self) -> None:
        """Begin to listen."""
        calls: dict[str, tuple] = {
            "pause_physics": (Empty, self._empty(self._node.pause)),
            "unpause_physics": (Empty, self._empty(self._node.unpause)),
            "reset_simulation": (Empty, self._empty(self._node.reset)),
            "reset_world": (Empty, self._empty(self._node.reset)),
            "step_physics": (srv.StepPhysics, self._step),
            "spawn_urdf_model": (srv.SpawnModel, lambda request: self._spawn(request, "urdf")),
            "spawn_sdf_model": (srv.SpawnModel, lambda request: self._spawn(request, "sdf")),
            "delete_model": (srv.DeleteModel, self._delete),
            "get_model_state": (srv.GetModelState, self._get_state),
            "set_model_state": (srv.SetModelState, self._set_state),
            "get_world_properties": (srv.GetWorldProperties, self._list),
        }
        for name, (kind, call) in calls.items():
            rospy.Service(f"/hubo_sim/{name}", kind, call)

    def _empty(self, function: Callable[[], None]) -> Callable:
        def call(_) -> EmptyResponse:
            self._ask(function)
            return EmptyResponse()

        return call

    def _answer(self, response: Callable, function: Callable[[], dict | None]):
        """The response to `function` run in the simulator's thread; success tells the truth."""
        try:
            return response(success=True, status_message="", **(self._ask(function) or {}))
        except (SimError, ValueError) as err:
            return response(success=False, status_message=str(err))

    def _step(self, request):
        try:
            return srv.StepPhysicsResponse(True, "", self._node.request_steps(request.steps))
        except SimError as err:
            return srv.StepPhysicsResponse(False, str(err), self._sim.now_s)

    def _spawn(self, request, shape: str):
        def done() -> None:
            self._require_world_frame(request.reference_frame)
            if not request.model_name or request.model_name == self._robot_name or "::" in request.model_name:
                raise SimError(f"model_name {request.model_name!r} is empty, the robot's or has '::' in it")
            file = self._model_file(request, shape)
            pose = place_from_pose(request.initial_pose)
            size = {"file": str(file), "scale": 1.0}
            item = WorldObject(request.model_name, shape, size, pose, (1, 1, 1, 1), request.fixed, 1.0)
            self._sim.scene.add_object(item)
            self._refuse_inside_robot(request.model_name)

        return self._answer(srv.SpawnModelResponse, done)

    def _model_file(self, request, shape: str) -> Path:
        """The model's file: the one that the request names, or one of our own, kept while the node runs."""
        if not request.model_xml:
            return Path(resolve_file(request.model_file, "model_file"))
        self._models += 1
        path = Path(self._folder.name) / f"{self._models}.{shape}"
        path.write_text(request.model_xml)
        return path

    def _refuse_inside_robot(self, name: str) -> None:
        scene, robot = self._sim.scene, self._sim.robot
        scene.client.performCollisionDetection()
        touching = scene.client.getContactPoints(bodyA=robot.body, bodyB=scene.bodies[name])
        if any(point[8] < 0.0 for point in touching):
            scene.remove_object(name)
            link = robot.link_name[touching[0][3]]
            raise SimError(f"model {name!r} would be inside of the robot's {link}: not spawned")

    def _delete(self, request):
        return self._answer(
            srv.DeleteModelResponse, lambda: self._sim.scene.remove_object(self._existing(request.model_name))
        )

    def _get_state(self, request):
        def done() -> dict:
            self._require_world_frame(request.relative_entity_name)
            out = srv.GetModelStateResponse()
            head = header(time_from_ns(self._sim.clock_ns), self._node.config.world_frame)
            pose, linear, angular = self._state_of(request.model_name)
            out.twist.linear.x, out.twist.linear.y, out.twist.linear.z = linear
            out.twist.angular.x, out.twist.angular.y, out.twist.angular.z = angular
            return {"header": head, "pose": pose_from_matrix(pose), "twist": out.twist}

        return self._answer(srv.GetModelStateResponse, done)

    def _state_of(self, name: str) -> tuple:
        """T_world_model (4, 4), linear and angular velocity, (3,) each, of a model, the robot, or robot::link."""
        model, separator, link = name.partition("::")
        if model == self._robot_name:
            link = link if separator else self._sim.spec.base_link
            return self._sim.robot.link_pose(link), *self._sim.robot.link_velocity(link)
        scene = self._sim.scene
        return scene.object_pose(self._existing(name)), *scene.client.getBaseVelocity(scene.bodies[name])

    def _set_state(self, request):
        def done() -> None:
            pose = place_from_pose(request.pose)
            if request.model_name == self._robot_name:
                self._sim.robot.move_base(pose)
                self._node.publish_base_transform()
                return
            linear, angular = request.twist.linear, request.twist.angular
            twist = np.array([[v.x, v.y, v.z] for v in (linear, angular)])
            if not np.isfinite(twist).all():
                raise SimError("twist must be finite")
            body = self._sim.scene.bodies[self._existing(request.model_name)]
            place_root(self._sim.scene.client, body, pose)
            self._sim.scene.client.resetBaseVelocity(body, *twist.tolist())

        return self._answer(srv.SetModelStateResponse, done)

    def _list(self, _):
        def done() -> dict:
            return {"sim_time": self._sim.now_s, "model_names": [self._robot_name, *self._sim.scene.bodies]}

        return self._answer(srv.GetWorldPropertiesResponse, done)

    @property
    def _robot_name(self) -> str:
        return self._sim.spec.config.get("name", "robot")

    def _existing(self, name: str) -> str:
        known = self._sim.scene.bodies
        if name not in known:
            raise SimError(f"no model {name!r}; there are: {', '.join([self._robot_name, *known])}")
        return name

    def _require_world_frame(self, frame: str) -> None:
        world = self._node.config.world_frame
        if frame not in ("", "world", world):
            raise SimError(f"frame {frame!r} is not supported, only {world!r}")
