#include "view_probe.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "view_direction.h"

namespace capability_map {

namespace ik = fv_robot_model::ik;

namespace {

/// The last joint's axis is the tip's z axis: turning it is rolling.
bool rollsAboutTipZ(const ik::SerialChain& chain) {
  const ik::ChainJoint& last = chain.joints().back();
  const Eigen::Vector3d z = chain.zeroPose().linear().col(2);
  const bool aligned = last.axis.cross(z).norm() < 1e-6;
  const bool on_axis = last.axis.cross(chain.zeroPose().translation() - last.point).norm() < 1e-6;
  return !last.prismatic && aligned && on_axis && !chain.isCoupled();
}

/// @param z A unit vector.
Eigen::Matrix3d frameLookingAlong(const Eigen::Vector3d& z) {
  Eigen::Matrix3d R;
  R.col(2) = z;
  R.col(0) = R.col(2).unitOrthogonal();
  R.col(1) = R.col(2).cross(R.col(0));
  return R;
}

}  // namespace

ViewProbe::ViewProbe(const fv_robot_model::RobotModel& model, const std::string& group,
                     const ProbeOptions& options)
    : model_(model), group_(model.group(group)), options_(options) {
  if (!(options.roll_step_rad > 0.0) || !(options.arm_angle_step_rad > 0.0)) {
    throw std::invalid_argument("roll_step_rad and arm_angle_step_rad must be positive");
  }
  ik::IkOptions ik_options;
  ik_options.sweep_step_rad = options.arm_angle_step_rad;
  ik_options.sweep_refinements = 1;  // the roll search looks for what is narrower
  ik_options.direction_tolerance_rad = options.direction_tolerance_rad;
  const ik::SerialChain chain = ik::chainOfGroup(model, group);
  roll_by_last_joint_ = rollsAboutTipZ(chain);
  solver_ = ik::makeIkSolver(chain, ik_options);
  if (roll_by_last_joint_ && solver_->exact()) {
    const ik::SerialChain free_roll = chain.withLimits(chain.dof() - 1, -M_PI, M_PI);
    roll_solver_ = ik::makeIkSolver(free_roll, ik_options);
    ik_options.sweep_step_rad = 2.0 * M_PI;
    if (chain.dof() > 6) one_per_interval_ = ik::makeIkSolver(free_roll, ik_options);
  } else {
    const RollSearchOptions search{options.roll_step_rad, options.arm_angle_step_rad, options.roll_search};
    roll_search_ = RollSearch::make(chain, ik_options, search, roll_by_last_joint_);
  }
  if (options.self_collision) {
    collision_ = std::make_unique<fv_robot_model::SelfCollision>(
        model, group_, fv_robot_model::SelfCollisionConfig{options.self_collision_padding_m, true});
  }
  // Joints outside the group rest at zero, or at the nearest value that their limits allow.
  q_all_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.jointNames().size()));
  for (Eigen::Index i = 0; i < q_all_.size(); ++i) {
    const fv_robot_model::JointLimits& limits = model.limits()[static_cast<size_t>(i)];
    q_all_[i] = std::clamp(0.0, limits.lower, limits.upper);
  }
  model.forward(q_all_, link_poses_);
  if (roll_search_ && collision_) {
    const std::vector<double> held = roll_search_->heldValuesOfLastJoint();
    tip_contact_ = std::make_unique<TipContact>(model, group_, q_all_, held);
    tip_contact_of_held_ = !held.empty();
  }
}

bool ViewProbe::isFree(const double* q) {
  if (!collision_) return true;
  ++counts_.collision_checks;
  for (int k = 0; k < dof(); ++k) q_all_[group_.joint_indices[static_cast<size_t>(k)]] = q[k];
  model_.forward(q_all_, group_, link_poses_);
  return !collision_->inContact(link_poses_);
}

double ViewProbe::bestFree(ik::IkSolutions& solutions, double* q_witness) {
  ranking_.clear();
  for (int i = 0; i < solutions.size(); ++i) {
    ranking_.emplace_back(-solver_->chain().manipulability(solutions.row(i)), i);
  }
  std::sort(ranking_.begin(), ranking_.end());
  for (const auto& [negative, i] : ranking_) {
    double* q = solutions.row(i);
    if (!(roll_solver_ ? freeAtSomeRoll(q) : isFree(q))) continue;
    std::copy_n(q, dof(), q_witness);
    return -negative;
  }
  return -1.0;
}

bool ViewProbe::freeAtSomeRoll(double* q) {
  // The last joint is free: its middle, then others, in case that what is mounted on it touches the arm.
  constexpr int kTries = 8;
  const ik::ChainJoint& last = solver_->chain().joints().back();
  const double middle = std::clamp(0.0, last.lower, last.upper);
  for (int i = 0; i < kTries; ++i) {
    q[dof() - 1] = i == 0 ? middle : last.lower + (last.upper - last.lower) * (i - 0.5) / (kTries - 1);
    if (isFree(q)) return true;
    if (!collision_) return false;
  }
  return false;
}

double ViewProbe::decide(const Eigen::Vector3d& position, const Eigen::Vector3d& direction,
                         double* q_witness) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = position;
  T.linear() = frameLookingAlong(viewDirection(position, direction));
  if (roll_solver_) return decideByLastJoint(T, q_witness);
  return roll_search_ ? searchRoll(T, q_witness) : stepRoll(T, q_witness);
}

double ViewProbe::decideByLastJoint(const Eigen::Isometry3d& T, double* q_witness) {
  if (one_per_interval_) {
    const double manipulability = solveWith(*one_per_interval_, T, q_witness);
    // No solution at all is final; solutions that all collide may have free ones between them.
    if (manipulability >= 0.0 || solutions_.empty()) return manipulability;
  }
  return solveWith(*roll_solver_, T, q_witness);
}

double ViewProbe::solveWith(const ik::IkSolver& solver, const Eigen::Isometry3d& T, double* q_witness) {
  solutions_.reset(dof());
  ++counts_.ik_calls;
  solver.solvePose(T, nullptr, solutions_);
  return bestFree(solutions_, q_witness);
}

double ViewProbe::searchRoll(const Eigen::Isometry3d& T, double* q_witness) {
  double manipulability = -1.0;
  bool met_contact = false;
  const int64_t before = roll_search_->ikCalls();
  // Most views meet no contact: only where one did, what the tip carries is looked at first.
  const auto tip_is_free = [&](const Eigen::Isometry3d& T_base_tip, size_t held) {
    if (!met_contact) return true;
    ++counts_.collision_checks;
    return !tip_contact_->unavoidable(*collision_, T_base_tip, tip_contact_of_held_ ? held : 0);
  };
  roll_search_->search(T, tip_is_free, [&](ik::IkSolutions& solutions) {
    manipulability = bestFree(solutions, q_witness);
    met_contact = manipulability < 0.0;
    return !met_contact;
  });
  counts_.ik_calls += roll_search_->ikCalls() - before;
  return manipulability;
}

double ViewProbe::stepRoll(const Eigen::Isometry3d& T, double* q_witness) {
  const int count = std::max(1, static_cast<int>(std::ceil(2.0 * M_PI / options_.roll_step_rad - 1e-9)));
  for (int i = 0; i < count; ++i) {
    const Eigen::AngleAxisd roll(2.0 * M_PI * i / count, Eigen::Vector3d::UnitZ());
    const double manipulability = solveWith(*solver_, T * roll, q_witness);
    if (manipulability >= 0.0) return manipulability;
  }
  return -1.0;
}

}  // namespace capability_map
