// Least squares within the tolerances, from several starts: for chains of fewer than six joints, which hold
// next to no pose exactly, and for others without a closed form when tolerances are asked for.

#include <algorithm>
#include <sstream>

#include "fv_robot_model/ik/pose_target.h"
#include "solvers.h"

namespace fv_robot_model::ik {

namespace {

class Tolerant : public IkSolver {
 public:
  Tolerant(const SerialChain& chain, const IkOptions& options)
      : IkSolver(chain, options), descent_(chain, options.numerical_iterations) {}

  bool exact() const override { return false; }
  bool numerical() const override { return true; }
  std::string family() const override { return "least-squares"; }
  std::string name() const override {
    std::ostringstream text;
    text << family() << ": Levenberg-Marquardt within the tolerances from " << options_.numerical_starts
         << " starts, because the chain "
         << (chain_.isCoupled() ? "has mimic joints" : "has no closed form here");
    return text.str();
  }

  void solvePose(const Eigen::Isometry3d& T_base_tip, const double* seed, IkSolutions& out) const override {
    PoseTarget target;
    target.T_base_tool = T_base_tip;
    target.position_tolerance_m = options_.position_tolerance_m;
    target.angle_tolerance_rad = options_.angle_tolerance_rad;
    if (chain_.dof() < 6) {
      target.angle_tolerance_rad = std::max(target.angle_tolerance_rad, options_.direction_tolerance_rad);
    }
    descent_.solve(target, seed, static_cast<int>(options_.numerical_seed) - 1, options_.numerical_starts,
                   out);
  }

 private:
  TolerantIk descent_;
};

}  // namespace

std::unique_ptr<IkSolver> makeTolerant(const SerialChain& chain, const IkOptions& options) {
  return std::make_unique<Tolerant>(chain, options);
}

}  // namespace fv_robot_model::ik
