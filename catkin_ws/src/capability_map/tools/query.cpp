// Answers views from the command line, without Python or ROS: an example of the C++ interface.

#include <cmath>
#include <iostream>
#include <string>

#include "capability_map/map_file.h"

namespace {

constexpr char kUsage[] =
    "usage: query MAP [--nearest] < VIEWS\n"
    "VIEWS: one view a line, x y z dx dy dz: tip position [m] and viewing direction in the map's base "
    "frame.\n"
    "Prints for each: the answer 0..1, yes or no (reachable), and the joint values of the nearest stored "
    "point.\n";

void answer(const capability_map::MapFile& map, bool interpolate) {
  const capability_map::CapabilityQuery query = map.query();
  const capability_map::SeedLookup seeds = map.seeds();
  std::vector<double> q(static_cast<size_t>(map.joint_limits.rows()));
  Eigen::Vector3d p, d;
  while (std::cin >> p.x() >> p.y() >> p.z() >> d.x() >> d.y() >> d.z()) {
    const float value = interpolate ? query.interpolated(p, d) : query.nearest(p, d);
    std::cout << value << (value >= map.threshold ? " yes" : " no") << (map.covered(p, d) ? " yes" : " no");
    const capability_map::SeedLookup::Seed seed = seeds.nearest(p, d);
    if (seed.point >= 0) {
      map.witness(seed.point, q.data());
      for (const double joint : q) std::cout << ' ' << joint;
    }
    std::cout << '\n';
  }
}

}  // namespace

int main(int argc, char** argv) {
  const bool nearest = argc == 3 && std::string(argv[2]) == "--nearest";
  if (argc < 2 || (argc > 2 && !nearest) || std::string(argv[1]) == "--help") {
    std::cerr << kUsage;
    return argc == 2 ? 0 : 2;
  }
  try {
    std::cout.precision(9);
    answer(capability_map::loadMapFile(argv[1]), !nearest);
  } catch (const std::exception& error) {
    std::cerr << "query: " << error.what() << '\n';
    return 1;
  }
  return std::cin.eof() ? 0 : 1;
}
