"""The truth about the world as a service."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import rospy
from fv_msgs import srv
from octomap_msgs.msg import Octomap

from hubo_sim.background import run_apart
from hubo_sim.errors import SimError
from hubo_sim.ground_truth import TruthRequest, octree_data, true_voxels
from hubo_sim.ros.conversions import header, time_from_ns
from hubo_sim.simulator import Simulator


class TruthService:
    """Answers /hubo_sim/ground_truth; ask_sim(function) runs a function in the simulator's thread."""

    def __init__(self, sim: Simulator, ask_sim: Callable, world_frame: str) -> None:
        self._sim, self._ask_sim, self._frame = sim, ask_sim, world_frame

    def open(self) -> None:
        """Begin to listen."""
        rospy.Service("/hubo_sim/ground_truth", srv.GroundTruth, self._on_request)

    def _on_request(self, request) -> srv.GroundTruthResponse:
        try:
            world, now_ns = self._ask_sim(lambda: (self._sim.current_world(), self._sim.clock_ns))
            asked = TruthRequest(world, self._sim.spec, request.what, request.resolution)
            asked.check()
            found, data = run_apart(_voxels_and_tree, asked, rospy.is_shutdown)
        except (SimError, ValueError) as err:
            return srv.GroundTruthResponse(success=False, status_message=str(err))
        head = header(time_from_ns(now_ns), self._frame)
        tree = Octomap(head, True, "OcTree", request.resolution, np.frombuffer(data, np.int8).tolist())
        return srv.GroundTruthResponse(
            success=True,
            map=tree,
            voxels=len(found.centres),
            samples=found.samples,
            settled=found.settled,
        )


def _voxels_and_tree(request: TruthRequest) -> tuple:
    """The answer and the nodes of its octree."""
    found = true_voxels(request)
    return found, octree_data(found.centres, np.zeros((0, 3)), request.resolution_m)[0]
