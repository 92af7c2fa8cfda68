"""A small robot of the tests' own, as a folder: an arm whose wrist keeps level by a mimic joint."""

import yaml

LIMIT = '<limit lower="{}" upper="{}" effort="20" velocity="2"/>'
BODY = """<link name="{name}"><visual>{shape}</visual><collision>{shape}</collision></link>"""
BOX = '<geometry><box size="0.05 0.05 0.2"/></geometry>'
JOINT = """<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
<origin xyz="0 0 0.3"/><axis xyz="0 1 0"/>{more}</joint>"""

TETRAHEDRON = [[(0, 0, 0), (0, 0.3, 0), (0.2, 0, 0)], [(0, 0, 0), (0.2, 0, 0), (0, 0, 0.4)],
               [(0, 0, 0), (0, 0, 0.4), (0, 0.3, 0)], [(0.2, 0, 0), (0, 0.3, 0), (0, 0, 0.4)]]  # fmt: skip


def text_stl():
    """The tetrahedron as an STL of text."""
    facets = (
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"vertex {x} {y} {z}\n" for x, y, z in face)
        + "endloop\nendfacet\n"
        for face in TETRAHEDRON
    )
    return "solid t\n" + "".join(facets) + "endsolid t\n"


def links(root="base_link", upper=BOX, wrist_limit=(-3.0, 3.0)):
    """The URDF's inside: root - pan - upper - lift - lower - (level mimics lift) - hand."""
    frames = f'<link name="{root}"/><link name="optical"/>'
    bodies = "".join(
        BODY.format(name=n, shape=s) for n, s in [("upper", upper), ("lower", BOX), ("hand", BOX)]
    )
    mimic = '<mimic joint="lift" multiplier="-1" offset="0.1"/>'
    joints = [
        ("pan", "revolute", root, "upper", LIMIT.format(-2, 2)),
        ("level", "revolute", "lower", "hand", LIMIT.format(*wrist_limit) + mimic),
        ("lift", "revolute", "upper", "lower", LIMIT.format(-1, 1)),
        ("mount", "fixed", "hand", "optical", ""),
    ]
    return (
        frames
        + bodies
        + "".join(
            JOINT.format(name=name, kind=kind, parent=parent, child=child, more=more)
            for name, kind, parent, child, more in joints
        )
    )


def srdf(root="base_link", more="", state=""):
    """The SRDF's inside: one chain, one pose, neighbours."""
    return f"""<group name="arm"><chain base_link="{root}" tip_link="optical"/></group>
<group_state name="ready" group="arm"><joint name="pan" value="0"/><joint name="lift" value="0.5"/>{state}</group_state>
<disable_collisions link1="upper" link2="lower"/><disable_collisions link1="lower" link2="hand"/>{more}"""


def write_robot(folder, urdf=None, semantic=None, root="base_link", **changes):
    """Write a robot's folder and return it.

    changes: ``robot``, ``exploration``, ``joint_limits`` (rows), ``joints`` (of the controller).
    """
    folder.mkdir(parents=True, exist_ok=True)
    head = '<?xml version="1.0"?>\n<robot name="own">'
    (folder / "own.urdf").write_text(f"{head}{links(root) if urdf is None else urdf}</robot>")
    (folder / "own.srdf").write_text(f"{head}{srdf(root) if semantic is None else semantic}</robot>")
    row = {
        "has_velocity_limits": True,
        "max_velocity": 1.0,
        "has_acceleration_limits": True,
        "max_acceleration": 2.0,
    }
    limits = {name: dict(row) for name in ("pan", "lift")} | changes.get("joint_limits", {})
    joints = changes.get("joints", ["pan", "lift"])
    exploration = {"group": "arm", "capability_group": "", "camera": "eye", "start_pose": "ready"}
    files = {
        "robot": {"name": "own", "description": "d", "urdf": "own.urdf", "srdf": "own.srdf", "namespace": "own",
                  "base_link": root, "exploration": exploration | changes.get("exploration", {})}
                 | changes.get("robot", {}),
        "joint_limits": {"joint_limits": limits},
        "controllers": {
            "own": {"arm_controller": {"type": "position_controllers/JointTrajectoryController", "joints": joints}},
            "controller_list": [{"name": "own/arm_controller", "action_ns": "follow_joint_trajectory",
                                 "type": "FollowJointTrajectory", "joints": joints}]},
        "sensors": {"eye": {"type": "depth_camera", "link": "hand", "optical_frame": "optical", "topic": "/camera",
                            "width": 16, "height": 12, "horizontal_fov_deg": 58.0, "vertical_fov_deg": 45.0,
                            "min_range_m": 0.3, "max_range_m": 3.0, "rate_hz": 5.0}},
    }  # fmt: skip
    for stem, content in files.items():
        (folder / f"{stem}.yaml").write_text(yaml.safe_dump(content, sort_keys=False))
    return folder
