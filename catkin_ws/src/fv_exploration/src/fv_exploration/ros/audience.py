"""Who is told what happens: topics, the action's feedback, the run folder, and the octomap services."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import rospy
from fv_msgs.msg import Contacts, ExplorationVolume, MapUpdate, Views
from fv_msgs.msg import Evaluation as EvaluationMsg
from fv_msgs.srv import Screenshot
from numpy.typing import NDArray
from octomap_msgs.msg import Octomap
from octomap_msgs.srv import GetOctomap, GetOctomapResponse
from std_msgs.msg import Header

from fv_exploration import Evaluation, OccupancyMap, PinholeCamera, Utility
from fv_exploration.audience import Step
from fv_exploration.bounds import Bounds
from fv_exploration.ros import conversions
from fv_exploration.run_folder import RunFolder
from fv_exploration.strategy.ranking import Candidates

Array = NDArray[np.float64]
SNAPSHOT_TIMEOUT_S = 60.0


class MapPublisher:
    """The one map's way to everyone else: latched topics and services, as octomap_server names them."""

    def __init__(self, map_frame: str) -> None:
        self._frame = map_frame
        self._messages: dict[bool, Octomap] = {}
        self._update_pub = rospy.Publisher("/fv_exploration/map", MapUpdate, queue_size=1, latch=True)
        self._pubs = {
            binary: rospy.Publisher(name, Octomap, queue_size=1, latch=True)
            for binary, name in ((True, "/octomap_binary"), (False, "/octomap_full"))
        }
        self._services = [
            rospy.Service("/octomap_binary", GetOctomap, lambda _request: self._answer(True)),
            rospy.Service("/octomap_full", GetOctomap, lambda _request: self._answer(False)),
        ]

    def publish(self, occupancy_map: OccupancyMap) -> None:
        """Hand the map on under its sequence number."""
        header = Header(frame_id=self._frame, stamp=rospy.Time.now())
        for binary, publisher in self._pubs.items():
            self._messages[binary] = conversions.octomap_msg(occupancy_map, header, binary)
            publisher.publish(self._messages[binary])
        self._update_pub.publish(conversions.map_update_msg(occupancy_map, self._messages[True]))

    def _answer(self, binary: bool) -> GetOctomapResponse:
        if binary not in self._messages:
            raise rospy.ServiceException("there is no map yet")
        return GetOctomapResponse(self._messages[binary])


class ContactCount:
    """Physics steps with a contact, as far as a simulator on ``/hubo_sim/contacts`` tells them."""

    def __init__(self) -> None:
        self._total: int | None = None
        self._told = 0
        self._sub = rospy.Subscriber("/hubo_sim/contacts", Contacts, self._on_contacts, queue_size=50)

    def since_last(self) -> int | str:
        """Steps since the last call; empty when nobody has told any number."""
        if self._total is None:
            return ""
        steps = max(0, self._total - self._told)  # a reset of the simulator begins at 0 again
        self._told = self._total
        return steps

    def _on_contacts(self, message: Contacts) -> None:
        if self._total is None:
            self._told = message.total
        self._total = message.total


class RosAudience:
    """Publishes each step, writes the run folder, and has pictures taken.

    :param feedback: called with (activity, views, known share, best gain [m^3]).
    :param warn: called with each text of ``Audience.warn``.
    :param camera: intrinsics that are drawn with the views.
    :param folder: None writes nothing.
    """

    def __init__(
        self,
        map_frame: str,
        camera: PinholeCamera,
        map_publisher: MapPublisher,
        feedback: Callable[[str, int, float, float], None],
        warn: Callable[[str], None],
        folder: RunFolder | None,
        snapshot_service: str = "",
    ) -> None:
        self._frame = map_frame
        self._camera = camera
        self._map_publisher = map_publisher
        self._feedback = feedback
        self.warn = warn
        self._folder = folder
        self._snapshot_service = snapshot_service
        self._started = (time.monotonic(), rospy.get_time())
        self._views = 0
        self._known_share = 0.0
        self._best_gain = 0.0
        self._last: tuple[OccupancyMap, Evaluation] | None = None
        self._chosen: tuple[int, Array] | None = None  # number and pose of the view that is next
        self._contacts = ContactCount()
        self._evaluation_pub = rospy.Publisher(
            "/fv_exploration/evaluation", EvaluationMsg, queue_size=1, latch=True
        )
        self._views_pub = rospy.Publisher("/fv_exploration/views", Views, queue_size=1, latch=True)
        self._volume_pub = rospy.Publisher(
            "/fv_exploration/volume", ExplorationVolume, queue_size=1, latch=True
        )

    def volume(self, bounds: Bounds, boxes: list[Bounds], spheres: list[tuple[Array, float]]) -> None:
        """Publish what bounds the exploration, and the clearance: boxes, and spheres by centre and radius [m]."""
        self._volume_pub.publish(conversions.volume_msg(bounds, boxes, spheres, self._header()))

    def activity(self, text: str) -> None:
        """See ``audience.Audience``."""
        rospy.logdebug("%s", text)
        self._feedback(text, self._views, self._known_share, self._best_gain)

    def map_changed(self, occupancy_map: OccupancyMap) -> None:
        """See ``audience.Audience``."""
        self._known_share = occupancy_map.known_share()
        self._map_publisher.publish(occupancy_map)

    def evaluated(self, occupancy_map: OccupancyMap, evaluation: Evaluation, utility: Utility | None) -> None:
        """See ``audience.Audience``."""
        self._last = (occupancy_map, evaluation)
        message = conversions.evaluation_msg(occupancy_map, evaluation, utility, self._header())
        self._evaluation_pub.publish(message)

    def decided(self, candidates: Candidates, chosen: int, step: Step) -> None:
        """See ``audience.Audience``."""
        message = conversions.views_msg(candidates, chosen, self._header())
        if self._last:
            message.map_sequence = self._last[0].sequence
        message.view_number = step.view
        message.horizontal_fov = self._camera.horizontal_fov_rad
        message.vertical_fov = self._camera.vertical_fov_rad
        message.max_range = self._camera.max_range_m
        self._best_gain = float(candidates.gain_m3.max(initial=0.0))
        self._views_pub.publish(message)
        self._chosen = (step.view, candidates.poses[chosen]) if chosen >= 0 else None
        self._snapshot(step)

    def view_done(self, step: Step) -> None:
        """See ``audience.Audience``."""
        self._views = step.view
        if self._folder and self._last:
            self._folder.add_row(self._row(step))
            self._note_view(self._folder, step)
            self._folder.note_known(step.view, self._last[0])
        rospy.loginfo(
            "view %d: %.1f %% of the volume known, %.3f m^3 new (expected %.3f)",
            step.view,
            100.0 * step.known_share,
            step.real_gain_m3,
            step.expected_gain_m3,
        )

    def _note_view(self, folder: RunFolder, step: Step) -> None:
        """Write down the view that was chosen, if it was reached."""
        if self._chosen is None or self._chosen[0] != step.view:
            return
        view, pose = self._chosen
        # Measured joints, to a tenth of the arm's error: what lies below differs between runs of the same seed.
        joints = {name: round(position, 4) for name, position in step.joints.items()}
        figures = {
            "expected_gain_m3": round(step.expected_gain_m3, 4),
            "real_gain_m3": round(step.real_gain_m3, 9),
        }
        folder.add_view({"view": view, **figures, "pose": pose.tolist(), "joints": joints})

    def finish(self) -> None:
        """Write the map and what was last evaluated."""
        if self._folder and self._last:
            self._folder.write_map(*self._last)

    def _row(self, step: Step) -> dict[str, float | str]:
        wall_s, sim_s = time.monotonic() - self._started[0], rospy.get_time() - self._started[1]
        row: dict[str, float | str] = {
            f"{name}_s": round(seconds, 4) for name, seconds in step.seconds.items()
        }
        row.update(step.counts)
        row.update(
            view=step.view,
            wall_s=round(wall_s, 3),
            sim_s=round(sim_s, 3),
            known_share=round(step.known_share, 5),
            expected_gain_m3=round(step.expected_gain_m3, 5),
            real_gain_m3=round(step.real_gain_m3, 5),
            path_length_rad=round(step.path_length_rad, 4),
            duration_s=round(step.duration_s, 3),
            contacts=self._contacts.since_last(),
        )
        return row

    def _snapshot(self, step: Step) -> None:
        """Have a picture taken; a failure is logged and never stops the exploration."""
        if not self._snapshot_service:
            return
        start = time.perf_counter()
        try:
            rospy.wait_for_service(self._snapshot_service, timeout=SNAPSHOT_TIMEOUT_S)
            answer = rospy.ServiceProxy(self._snapshot_service, Screenshot)(
                path=f"view_{step.view:03d}.png",
                title=f"Choosing view {step.view}",
                facts=[
                    f"known {100 * self._known_share:.1f} %",
                    f"best candidate: expected worth {self._best_gain:.3f} m³",
                ],
                map_sequence=self._last[0].sequence if self._last else 0,
            )
            if not answer.success:
                self.warn(f"no picture of view {step.view}: {answer.message}")
        except (rospy.ROSException, rospy.ServiceException) as error:
            self.warn(f"no picture of view {step.view}: {error}")
        step.seconds["screenshot"] = time.perf_counter() - start

    def _header(self) -> Header:
        return Header(frame_id=self._frame, stamp=rospy.Time.now())
