/// Map messages of any content into the planner's grid; only std::invalid_argument is allowed.
#include <fuzzer/FuzzedDataProvider.h>

#include <cstring>
#include <stdexcept>

#include "conversions.h"

namespace {

double anyNumber(FuzzedDataProvider& in) {
  const auto bits = in.ConsumeIntegral<uint64_t>();
  double value;
  std::memcpy(&value, &bits, sizeof(value));
  return value;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  FuzzedDataProvider in(data, size);
  fv_msgs::MapUpdate msg;
  msg.octomap.binary = in.ConsumeBool();
  const auto choice = in.ConsumeIntegral<uint8_t>();
  msg.octomap.id = choice == 255 ? "ColorOcTree" : "OcTree";
  msg.octomap.resolution = choice < 128 ? 0.05 : choice < 192 ? 0.25 : anyNumber(in);
  const Eigen::Vector3d low(-0.5, -0.5, in.ConsumeIntegral<int8_t>() / 64.0);
  const Eigen::AlignedBox3d region(low, low + Eigen::Vector3d(1.0, 1.0, 0.5));
  const auto payload = in.ConsumeRemainingBytes<int8_t>();
  msg.octomap.data.assign(payload.begin(), payload.end());
  try {
    const ompl_planner::VoxelGrid grid = ompl_planner::gridFromMsg(msg, region);
    if (!grid.changedSince(grid).empty()) __builtin_trap();
  } catch (const std::invalid_argument&) {
  }
  return 0;
}
