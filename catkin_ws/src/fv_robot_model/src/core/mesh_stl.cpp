#include <cstdint>
#include <cstring>

#include "mesh_builder.h"
#include "mesh_formats.h"

namespace fv_robot_model {
namespace {

constexpr std::size_t kHeader = 80, kFacet = 50, kNormal = 12;

/// The number of facets that a binary file's header tells; its size must be that of so many.
bool isBinary(std::string_view bytes, std::size_t& facets) {
  std::uint32_t told = 0;
  if (bytes.size() < kHeader + sizeof(told)) return false;
  std::memcpy(&told, bytes.data() + kHeader, sizeof(told));
  facets = told;
  return bytes.size() == kHeader + sizeof(told) + kFacet * facets;
}

TriangleMesh readBinary(std::string_view bytes, std::size_t facets) {
  MeshBuilder mesh;
  for (std::size_t i = 0; i < facets; ++i) {
    float numbers[9];
    std::memcpy(numbers, bytes.data() + kHeader + 4 + kFacet * i + kNormal, sizeof(numbers));
    const auto corner = [&](int k) {
      return Eigen::Vector3d(numbers[3 * k], numbers[3 * k + 1], numbers[3 * k + 2]);
    };
    mesh.addTriangle(corner(0), corner(1), corner(2));
  }
  return mesh.take();
}

TriangleMesh readAscii(std::string_view bytes) {
  MeshBuilder mesh;
  std::vector<Eigen::Vector3d> corners;
  Words words(bytes);
  for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
    if (word == "vertex") corners.push_back(pointOf(words));
    if (word != "endfacet") continue;
    if (corners.size() != 3) throw ModelError(text("a facet has ", corners.size(), " corners; valid: 3"));
    mesh.add(corners);
    corners.clear();
  }
  if (!corners.empty()) throw ModelError("is cut off inside a facet");
  return mesh.take();
}

}  // namespace

TriangleMesh readStl(std::string_view bytes) {
  std::size_t facets = 0;
  if (isBinary(bytes, facets)) return readBinary(bytes, facets);
  if (Words(bytes).next() == "solid") return readAscii(bytes);
  throw ModelError(
      text("is neither an ASCII STL (it does not begin with \"solid\") nor a binary one: of its ", facets,
           " facets of 50 bytes behind 84 bytes, there are ", bytes.size(), " bytes"));
}

}  // namespace fv_robot_model
