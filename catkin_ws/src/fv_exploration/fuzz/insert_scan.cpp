/// Scans, poses and settings of any kind into a map, then everything that an exploration asks of it. Only
/// InputError is allowed.
#include <fuzzer/FuzzedDataProvider.h>

#include <cstring>

#include "fv_exploration/evaluator.h"
#include "fv_exploration/utility.h"
#include "fv_exploration/view_gain.h"

namespace {

using Input = FuzzedDataProvider;

/// Half of the numbers are of a scene's size, the others any bits: denormal, infinite, NaN.
double number(Input& in) {
  if (in.ConsumeBool()) return in.ConsumeIntegral<int16_t>() / 4096.0;
  const auto bits = in.ConsumeIntegral<uint64_t>();
  double value;
  std::memcpy(&value, &bits, sizeof(value));
  return value;
}

double oneOf(Input& in, std::initializer_list<double> usual) {
  const auto choice = in.ConsumeIntegralInRange<std::size_t>(0, usual.size());
  return choice < usual.size() ? usual.begin()[choice] : number(in);
}

fv::Points points(Input& in, Eigen::Index most) {
  fv::Points out(in.ConsumeIntegralInRange<Eigen::Index>(0, most), 3);
  for (Eigen::Index i = 0; i < out.size(); ++i) out.data()[i] = number(in);
  return out;
}

Eigen::Matrix4d pose(Input& in) {
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  const double angle = in.ConsumeIntegral<int8_t>() / 32.0;
  const Eigen::Vector3d axis(in.ConsumeIntegral<int8_t>(), in.ConsumeIntegral<int8_t>(), 1);
  T.topLeftCorner<3, 3>() = Eigen::AngleAxisd(angle, axis.normalized()).matrix();
  for (int i = 0; i < 3; ++i) T(i, 3) = number(in);
  if (in.ConsumeIntegral<uint8_t>() == 0) T(in.ConsumeIntegralInRange(0, 3), 0) = number(in);
  return T;
}

fv::MapConfig mapConfig(Input& in) {
  fv::MapConfig config;
  config.resolution_m = oneOf(in, {0.1, 0.25, 1.0});
  config.threads = in.ConsumeIntegralInRange(1, 2);
  config.dense_limit_mb = in.ConsumeBool() ? 8 : 0;
  const auto corner = [&](double side) {
    return std::array<double, 3>{side + in.ConsumeIntegral<int8_t>() / 128.0, side, side};
  };
  if (in.ConsumeIntegral<uint8_t>() < 192) {
    config.bounds_min = corner(-1.5);
    config.bounds_max = corner(1.5);
  }
  config.prob_hit = oneOf(in, {0.7, 0.9});
  config.prob_miss = oneOf(in, {0.4, 0.1});
  config.occupancy_threshold = oneOf(in, {0.5, 0.7});
  return config;
}

fv::ScanConfig scanConfig(Input& in) {
  fv::ScanConfig scan;
  scan.min_range_m = oneOf(in, {0.0, 0.3});
  scan.max_range_m = oneOf(in, {4.0, 1.0});
  scan.no_return_clear_m = oneOf(in, {0.0, 2.0});
  return scan;
}

/// A map of more voxels is lawful, but here it only costs time.
bool isSmall(const fv::OccupancyMap& map) { return map.frame().size() < (std::size_t{1} << 22); }

void lookAt(const fv::OccupancyMap& map, fv::Evaluator& evaluator, Input& in) {
  evaluator.update();
  fv::PinholeCamera camera;
  camera.width = in.ConsumeIntegralInRange(1, 16);
  camera.height = in.ConsumeIntegralInRange(1, 12);
  camera.max_range_m = oneOf(in, {3.0, 1.0});
  std::vector<Eigen::Matrix4d> views{pose(in), pose(in)};
  fv::viewGains(evaluator, views, camera, in.ConsumeIntegralInRange(1, 3), 1);
  const fv::Utility utility = fv::accumulateUtility(evaluator, oneOf(in, {2.0}), 20000, 1);
  fv::bestViews(utility, map.resolution(), {}, 5, oneOf(in, {0.2, 0.0}));
  map.classify(points(in, 4));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  Input in(data, size);
  try {
    fv::OccupancyMap map(mapConfig(in));
    if (!isSmall(map)) return 0;
    fv::EvaluationConfig config;
    config.tiled = in.ConsumeBool();
    config.min_fit = oneOf(in, {0.5, 0.9});
    config.threads = 1;
    fv::Evaluator evaluator(map, config);
    for (int scans = in.ConsumeIntegralInRange(1, 3); scans > 0; --scans) {
      const fv::Points cloud = points(in, 24);
      const fv::Points rays = in.ConsumeBool() ? points(in, 24) : fv::Points(0, 3);
      const Eigen::Matrix4d T_map_sensor = pose(in);
      map.insertScan(cloud, T_map_sensor, scanConfig(in), rays);
      if (in.ConsumeBool()) map.markFree(points(in, 8));
      if (!isSmall(map)) return 0;
      lookAt(map, evaluator, in);
    }
  } catch (const fv::InputError&) {
  }
  return 0;
}
