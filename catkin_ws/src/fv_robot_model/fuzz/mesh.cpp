/// Mesh files of any content; the first byte chooses the ending. Triangles, or a ModelError.
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "triangle_mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  static const std::array<const char*, 3> kEndings{".stl", ".obj", ".dae"};
  if (size == 0) return 0;
  const std::string path =
      (std::filesystem::temp_directory_path() / ("fv-fuzz-" + std::to_string(getpid()))).string() +
      kEndings[data[0] % kEndings.size()];
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(data) + 1, static_cast<std::streamsize>(size) - 1);
  try {
    const fv_robot_model::TriangleMesh mesh = fv_robot_model::loadMesh(path);
    if (mesh.vertices.rows() == 0 || !mesh.vertices.allFinite()) __builtin_trap();
    const auto corners = mesh.triangles.array();
    if (corners.size() > 0 && (corners.minCoeff() < 0 || corners.maxCoeff() >= mesh.vertices.rows()))
      __builtin_trap();
  } catch (const fv_robot_model::ModelError&) {
  }
  std::remove(path.c_str());
  return 0;
}
