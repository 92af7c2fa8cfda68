#include "mesh_builder.h"
#include "mesh_formats.h"

namespace fv_robot_model {
namespace {

/// The vertex that the first number of "7/1/3" or "-1" means: counted from 1, or back from the last.
const Eigen::Vector3d& cornerOf(std::string_view word, const std::vector<Eigen::Vector3d>& vertices) {
  const auto told = numberOf<long>(word.substr(0, word.find('/')), "vertex number");
  const auto count = static_cast<long>(vertices.size());
  if (told == 0 || told > count || told < -count)
    throw ModelError(text("a face names vertex ", told, " of ", count));
  return vertices[static_cast<std::size_t>(told > 0 ? told - 1 : count + told)];
}

/// The next line, without its comment; lines that end in a backslash go on in the next.
std::string takeLine(std::string_view& rest) {
  std::string line;
  for (bool goes_on = true; goes_on && !rest.empty();) {
    std::string_view part = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(rest.size(), part.size() + 1));
    if (!part.empty() && part.back() == '\r') part.remove_suffix(1);
    goes_on = !part.empty() && part.back() == '\\';
    if (goes_on) part.remove_suffix(1);
    line += part;
    line += ' ';
  }
  return line.substr(0, line.find('#'));
}

}  // namespace

TriangleMesh readObj(std::string_view rest) {
  MeshBuilder mesh;
  std::vector<Eigen::Vector3d> vertices, corners;
  bool has_faces = false;
  while (!rest.empty()) {
    const std::string line = takeLine(rest);
    Words words(line);
    const std::string_view kind = words.next();
    if (kind == "v") vertices.push_back(pointOf(words));
    if (kind != "f") continue;
    corners.clear();
    for (std::string_view word = words.next(); !word.empty(); word = words.next())
      corners.push_back(cornerOf(word, vertices));
    mesh.add(corners);
    has_faces = true;
  }
  if (has_faces) return mesh.take();
  return {MeshBuilder::pointsOf(vertices), TriangleMesh::Triangles(0, 3)};
}

}  // namespace fv_robot_model
