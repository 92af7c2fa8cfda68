/// The mesh formats that robots are described with, from the bytes of a file. Written for files that lie: no
/// count in them is believed, and every index is checked.
#pragma once

#include <string>
#include <string_view>

#include "triangle_mesh.h"

namespace fv_robot_model {

/// STL, binary or ASCII; told apart by the size, for binary ones may begin with "solid" too.
/// @throws ModelError that says what is wrong, without the file's name; so do the others.
TriangleMesh readStl(std::string_view bytes);

/// Wavefront OBJ: v and f; polygons become fans, all else is passed over. Without faces the bare points.
TriangleMesh readObj(std::string_view text);

/// Collada: the geometry of the scene with the transforms of its nodes, in metres by the file's unit; its up
/// axis is not asked, as RViz does it. Lines and points are passed over.
TriangleMesh readCollada(const std::string& xml);

}  // namespace fv_robot_model
