"""Every figure by its number in the thesis: how it is made, what the thesis shows there, and what differs."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from fv_figures import arms, scans
from fv_figures.compose import Figure
from fv_figures.material import Material


@dataclasses.dataclass(frozen=True)
class Caption:
    """The thesis's figure in a few words, and how ours differs from it; {scene} is what ours is of."""

    thesis: str
    differs: str


FIGURES: dict[str, Callable[[Material], Figure]] = dict(sorted({**scans.FIGURES, **arms.FIGURES}.items()))
_SCENE = "another scene, {scene}"
_ARM = "HUBO's right arm of 6 joints; the thesis shows another manipulator of 7"
CAPTIONS = {
    "2.2": Caption(
        "the concept of frontiers in 2D: walls black, explored free areas grey, frontiers red",
        "a level of a real 3D map, so walls are voxels and frontiers above and below count too",
    ),
    "3.1": Caption("voxel types that result from the first scan of an environment", _SCENE),
    "3.2": Caption(
        "void clustering: ellipsoids before and after merging, dots are centres of void voxels",
        f"{_SCENE}; dots are orange",
    ),
    "3.3": Caption(
        "two rows of reachability spheres as spikes, coloured by reachability index",
        f"{_ARM}; light yellow to dark violet instead of the thesis's colours",
    ),
    "3.4": Caption("reachability index across the workspace, in two cuts", f"{_ARM}; other colours"),
    "3.5": Caption(
        "drawn examples of cone, double cone and ring with axis and opening angle",
        "real spheres of the map, not drawings; a structure that fits no sphere of this arm is left out",
    ),
    "3.6": Caption(
        "an octree map of the scene of 3.1 at several resolutions, twice with its inner structure",
        "drawn in RViz, not Octovis; the inner structure once, as free leaves",
    ),
    "4.1": Caption(
        "the HUBO model with a sensor in its right hand",
        "RViz instead of Gazebo; the model is made of primitives",
    ),
    "5.1": Caption("frontier voxels in red before clustering, six views, the last one from inside", _SCENE),
    "5.2": Caption(
        "a map made of the simulated sensor's data, colour is height",
        "another scene and other colours",
    ),
    "5.3": Caption(
        "void voxels, initial ellipsoids and resulting void clusters of the first scan, four views",
        f"{_SCENE}, and has more void clusters than two",
    ),
    "5.4": Caption(
        "four frontier clusters of the same scan, occupied voxels not shown, void voxels as dots", _SCENE
    ),
    "5.5": Caption(
        "two frontier-void sets from the clusters of 5.3 and 5.4", f"{_SCENE}; occupied voxels are shown"
    ),
    "5.6": Caption(
        "spheres near the base of the manipulator with spikes missing: bald",
        f"{_ARM}; spikes lie together, since the inverse kinematics is in closed form",
    ),
    "5.7": Caption(
        "utility of free voxels: greenish and translucent to reddish and opaque; in (b) frontiers grey",
        _SCENE,
    ),
    "5.8": Caption(
        "a motion plan of HUBO's right arm, start green, goal orange",
        "our own markers instead of MoveIt's plugin",
    ),
}
