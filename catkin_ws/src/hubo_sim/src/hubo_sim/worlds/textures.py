"""Which bodies have pictures on their surfaces."""

from __future__ import annotations

from pathlib import Path

from hubo_sim.bullet import BulletClient, pybullet


def has_texture(client: BulletClient, body: int, description: str = "") -> bool:
    """Whether a body's looks come from an image; description: the URDF or SDF that it was loaded from, if any.

    pybullet's own texture ids do not tell: a mesh with an image has the same id as one without.
    """
    if "<texture" in description:
        return True
    shapes = client.getVisualShapeData(body)
    files = {shape[4].decode() for shape in shapes if shape[2] == pybullet.GEOM_MESH}
    return any(_mesh_has_texture(Path(file)) for file in files)


def _mesh_has_texture(mesh: Path) -> bool:
    """By the materials of an .obj; other formats, when they can hold images, are taken to do so."""
    if mesh.suffix.lower() != ".obj" or not mesh.is_file():
        return mesh.suffix.lower() == ".dae"
    with mesh.open(errors="replace") as lines:
        libraries = [line.split(maxsplit=1)[1].strip() for line in lines if line.startswith("mtllib ")]
    return any(_names_image(mesh.parent / library) for library in libraries)


def _names_image(library: Path) -> bool:
    return library.is_file() and "map_Kd" in library.read_text(errors="replace")
