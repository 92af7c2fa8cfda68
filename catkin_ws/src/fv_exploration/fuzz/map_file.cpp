/// .bt and .ot files of any content: read whole, or refused by MapFileError or InputError. The first byte is
/// the kind.
#include "fv_exploration/map_file.h"

#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "fv_exploration/occupancy_map.h"

namespace {

/// A file in memory, its name with the wanted ending; one for each process.
std::string written(const uint8_t* data, std::size_t size, const std::string& ending) {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("fv-fuzz-" + std::to_string(getpid()))).string() + ending;
  std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(data), size);
  return path;
}

/// Known space of at most 256 voxels along each axis.
bool isSmall(const octomap::OcTree& tree) {
  if (tree.getRoot() == nullptr) return true;
  octomap::OcTreeKey low(65535, 65535, 65535), high(0, 0, 0);
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf)
    for (int i = 0; i < 3; ++i) {
      const int edge = 1 << (tree.getTreeDepth() - leaf.getDepth());
      low[i] = std::min(low[i], leaf.getIndexKey()[i]);
      high[i] = std::max<int>(high[i], leaf.getIndexKey()[i] + edge - 1);
    }
  return high[0] - low[0] < 256 && high[1] - low[1] < 256 && high[2] - low[2] < 256;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string path = written(data + 1, size - 1, data[0] % 2 ? ".bt" : ".ot");
  try {
    const auto tree = fv::readOcTree(path);
    fv::MapConfig config;
    config.resolution_m = tree->getResolution();
    if (!isSmall(*tree)) {  // a map of all that is lawful, but here it only costs time and memory
      config.bounds_min = {-8 * config.resolution_m, -8 * config.resolution_m, -8 * config.resolution_m};
      config.bounds_max = {8 * config.resolution_m, 8 * config.resolution_m, 8 * config.resolution_m};
    }
    const auto map = fv::OccupancyMap::read(path, &config);
    const std::string before = map->fullData();
    map->writeOt(path + ".again.ot");
    const auto again = fv::OccupancyMap::read(path + ".again.ot", &config);
    if (again->fullData() != before) __builtin_trap();  // what was read is what is written
  } catch (const fv::MapFileError&) {
  } catch (const fv::InputError&) {
  }
  std::remove(path.c_str());
  std::remove((path + ".again.ot").c_str());
  return 0;
}
