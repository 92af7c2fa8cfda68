// How fast the inner loops are with each instruction set, for scripts/bench lanes.
#include "bind_lanes.h"

#include <pybind11/stl.h>
#include <time.h>

#include <algorithm>
#include <map>
#include <random>

#include "lane_kernels.h"

namespace fv {

namespace {

namespace py = pybind11;

constexpr int kEdge =
    48;  // three tiles; what the rays pass of it stays in the processor's caches: this is about the loops
constexpr std::size_t kCells = std::size_t{kEdge} * kEdge * kEdge;
constexpr double kLength = 24.0;  // of the rays [voxels]: they stay in the grid
constexpr int kBatches = 64, kBlocks = 4, kRepeats = 20;

/// Of this thread: what others do meanwhile does not count.
double processorNanoseconds() {
  timespec time;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e9 * static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec);
}

/// A camera's rays across the grid, and blocks of rays of Algorithm 1.
class LaneScene {
 public:
  LaneScene() : cells_(kCells), marks_(kCells), sums_(kCells), blocks_(kBlocks) {
    std::mt19937 random(1);
    for (int flags = 0; flags < kViewStep; ++flags) {
      table_.open[flags] = -1;
      table_.adds[flags] = GainTable::kOneVoid << (21 * (flags % 3));
    }
    for (std::size_t i = 0; i < kCells; ++i) flags_.push_back(random() % kViewStep);
    for (int batch = 0; batch < kBatches; ++batch) addBatch(batch);
    for (RayBlock& block : blocks_) fill(block, random);
  }

  /// Nanoseconds a voxel of each kernel, in the order of lane_kernels.h.
  std::array<double, 3> measure(const LaneKernels& kernels) {
    const auto mark = [&] {
      for (const MarkLanes& lanes : scan_) kernels.markLanes(lanes, 1, marks_.data());
      return steps_;
    };
    const auto cast = [&] {
      std::copy(flags_.begin(), flags_.end(), cells_.begin());
      GainCounts counts;
      for (const LaneRays& rays : view_)
        kernels.castLanes(rays, {&table_, cells_.data(), kViewStep, 3.0}, counts);
      return steps_;
    };
    const auto add = [&] {
      int64_t visits = 0;
      for (RayBlock& block : blocks_)
        visits += kernels.addRays(block, {flags_.data(), table_.open, {kEdge, kEdge, kEdge}, kLength},
                                  sums_.data());
      return visits;
    };
    return {nanoseconds(mark), nanoseconds(cast), nanoseconds(add)};
  }

 private:
  template <class Work>
  static double nanoseconds(const Work& work) {
    work();  // into the caches
    int64_t steps = 0;
    const double start = processorNanoseconds();
    for (int i = 0; i < kRepeats; ++i) steps += work();
    return (processorNanoseconds() - start) / static_cast<double>(steps);
  }

  static Eigen::Vector3d direction(std::mt19937& random) {
    std::uniform_real_distribution<double> aside(-0.4, 0.4);
    const double y = aside(random);
    return Eigen::Vector3d(1, y, aside(random)).normalized();
  }

  /// Eight neighbours of a row of a camera's image.
  void addBatch(int batch) {
    MarkLanes scan;
    LaneRays view;
    for (int lane = 0; lane < kLanes; ++lane) {
      const double column = batch % 4 * kLanes + lane, row = batch / 4;
      const Eigen::Vector3d along = Eigen::Vector3d(1, column / 40 - 0.4, row / 25 - 0.3).normalized();
      const Eigen::Vector3d from(2.3, kEdge / 2 + 0.2, kEdge / 2 + 0.4);
      GridWalk walk;
      for (int axis = 0; axis < 3; ++axis)
        walk.begin(axis, from[axis], along[axis], 0.0, kEdge, strides()[axis]);
      view.set(lane, walk, kLength);
      for (int axis = 0; axis < 3; ++axis) {
        scan.t[axis][lane] = walk.t[axis];
        scan.delta[axis][lane] = walk.delta[axis];
        scan.step[axis][lane] = walk.step[axis];
      }
      scan.at[lane] = walk.at;
      scan.end[lane] = -1;
      scan.length[lane] = kLength;
      steps_ += voxels(walk);
    }
    scan_.push_back(scan);
    view_.push_back(view);
  }

  static std::array<int64_t, 3> strides() { return {1, kEdge, kEdge * kEdge}; }

  static int64_t voxels(const GridWalk& walk) {
    int64_t count = 1;
    for (int axis = 0; axis < 3; ++axis)
      for (double t = walk.t[axis]; t <= kLength; t += walk.delta[axis]) ++count;
    return count;
  }

  static void fill(RayBlock& block, std::mt19937& random) {
    block.count = RayBlock::kCapacity;
    for (int i = 0; i < block.count; ++i) {
      const Eigen::Vector3d away = direction(random);
      block.at[i] = 0;
      for (int axis = 0; axis < 3; ++axis) {
        block.away[axis][i] = away[axis];
        block.voxel[axis][i] = axis == 0 ? 1 + i / 7 % 3 : 20 + i / 7 % 8;  // seven rays from each source
        block.at[i] += block.voxel[axis][i] * strides()[axis];
      }
      block.weight[i] = static_cast<double>(random() % 100000);
    }
  }

  GainTable table_;
  std::vector<uint8_t> flags_;
  std::vector<uint16_t> cells_;
  std::vector<uint8_t> marks_;
  std::vector<UtilitySums> sums_;
  std::vector<MarkLanes> scan_;
  std::vector<LaneRays> view_;
  std::vector<RayBlock> blocks_;
  int64_t steps_ = 0;
};

/// By instruction set and kernel the nanoseconds of each run; runs take turns, so that all see the same
/// machine.
std::map<std::string, std::map<std::string, std::vector<double>>> laneTimes(int runs) {
  LaneScene scene;
  std::map<std::string, std::map<std::string, std::vector<double>>> times;
  for (int run = 0; run < runs; ++run)
    for (const LaneKernels& kernels : laneKernels()) {
      const std::array<double, 3> measured = scene.measure(kernels);
      auto& of_set = times[kernels.instruction_set];
      of_set["mark"].push_back(measured[0]);
      of_set["cast"].push_back(measured[1]);
      of_set["add"].push_back(measured[2]);
    }
  return times;
}

}  // namespace

void bindLanes(py::module_& m) {
  m.def(
      "instruction_set", [] { return bestKernels().instruction_set; },
      "The one that the inner loops use: the best that this processor has, not above FV_INSTRUCTION_SET.\n\n"
      ":raises InputError: for an unknown name in that environment variable.");
  m.def("lane_times", &laneTimes, py::arg("runs"), py::call_guard<py::gil_scoped_release>(),
        "Nanoseconds of processor time a voxel step, by instruction set (\"plain\": a loop without any) and "
        "kernel (mark, "
        "cast, add), a\n"
        "number for each run; in a grid that stays in the processor's caches.");
}

}  // namespace fv
