/// .bt and .ot files of any content: read whole, or refused by MapFileError or InputError. The first byte is
/// the kind.
#include "fv_exploration/map_file.h"

#include <unistd.h>

#include <fstream>

#include "fv_exploration/occupancy_map.h"

namespace {

/// A file in memory, its name with the wanted ending; one for each process.
std::string written(const uint8_t* data, std::size_t size, const std::string& ending) {
  const std::string path = "/dev/shm/fv-fuzz-" + std::to_string(getpid()) + ending;
  std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(data), size);
  return path;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string path = written(data + 1, size - 1, data[0] % 2 ? ".bt" : ".ot");
  try {
    const auto map = fv::OccupancyMap::read(path, nullptr);
    const std::string before = map->fullData();
    map->writeOt(path + ".again.ot");
    const auto again = fv::OccupancyMap::read(path + ".again.ot", nullptr);
    if (again->fullData() != before) __builtin_trap();  // what was read is what is written
  } catch (const fv::MapFileError&) {
  } catch (const fv::InputError&) {
  }
  std::remove(path.c_str());
  std::remove((path + ".again.ot").c_str());
  return 0;
}
