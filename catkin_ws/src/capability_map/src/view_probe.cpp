#include "capability_map/view_probe.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace capability_map {

namespace ik = fv_robot_model::ik;

namespace {

constexpr int kFinerRolls = 5;  // tries on each side of a roll that misses a limit by little

/// 0 to 2 pi in at most the given steps, coarse to fine: most views that can be held are found in a few
/// tries.
std::vector<double> coarseToFine(double step) {
  const int count = std::max(1, static_cast<int>(std::ceil(2.0 * M_PI / step - 1e-9)));
  std::vector<double> angles;
  std::vector<bool> used(static_cast<size_t>(count), false);
  for (int stride = count; stride >= 1; stride /= 2) {
    for (int i = 0; i < count; i += stride) {
      if (used[static_cast<size_t>(i)]) continue;
      used[static_cast<size_t>(i)] = true;
      angles.push_back(2.0 * M_PI * i / count);
    }
  }
  return angles;
}

/// The last joint's axis is the tip's z axis: turning it is rolling.
bool rollsAboutTipZ(const ik::SerialChain& chain) {
  const ik::ChainJoint& last = chain.joints().back();
  const Eigen::Vector3d z = chain.zeroPose().linear().col(2);
  const bool aligned = last.axis.cross(z).norm() < 1e-6;
  const bool on_axis = last.axis.cross(chain.zeroPose().translation() - last.point).norm() < 1e-6;
  return !last.prismatic && aligned && on_axis;
}

/// The point of line a that is nearest to line b.
Eigen::Vector3d nearestPoint(const ik::ChainJoint& a, const ik::ChainJoint& b) {
  const Eigen::Vector3d across = a.axis.cross(b.axis);
  if (across.squaredNorm() < 1e-12) return a.point;
  return a.point + (b.point - a.point).cross(b.axis).dot(across) / across.squaredNorm() * a.axis;
}

Eigen::Matrix3d frameLookingAlong(const Eigen::Vector3d& z) {
  Eigen::Matrix3d R;
  R.col(2) = z.normalized();
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
  ik_options.direction_tolerance_rad = options.direction_tolerance_rad;
  const ik::SerialChain chain = ik::chainOfGroup(model, group);
  roll_by_last_joint_ = rollsAboutTipZ(chain);
  const ik::SerialChain free_roll =
      roll_by_last_joint_ ? chain.withLimits(chain.dof() - 1, -M_PI, M_PI) : chain;
  solver_ = ik::makeIkSolver(chain, ik_options);
  if (roll_by_last_joint_ && chain.dof() > 6 && !solver_->exact()) holdLastJoint(chain, ik_options);
  roll_solver_ = ik::makeIkSolver(free_roll, ik_options);
  if (solver_->exact() && chain.dof() > 6) {
    ik_options.sweep_step_rad = 2.0 * M_PI;
    one_per_interval_ = ik::makeIkSolver(free_roll, ik_options);
  }
  const bool searches = options.roll_search && !roll_by_last_joint_ && solver_->exact() && chain.dof() == 6;
  if (searches) prepareRollSearch(chain, ik_options);
  if (options.self_collision) {
    collision_ = std::make_unique<fv_robot_model::SelfCollision>(
        model, group_, fv_robot_model::SelfCollisionConfig{options.self_collision_padding_m, true});
  }
  rolls_ = coarseToFine(options.roll_step_rad);
  // Joints outside the group rest at zero, or at the nearest value that their limits allow.
  q_all_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.jointNames().size()));
  for (Eigen::Index i = 0; i < q_all_.size(); ++i) {
    const fv_robot_model::JointLimits& limits = model.limits()[static_cast<size_t>(i)];
    q_all_[i] = std::clamp(0.0, limits.lower, limits.upper);
  }
  model.forward(q_all_, link_poses_);
}

void ViewProbe::holdLastJoint(const ik::SerialChain& chain, const ik::IkOptions& ik_options) {
  const ik::ChainJoint& last = chain.joints().back();
  held_value_ = std::clamp(0.0, last.lower, last.upper);
  held_solver_ = ik::makeIkSolver(chain.withFixedJoint(chain.dof() - 1, held_value_), ik_options);
  if (!held_solver_->exact()) held_solver_.reset();
}

void ViewProbe::prepareRollSearch(const ik::SerialChain& chain, const ik::IkOptions& ik_options) {
  ik::SerialChain wider = chain;
  // Joints move faster than the tip rolls where the arm is nearly stretched.
  const double slack = 3.0 * options_.roll_step_rad;
  for (int i = 0; i < chain.dof(); ++i) {
    wider = wider.withLimits(i, chain.joint(i).lower - slack, chain.joint(i).upper + slack);
  }
  wider_solver_ = ik::makeIkSolver(wider, ik_options);
  shoulder_ = nearestPoint(chain.joint(0), chain.joint(1));
  p_tip_wrist_ =
      chain.zeroPose().inverse() * nearestPoint(chain.joint(chain.dof() - 1), chain.joint(chain.dof() - 2));
}

bool ViewProbe::isFree(const double* q) {
  if (!collision_) return true;
  ++counts_.collision_checks;
  for (int k = 0; k < dof(); ++k) q_all_[group_.joint_indices[static_cast<size_t>(k)]] = q[k];
  model_.forward(q_all_, group_, link_poses_);
  return !collision_->inContact(link_poses_);
}

double ViewProbe::bestFree(bool any_roll, double* q_witness) {
  ranking_.clear();
  for (int i = 0; i < solutions_.size(); ++i) {
    ranking_.emplace_back(-solver_->chain().manipulability(solutions_.row(i)), i);
  }
  std::sort(ranking_.begin(), ranking_.end());
  for (const auto& [negative, i] : ranking_) {
    double* q = solutions_.row(i);
    const bool free = any_roll ? freeAtSomeRoll(q) : isFree(q);
    if (!free) continue;
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

double ViewProbe::decideFreeRoll(const Eigen::Isometry3d& T, double* q_witness) {
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
  return bestFree(roll_by_last_joint_, q_witness);
}

double ViewProbe::solveHeld(const Eigen::Isometry3d& T, double* q_witness) {
  held_solutions_.reset(dof() - 1);
  ++counts_.ik_calls;
  held_solver_->solvePose(T, nullptr, held_solutions_);
  solutions_.reset(dof());
  solutions_.resize(held_solutions_.size());
  for (int i = 0; i < held_solutions_.size(); ++i) {
    std::copy_n(held_solutions_.row(i), dof() - 1, solutions_.row(i));
    solutions_.row(i)[dof() - 1] = held_value_;
  }
  return bestFree(false, q_witness);
}

double ViewProbe::decide(const Eigen::Vector3d& position, const Eigen::Vector3d& direction,
                         double* q_witness) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = position;
  T.linear() = frameLookingAlong(direction);
  if (roll_by_last_joint_ && !held_solver_) return decideFreeRoll(T, q_witness);
  return wider_solver_ ? searchRoll(T, q_witness) : stepRoll(T, q_witness);
}

double ViewProbe::stepRoll(const Eigen::Isometry3d& T, double* q_witness) {
  for (const double roll : rolls_) {
    const Eigen::Isometry3d rolled = T * Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ());
    const double manipulability =
        held_solver_ ? solveHeld(rolled, q_witness) : decideFreeRoll(rolled, q_witness);
    if (manipulability >= 0.0) return manipulability;
  }
  return -1.0;
}

double ViewProbe::searchRoll(const Eigen::Isometry3d& T, double* q_witness) {
  near_misses_.clear();
  // At these two rolls the wrist is nearest to and farthest from the shoulder: a window that the elbow alone
  // bounds has one of them in its middle, however narrow it is.
  const Eigen::Vector3d shoulder = T.inverse() * shoulder_;
  const double stretched =
      std::atan2(shoulder.y(), shoulder.x()) - std::atan2(p_tip_wrist_.y(), p_tip_wrist_.x());
  for (const double roll : {stretched, stretched + M_PI}) {
    const double manipulability = tryRoll(T, roll, q_witness);
    if (manipulability >= 0.0) return manipulability;
  }
  for (const double roll : rolls_) {
    const double manipulability = tryRoll(T, roll, q_witness);
    if (manipulability >= 0.0) return manipulability;
  }
  // Windows between joint limits may be narrower than a step: look closer where a limit is missed by little.
  for (const double roll : near_misses_) {
    for (int k = 1; k <= kFinerRolls; ++k) {
      for (const double side : {-1.0, 1.0}) {
        const double finer = roll + side * k * 0.5 * options_.roll_step_rad / kFinerRolls;
        const Eigen::Isometry3d rolled = T * Eigen::AngleAxisd(finer, Eigen::Vector3d::UnitZ());
        const double manipulability = solveWith(*solver_, rolled, q_witness);
        if (manipulability >= 0.0) return manipulability;
      }
    }
  }
  return -1.0;
}

double ViewProbe::tryRoll(const Eigen::Isometry3d& T, double roll, double* q_witness) {
  const Eigen::Isometry3d rolled = T * Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ());
  solutions_.reset(dof());
  ++counts_.ik_calls;
  wider_solver_->solvePose(rolled, nullptr, solutions_);
  int kept = 0;
  for (int i = 0; i < solutions_.size(); ++i) {
    if (!solver_->chain().withinLimits(solutions_.row(i), 0.0)) continue;
    std::copy_n(solutions_.row(i), dof(), solutions_.row(kept++));
  }
  if (kept < solutions_.size()) near_misses_.push_back(roll);
  solutions_.resize(kept);
  return kept > 0 ? bestFree(false, q_witness) : -1.0;
}

double ViewProbe::decidePose(const Eigen::Isometry3d& T_base_tip, double* q_witness) {
  solutions_.reset(dof());
  ++counts_.ik_calls;
  solver_->solvePose(T_base_tip, nullptr, solutions_);
  return bestFree(false, q_witness);
}

}  // namespace capability_map
