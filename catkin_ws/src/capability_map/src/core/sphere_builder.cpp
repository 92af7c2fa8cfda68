#include "sphere_builder.h"

#include <stdexcept>
#include <string>

namespace capability_map {

namespace {

void buildSphere(ViewProbe& probe, const Eigen::Vector3d& center, double radius_m, const Points& outward,
                 const fv_robot_model::ik::ReachBound& bound, Eigen::Index row, SphereBatch& batch) {
  std::vector<double> q(static_cast<size_t>(probe.dof()));
  for (Eigen::Index k = 0; k < outward.rows(); ++k) {
    const Eigen::Vector3d n = outward.row(k);
    const Eigen::Vector3d position = center + radius_m * n;
    if ((position - bound.center).norm() > bound.radius_m) {
      ++batch.points_skipped;
      continue;
    }
    const double manipulability = probe.decide(position, -n, q.data());
    if (manipulability < 0.0) continue;
    batch.valid(row, k) = 1;
    batch.manipulability.push_back(static_cast<float>(manipulability));
    batch.witnesses.insert(batch.witnesses.end(), q.begin(), q.end());
  }
}

}  // namespace

SphereBatch buildSpheres(ViewProbe& probe, const SphereGrid& grid, const Points& outward,
                         const std::vector<int64_t>& cells) {
  SphereBatch batch;
  batch.valid.setZero(static_cast<Eigen::Index>(cells.size()), outward.rows());
  const fv_robot_model::ik::ReachBound bound = fv_robot_model::ik::reachBound(probe.solver().chain());
  probe.resetCounts();
  for (size_t i = 0; i < cells.size(); ++i) {
    if (cells[i] < 0 || cells[i] >= grid.cellCount()) {
      throw std::out_of_range("cell " + std::to_string(cells[i]) + " is outside the grid of " +
                              std::to_string(grid.cellCount()) + " cells");
    }
    buildSphere(probe, grid.center(cells[i]), grid.radius_m, outward, bound, static_cast<Eigen::Index>(i),
                batch);
  }
  batch.counts = probe.counts();
  return batch;
}

std::vector<int64_t> cellsInReach(const SphereGrid& grid, const fv_robot_model::ik::ReachBound& bound) {
  std::vector<int64_t> cells;
  for (int64_t cell = 0; cell < grid.cellCount(); ++cell) {
    // The point of the sphere nearest to the shoulder must be within reach.
    if ((grid.center(cell) - bound.center).norm() - grid.radius_m <= bound.radius_m) cells.push_back(cell);
  }
  return cells;
}

}  // namespace capability_map
