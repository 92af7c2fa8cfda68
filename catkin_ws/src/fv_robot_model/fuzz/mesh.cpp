/// Mesh files of any content; the first byte chooses the ending. Points, or a ModelError.
#include "mesh.h"

#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "fv_robot_model/types.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  static const std::array<const char*, 3> kEndings{".stl", ".obj", ".dae"};
  if (size == 0) return 0;
  const std::string path =
      (std::filesystem::temp_directory_path() / ("fv-fuzz-" + std::to_string(getpid()))).string() +
      kEndings[data[0] % kEndings.size()];
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(data) + 1, static_cast<std::streamsize>(size) - 1);
  try {
    const fv_robot_model::Points points = fv_robot_model::loadMeshVertices(path, Eigen::Vector3d(1, 1, 1));
    if (points.rows() == 0 || !points.allFinite()) __builtin_trap();
  } catch (const fv_robot_model::ModelError&) {
  }
  std::remove(path.c_str());
  return 0;
}
