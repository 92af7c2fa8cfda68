#include "fv_exploration/utility.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <unordered_map>

#include "convex_hull.h"
#include "lane_kernels.h"
#include "parallel.h"
#include "tile.h"
#include "zeroed_array.h"

namespace fv {

namespace {

/// A frontier cluster next to a void: all its sources get rays of this ellipsoid.
struct Job {
  int ellipsoid;
  int cluster;
  int64_t first;  // number of its first (ellipsoid, source) pair
};

struct Corners {
  std::array<Eigen::Vector3d, 7> at;
  double scaled_volume;
};

/// By flags whether a ray goes on and adds.
std::array<int64_t, kViewStep> openWhereFree() {
  std::array<int64_t, kViewStep> open;
  for (int flags = 0; flags < kViewStep; ++flags) open[flags] = (flags & kClassMask) == kFree ? -1 : 0;
  return open;
}
const std::array<int64_t, kViewStep> kOpen = openWhereFree();

class Algorithm1 {
 public:
  Algorithm1(const Evaluator& evaluator, double max_range_m, int64_t max_rays, int threads)
      : evaluator_(evaluator), threads_(threads) {
    const Voxel dims = evaluator.frame().dims();
    grid_ = {evaluator.flags().data(),
             kOpen.data(),
             {dims.x(), dims.y(), dims.z()},
             max_range_m / evaluator.map().resolution()};
    collectSources();
    collectJobs();
    // Within a budget only every so many pairs get rays, for as much more utility each.
    if (max_rays > 0 && pairs_ > 0) every_ = std::max<int64_t>(1, (7 * pairs_ + max_rays - 1) / max_rays);
    scale_ /= static_cast<double>(every_);
    // A thread needs sums for the whole grid of its own: it must have rays enough to be worth them.
    const auto voxels = static_cast<int64_t>(std::max<std::size_t>(1, evaluator.frame().size()));
    threads_ = static_cast<int>(std::min<int64_t>(threads, 1 + 7 * pairs_ / every_ / (4 * voxels)));
  }

  Utility run() {
    Utility out;
    if (pairs_ == 0) return out;
    std::vector<ZeroedArray<UtilitySums>> sums;
    for (int i = 0; i < threads_; ++i) sums.emplace_back(evaluator_.frame().size());
    std::vector<int64_t> visits(threads_, 0), rays(threads_, 0);
    constexpr int kChunk = 256;
    const int64_t chunk_pairs = kChunk * every_;
    parallelChunks(static_cast<int>((pairs_ + chunk_pairs - 1) / chunk_pairs), threads_, 1,
                   [&](int chunk, int, int thread) {
                     const int64_t first = chunk * chunk_pairs;
                     castPairs(first, std::min(pairs_, first + chunk_pairs), sums[thread].data(),
                               visits[thread], rays[thread]);
                   });
    out.visits = std::accumulate(visits.begin(), visits.end(), int64_t{0});
    out.rays = std::accumulate(rays.begin(), rays.end(), int64_t{0});
    collect(sums, out);
    return out;
  }

 private:
  void collectSources() {
    std::vector<Voxel> voxels;
    std::vector<int> clusters;
    evaluator_.frontier(voxels, clusters);
    sources_.resize(evaluator_.evaluation().clusters);
    for (std::size_t i = 0; i < voxels.size(); ++i)
      if (evaluator_.hull().contains(voxels[i])) sources_[clusters[i]].push_back(voxels[i]);
  }

  void collectJobs() {
    const Evaluation& e = evaluator_.evaluation();
    double largest = 0;
    for (const FrontierVoid& fv : e.frontier_voids)
      largest = std::max(largest, e.ellipsoids[fv.ellipsoid].volume);
    scale_ = largest > 0 ? std::ldexp(1.0, 34) / largest : 0.0;
    corners_.resize(e.ellipsoids.size());
    for (const FrontierVoid& fv : e.frontier_voids) {
      corners_[fv.ellipsoid] = cornersOf(e.ellipsoids[fv.ellipsoid]);
      for (int i = fv.first; i < fv.last; ++i) {
        const int cluster = e.neighbour_clusters[i];
        if (sources_[cluster].empty()) continue;
        jobs_.push_back({fv.ellipsoid, cluster, pairs_});
        pairs_ += static_cast<int64_t>(sources_[cluster].size());
      }
    }
  }

  Corners cornersOf(const Ellipsoid& e) const {
    Corners c{
        {},
        e.volume * scale_};  // before the budget changes the scale: a sample stands for all it is drawn from
    c.at[0] = e.center;
    for (int i = 0; i < 3; ++i) {
      c.at[1 + 2 * i] = e.center + e.semi_axes[i] * e.axes.col(i);
      c.at[2 + 2 * i] = e.center - e.semi_axes[i] * e.axes.col(i);
    }
    return c;
  }

  void castPairs(int64_t first, int64_t last, UtilitySums* sums, int64_t& visits, int64_t& rays) const {
    auto job = std::upper_bound(jobs_.begin(), jobs_.end(), first,
                                [](int64_t value, const Job& j) { return value < j.first; }) -
               1;
    RayBlock block;
    const auto walk = [&] {
      visits += bestKernels().addRays(block, grid_, sums);
      rays += block.count;
      block.count = 0;
    };
    for (int64_t pair = first; pair < last; pair += every_) {
      while (pair - job->first >= static_cast<int64_t>(sources_[job->cluster].size())) ++job;
      if (block.count + 7 > RayBlock::kCapacity) walk();
      addPair(sources_[job->cluster][pair - job->first], corners_[job->ellipsoid], block);
    }
    walk();
  }

  /// The rays from the centre of `source` away from an ellipsoid's corners, but one it lies on.
  void addPair(const Voxel& source, const Corners& corners, RayBlock& block) const {
    const Eigen::Vector3d from = evaluator_.map().centre(source);
    const Voxel local = source - evaluator_.frame().origin;
    const auto at = static_cast<int64_t>(evaluator_.frame().index(source));
    for (const Eigen::Vector3d& corner : corners.at) {
      const Eigen::Vector3d away = from - corner;
      if (away.isZero(0)) continue;
      const int i = block.count++;
      for (int axis = 0; axis < 3; ++axis) {
        block.away[axis][i] = away[axis];
        block.voxel[axis][i] = local[axis];
      }
      block.at[i] = at;
      block.weight[i] = corners.scaled_volume;
    }
  }

  void collect(const std::vector<ZeroedArray<UtilitySums>>& sums, Utility& out) const {
    const std::vector<uint8_t>& flags = evaluator_.flags();
    for (std::size_t i = 0; i < flags.size(); ++i) {
      if ((flags[i] & kClassMask) != kFree) continue;
      UtilitySums total = sums[0][i];
      for (int thread = 1; thread < threads_; ++thread)
        for (std::size_t k = 0; k < total.size(); ++k) total[k] += sums[thread][i][k];
      if (total[0] == 0) continue;
      out.voxels.push_back(evaluator_.frame().voxel(i));
      out.utility.push_back(static_cast<double>(total[0]) / scale_);
      const Eigen::Vector3d away(total[1], total[2], total[3]);
      const double length = away.norm();
      out.direction.push_back(length > 0 ? Eigen::Vector3f((-away / length).cast<float>())
                                         : Eigen::Vector3f::UnitX().eval());
    }
  }

  const Evaluator& evaluator_;
  int threads_;
  UtilityGrid grid_;
  std::vector<std::vector<Voxel>> sources_;  // by cluster
  std::vector<Corners> corners_;             // by ellipsoid
  std::vector<Job> jobs_;
  int64_t pairs_ = 0;
  int64_t every_ = 1;
  double scale_ = 0;
};

}  // namespace

Utility accumulateUtility(const Evaluator& evaluator, double max_range_m, int64_t max_rays, int threads) {
  require(max_rays >= 0, "max_rays", max_rays, "0 (all) or more");
  require(threads >= 0 && threads <= 256, "threads", threads, "0 (all cores) to 256");
  require(max_range_m > 0 && std::isfinite(max_range_m), "max_range_m", max_range_m, "above 0, finite");
  return Algorithm1(evaluator, max_range_m, max_rays, threadCount(threads)).run();
}

std::vector<int> bestViews(const Utility& utility, double resolution_m, const std::vector<uint8_t>& allowed,
                           int count, double suppression_radius_m) {
  std::vector<int> order;
  for (int i = 0; i < static_cast<int>(utility.voxels.size()); ++i)
    if (allowed.empty() || allowed[i]) order.push_back(i);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    return utility.utility[a] != utility.utility[b] ? utility.utility[a] > utility.utility[b] : a < b;
  });
  const double radius = suppression_radius_m / resolution_m;
  const double cell = std::max(1.0, radius);
  std::unordered_map<uint64_t, std::vector<int>> kept;  // by cell of the radius' size
  std::vector<int> out;
  const auto cellOf = [&](const Voxel& v) -> Voxel {
    return (v.cast<double>() / cell).array().floor().cast<int>();
  };
  const auto suppressed = [&](const Voxel& v) {
    const Voxel c = cellOf(v);
    for (int d = 0; d < 27; ++d) {
      const auto found = kept.find(voxelId(c + directionStep(d)));
      if (found == kept.end()) continue;
      for (const int j : found->second)
        if ((utility.voxels[j] - v).cast<double>().norm() < radius) return true;
    }
    return false;
  };
  for (const int i : order) {
    if (static_cast<int>(out.size()) >= count) break;
    if (suppressed(utility.voxels[i])) continue;
    kept[voxelId(cellOf(utility.voxels[i]))].push_back(i);
    out.push_back(i);
  }
  return out;
}

}  // namespace fv
