// Redundant arms that turn into a 6R with closed form when one or two joints are held: the waist below an arm
// with a spherical shoulder, or the last joint of a Franka Panda. The held joints step over their ranges.

#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

#include "solvers.h"

namespace fv_robot_model::ik {

namespace {

/// Values over a joint's range with at most the given step, ends included.
std::vector<double> samplesOf(const ChainJoint& joint, double step) {
  const double range = std::min(joint.upper - joint.lower, 2.0 * M_PI);
  const double middle = 0.5 * (joint.lower + joint.upper);
  const int count = range > 0.0 ? static_cast<int>(std::ceil(range / step)) + 1 : 1;
  std::vector<double> values;
  for (int i = 0; i < count; ++i) {
    values.push_back(count == 1 ? middle : middle - 0.5 * range + range * i / (count - 1));
  }
  return values;
}

class JointSweep : public IkSolver {
 public:
  struct Held {
    std::vector<double> values;  // of the held joints, in the order of held_
    std::unique_ptr<IkSolver> rest;
  };

  /// @param levels  held values, coarse to fine: a level is tried when those before it have found nothing.
  JointSweep(const SerialChain& chain, const IkOptions& options, std::vector<int> held,
             std::vector<std::vector<Held>> levels)
      : IkSolver(chain, options), held_(std::move(held)), levels_(std::move(levels)) {}

  bool exact() const override { return false; }
  std::string family() const override { return "sweep+" + levels_.front().front().rest->family(); }
  std::string name() const override {
    std::ostringstream text;
    text << family() << ": " << levels_.front().size() << " values of";
    for (const int joint : held_) text << ' ' << chain_.joint(joint).name;
    text << ", because with it held the rest is a " << levels_.front().front().rest->name();
    return text.str();
  }

  void solvePose(const Eigen::Isometry3d& T_base_tip, const double* seed, IkSolutions& out) const override {
    const int first = out.size();
    for (const std::vector<Held>& level : levels_) {
      solveSamples(level, T_base_tip, out);
      if (out.size() > first) break;
    }
    if (seed != nullptr) solveAtSeed(T_base_tip, seed, out);
  }

 private:
  void solveSamples(const std::vector<Held>& samples, const Eigen::Isometry3d& T_base_tip,
                    IkSolutions& out) const {
    IkSolutions rest;
    std::vector<double> q(static_cast<size_t>(chain_.dof()));
    for (const Held& sample : samples) {
      rest.reset(sample.rest->chain().dof());
      sample.rest->solvePose(T_base_tip, nullptr, rest);
      for (int i = 0; i < rest.size(); ++i) {
        merge(sample.values, rest.row(i), q);
        out.push(q.data());
      }
    }
  }

  void merge(const std::vector<double>& values, const double* rest, std::vector<double>& q) const {
    size_t held = 0;
    for (int joint = 0; joint < chain_.dof(); ++joint) {
      const bool is_held = held < held_.size() && held_[held] == joint;
      q[static_cast<size_t>(joint)] = is_held ? values[held] : *rest;
      is_held ? static_cast<void>(++held) : static_cast<void>(++rest);
    }
  }

  /// The seed's own values of the held joints: continuity along a path asks for them.
  void solveAtSeed(const Eigen::Isometry3d& T_base_tip, const double* seed, IkSolutions& out) const {
    SerialChain chain = chain_;
    std::vector<double> values;
    for (const int joint : held_)
      values.push_back(std::clamp(seed[joint], chain_.joint(joint).lower, chain_.joint(joint).upper));
    for (size_t i = held_.size(); i-- > 0;) chain = chain.withFixedJoint(held_[i], values[i]);
    const auto solver = makeSpherical6R(chain, options_);
    if (!solver) return;
    IkSolutions rest(chain.dof());
    solver->solvePose(T_base_tip, nullptr, rest);
    std::vector<double> q(static_cast<size_t>(chain_.dof()));
    for (int i = 0; i < rest.size(); ++i) {
      merge(values, rest.row(i), q);
      out.push(q.data());
    }
  }

  std::vector<int> held_;
  std::vector<std::vector<Held>> levels_;
};

/// One solver per combination of held values; empty when any of them has no closed form.
std::vector<JointSweep::Held> heldSolvers(const SerialChain& chain, const IkOptions& options,
                                          const std::vector<int>& held, double step) {
  std::vector<std::vector<double>> grid{{}};
  for (const int joint : held) {
    std::vector<std::vector<double>> finer;
    for (const auto& values : grid) {
      for (const double value : samplesOf(chain.joint(joint), step)) {
        finer.push_back(values);
        finer.back().push_back(value);
      }
    }
    grid = std::move(finer);
  }
  std::vector<JointSweep::Held> solvers;
  for (auto& values : grid) {
    SerialChain rest = chain;
    for (size_t i = held.size(); i-- > 0;) rest = rest.withFixedJoint(held[i], values[i]);
    auto solver = makeSpherical6R(rest, options);
    if (!solver) return {};
    solvers.push_back({std::move(values), std::move(solver)});
  }
  return solvers;
}

/// Which joints to try to hold: the ones nearest the base first, then from the tip, then between.
std::vector<std::vector<int>> heldCandidates(int dof) {
  if (dof == 7) return {{0}, {6}, {2}, {1}, {3}, {4}, {5}};
  if (dof == 8) return {{0, 1}, {0, 7}, {6, 7}, {0, 3}};
  return {};
}

}  // namespace

int jointToHold(const SerialChain& chain) {
  if (chain.dof() != 7 || !allRevolute(chain)) return -1;
  for (const std::vector<int>& held : heldCandidates(7)) {
    const ChainJoint& joint = chain.joint(held[0]);
    if (makeSpherical6R(chain.withFixedJoint(held[0], 0.5 * (joint.lower + joint.upper)), {})) return held[0];
  }
  return -1;
}

std::unique_ptr<IkSolver> makeJointSweep(const SerialChain& chain, const IkOptions& options) {
  if (!allRevolute(chain)) return nullptr;
  for (const std::vector<int>& held : heldCandidates(chain.dof())) {
    std::vector<std::vector<JointSweep::Held>> levels;
    levels.push_back(heldSolvers(chain, options, held, options.sweep_step_rad));
    if (levels.front().empty()) continue;
    const int refinements = held.size() == 1 ? options.sweep_refinements : 0;
    for (int k = 1; k <= refinements; ++k) {
      levels.push_back(heldSolvers(chain, options, held, options.sweep_step_rad * std::pow(0.25, k)));
    }
    return std::make_unique<JointSweep>(chain, options, held, std::move(levels));
  }
  return nullptr;
}

}  // namespace fv_robot_model::ik
