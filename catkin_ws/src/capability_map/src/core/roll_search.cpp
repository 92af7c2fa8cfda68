#include "roll_search.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace capability_map {

namespace ik = fv_robot_model::ik;

namespace {

constexpr size_t kNearMisses = 512;  // kept per view

/// The point in which two lines meet, if they do to 1e-6 m.
bool meetingPoint(const ik::ChainJoint& a, const ik::ChainJoint& b, Eigen::Vector3d& point) {
  const Eigen::Vector3d across = a.axis.cross(b.axis);
  if (across.squaredNorm() < 1e-8) return false;
  point = a.point + (b.point - a.point).cross(b.axis).dot(across) / across.squaredNorm() * a.axis;
  return b.axis.cross(point - b.point).norm() < 1e-6;
}

bool onAxis(const ik::ChainJoint& joint, const Eigen::Vector3d& point) {
  return joint.axis.cross(point - joint.point).norm() < 1e-6;
}

/// Which joint lies between all axes through a shoulder and all axes through a wrist; -1 for none.
int elbowOf(const ik::SerialChain& chain, Eigen::Vector3d& shoulder, Eigen::Vector3d& wrist) {
  if (chain.dof() != 6 || !meetingPoint(chain.joint(0), chain.joint(1), shoulder) ||
      !meetingPoint(chain.joint(4), chain.joint(5), wrist)) {
    return -1;
  }
  if (onAxis(chain.joint(2), shoulder)) return 3;
  return onAxis(chain.joint(3), wrist) ? 2 : -1;
}

/// Indices 0 to count - 1, coarse to fine, each with the stride at which it appears.
std::vector<std::pair<int, int>> coarseToFine(int count) {
  std::vector<std::pair<int, int>> order;
  std::vector<bool> used(static_cast<size_t>(count), false);
  for (int stride = count; stride >= 1; stride /= 2) {
    for (int i = 0; i < count; i += stride) {
      if (used[static_cast<size_t>(i)]) continue;
      used[static_cast<size_t>(i)] = true;
      order.emplace_back(i, stride);
    }
  }
  return order;
}

/// Values over a joint's range with at most the given step, ends included.
std::vector<double> valuesOf(const ik::ChainJoint& joint, double step) {
  const double range = std::min(joint.upper - joint.lower, 2.0 * M_PI);
  const double low = 0.5 * (joint.lower + joint.upper - range);
  const int count = static_cast<int>(std::ceil(range / step - 1e-9)) + 1;
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(low + range * i / std::max(1, count - 1));
  return values;
}

ik::SerialChain widened(ik::SerialChain chain, double slack) {
  for (int i = 0; i < chain.dof(); ++i)
    chain = chain.withLimits(i, chain.joint(i).lower - slack, chain.joint(i).upper + slack);
  return chain;
}

Eigen::Isometry3d rolled(const Eigen::Isometry3d& T, double c, double s) {
  Eigen::Isometry3d out = T;
  out.linear().col(0) = c * T.linear().col(0) + s * T.linear().col(1);
  out.linear().col(1) = c * T.linear().col(1) - s * T.linear().col(0);
  return out;
}

/// The turn after which joints that move at these rates are within their limits: the least one, and a little
/// more. Where the limits leave no turn but nearly do, the one between them.
/// Rates grow towards the end of a branch, so up to twice `most` is believed to be `most`.
/// @return false when more would be needed or the limits leave a gap of more than half of `most`.
bool turnIntoLimits(const ik::SerialChain& chain, const double* q, const Eigen::Matrix<double, 6, 1>& rate,
                    double most, double& turn) {
  double low = -std::numeric_limits<double>::infinity();
  double high = -low;
  for (int k = 0; k < 6; ++k) {
    const double below = (chain.joint(k).lower - q[k]) / rate[k];
    const double above = (chain.joint(k).upper - q[k]) / rate[k];
    low = std::max(low, std::min(below, above));
    high = std::min(high, std::max(below, above));
  }
  const double inside = std::min(0.02 * most, 0.5 * (high - low));
  turn = std::clamp(0.0, low + inside, std::max(low + inside, high - inside));
  const bool near =
      low - high < 0.5 * most && std::abs(turn) < 2.0 * most;  // not for NaN: a joint stands still
  turn = std::clamp(turn, -most, most);
  return near;
}

}  // namespace

ElbowBound::ElbowBound(const ik::SerialChain& chain) {
  Eigen::Vector3d wrist;
  const int elbow = elbowOf(chain, shoulder_, wrist);
  if (elbow < 0) return;
  bounded_ = true;
  p_tip_wrist_ = chain.zeroPose().inverse() * wrist;
  // |wrist - shoulder|^2 = constant + cosine cos q + sine sin q of the elbow's angle q.
  const ik::ChainJoint& joint = chain.joint(elbow);
  const Eigen::Vector3d upper = joint.point - shoulder_;
  const Eigen::Vector3d fore = wrist - joint.point;
  const double along = joint.axis.dot(fore);
  const double constant = upper.squaredNorm() + fore.squaredNorm() + 2.0 * along * upper.dot(joint.axis);
  const double cosine = 2.0 * upper.dot(fore - along * joint.axis);
  const double sine = 2.0 * upper.dot(joint.axis.cross(fore));
  least_m2_ = std::numeric_limits<double>::infinity();
  most_m2_ = -least_m2_;
  const auto meet = [&](double q) {
    const double squared = constant + cosine * std::cos(q) + sine * std::sin(q);
    least_m2_ = std::min(least_m2_, squared);
    most_m2_ = std::max(most_m2_, squared);
  };
  meet(joint.lower);
  meet(joint.upper);
  for (double peak = std::atan2(sine, cosine) - 4.0 * M_PI; peak <= joint.upper; peak += M_PI)
    if (peak >= joint.lower) meet(peak);
  const double rounding = 1e-9 * (constant + std::hypot(cosine, sine));  // as the solver's grazing solutions
  least_m2_ -= rounding;
  most_m2_ += rounding;
}

ElbowBound::Rolls ElbowBound::rolls(const Eigen::Isometry3d& T_base_tip) const {
  Rolls rolls;
  if (!bounded_) return rolls;
  // In the tip's frame the wrist circles about z and the shoulder stands still:
  // |wrist - shoulder|^2 = constant - across cos(roll - middle).
  const Eigen::Vector3d shoulder = T_base_tip.linear().transpose() * (shoulder_ - T_base_tip.translation());
  const Eigen::Vector2d w = p_tip_wrist_.head<2>();
  const Eigen::Vector2d s = shoulder.head<2>();
  const double across = 2.0 * std::sqrt(w.squaredNorm() * s.squaredNorm());
  const double constant =
      p_tip_wrist_.squaredNorm() + shoulder.squaredNorm() - 2.0 * p_tip_wrist_.z() * shoulder.z();
  if (across < 1e-12) {
    if (constant < least_m2_ || constant > most_m2_) rolls.least = 2.0;
    return rolls;
  }
  rolls.middle_cos = 2.0 * (s.x() * w.x() + s.y() * w.y()) / across;
  rolls.middle_sin = 2.0 * (s.y() * w.x() - s.x() * w.y()) / across;
  rolls.least = (constant - most_m2_) / across;
  rolls.most = (constant - least_m2_) / across;
  return rolls;
}

RollSearch::Arm::Arm(const ik::SerialChain& real, double held_value, const ik::IkOptions& ik_options,
                     double slack)
    : chain(real),
      wider(ik::makeIkSolver(widened(real, slack), ik_options)),
      elbow(wider->chain()),
      held(held_value) {}

std::unique_ptr<RollSearch> RollSearch::make(const ik::SerialChain& chain, const ik::IkOptions& ik_options,
                                             const RollSearchOptions& options, bool last_joint_rolls) {
  if (chain.isCoupled()) return nullptr;  // its joints cannot be held or turned one by one
  // Joints move faster than the tip rolls where the arm is nearly stretched.
  const double slack = options.between_steps ? 3.0 * options.roll_step_rad : 0.0;
  int held_joint = -1;
  std::vector<Arm> arms;
  if (chain.dof() == 6) {
    arms.emplace_back(chain, 0.0, ik_options, slack);
  } else if (chain.dof() == 7) {
    held_joint = last_joint_rolls ? 6 : ik::jointToHold(chain);
    if (held_joint < 0) return nullptr;
    const ik::ChainJoint& joint = chain.joint(held_joint);
    // A last joint that rolls needs no steps: the rolls themselves are stepped.
    const std::vector<double> values = last_joint_rolls
                                           ? std::vector<double>{std::clamp(0.0, joint.lower, joint.upper)}
                                           : valuesOf(joint, options.hold_step_rad);
    for (const double value : values)
      arms.emplace_back(chain.withFixedJoint(held_joint, value), value, ik_options, slack);
  }
  const auto exact = [](const Arm& arm) { return arm.wider->exact(); };
  if (arms.empty() || !std::all_of(arms.begin(), arms.end(), exact)) return nullptr;
  return std::unique_ptr<RollSearch>(new RollSearch(chain.dof(), held_joint, std::move(arms), options));
}

RollSearch::RollSearch(int dof, int held_joint, std::vector<Arm> arms, const RollSearchOptions& options)
    : dof_(dof),
      held_joint_(held_joint),
      arms_(std::move(arms)),
      options_(options),
      rolls_of_arm_(arms_.size()) {
  const int rolls = std::max(1, static_cast<int>(std::ceil(2.0 * M_PI / options.roll_step_rad - 1e-9)));
  std::vector<std::pair<double, std::pair<uint32_t, Roll>>>
      ranked;  // by the coarser of both strides, as shares
  for (const auto& [i, roll_stride] : coarseToFine(rolls)) {
    const double angle = 2.0 * M_PI * i / rolls;
    for (const auto& [arm, stride] : coarseToFine(static_cast<int>(arms_.size()))) {
      const double fineness = std::min(static_cast<double>(roll_stride) / rolls,
                                       arms_.size() == 1 ? 1.0 : static_cast<double>(stride) / arms_.size());
      ranked.push_back({fineness, {static_cast<uint32_t>(arm), {std::cos(angle), std::sin(angle), angle}}});
    }
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  for (const auto& entry : ranked) tries_.push_back(entry.second);
}

std::vector<double> RollSearch::heldValuesOfLastJoint() const {
  std::vector<double> values;
  if (held_joint_ != dof_ - 1) return values;
  for (const Arm& arm : arms_) values.push_back(arm.held);
  return values;
}

bool RollSearch::search(const Eigen::Isometry3d& T_base_tip, const Filter& filter, const Visitor& visit) {
  T_ = T_base_tip;
  near_misses_.clear();
  bool any = false;
  for (size_t i = 0; i < arms_.size(); ++i) {
    rolls_of_arm_[i] = arms_[i].elbow.rolls(T_);
    any = any || !rolls_of_arm_[i].none();
  }
  if (!any) return false;
  if (options_.between_steps && arms_.size() == 1) {
    // At these two rolls the wrist is nearest to and farthest from the shoulder: a window that the elbow
    // alone bounds has one of them in its middle, however narrow it is.
    const ElbowBound::Rolls& rolls = rolls_of_arm_[0];
    const double angle = std::atan2(rolls.middle_sin, rolls.middle_cos);
    if (tryRoll(0, {rolls.middle_cos, rolls.middle_sin, angle}, filter, visit)) return true;
    if (tryRoll(0, {-rolls.middle_cos, -rolls.middle_sin, angle + M_PI}, filter, visit)) return true;
  }
  for (const auto& [arm, roll] : tries_)
    if (tryRoll(arm, roll, filter, visit)) return true;
  // Windows between joint limits may be narrower than a step.
  for (const NearMiss& miss : near_misses_)
    if (tryNearMiss(miss, visit)) return true;
  return false;
}

bool RollSearch::tryRoll(size_t arm, const Roll& roll, const Filter& filter, const Visitor& visit) {
  if (!rolls_of_arm_[arm].admits(roll.c, roll.s)) return false;
  const Eigen::Isometry3d T = rolled(T_, roll.c, roll.s);
  if (!filter(T, arm)) return false;
  solve(arms_[arm], T);
  if (visitWithin(arms_[arm], visit)) return true;
  if (options_.between_steps) {
    for (int i = 0; i < found_.size() && near_misses_.size() < kNearMisses; ++i) {
      if (arms_[arm].chain.withinLimits(found_.row(i), 0.0)) continue;
      NearMiss miss{arm, roll, {}};
      std::copy_n(found_.row(i), 6, miss.q.begin());
      near_misses_.push_back(miss);
    }
  }
  return false;
}

bool RollSearch::tryNearMiss(NearMiss miss, const Visitor& visit) {
  // The joints' rates while the tip rolls say where the limits will be met: Newton's method, for joints do
  // not move evenly. Where a turn leads beyond the end of the branch (a stretched arm, a folded wrist) half
  // of it will do.
  constexpr int kTurns = 6;
  const Arm& arm = arms_[miss.arm];
  Eigen::Matrix<double, 6, 1> rolling;
  rolling << Eigen::Vector3d::Zero(), T_.linear().col(2);
  Eigen::Matrix<double, 6, 1> rate;
  double turn = 0.0;
  bool on_branch = true;
  for (int step = 0; step < kTurns; ++step) {
    if (on_branch) {
      const Eigen::Matrix<double, 6, 6> J = arm.chain.jacobian(miss.q.data());
      rate = J.partialPivLu().solve(rolling);
      if (!turnIntoLimits(arm.chain, miss.q.data(), rate, options_.roll_step_rad, turn)) return false;
    } else {
      turn *= 0.5;
    }
    const double angle = miss.roll.angle + turn;
    const Roll roll{std::cos(angle), std::sin(angle), angle};
    solve(arm, rolled(T_, roll.c, roll.s));
    if (visitWithin(arm, visit)) return true;
    if (!whole_.empty()) return false;  // within limits, but not wanted
    on_branch = follow(turn * rate, miss);
    if (on_branch) miss.roll = roll;
  }
  return false;
}

bool RollSearch::follow(const Eigen::Matrix<double, 6, 1>& moved, NearMiss& miss) const {
  constexpr double kSameBranch = 0.5;  // [rad] largest surprise, summed over the joints
  double nearest = kSameBranch + moved.lpNorm<1>();
  int best = -1;
  for (int i = 0; i < found_.size(); ++i) {
    double apart = 0.0;
    for (size_t k = 0; k < 6; ++k)
      apart += std::abs(found_.row(i)[k] - miss.q[k] - moved[static_cast<Eigen::Index>(k)]);
    if (apart >= nearest) continue;
    nearest = apart;
    best = i;
  }
  if (best >= 0) std::copy_n(found_.row(best), 6, miss.q.begin());
  return best >= 0;
}

void RollSearch::solve(const Arm& arm, const Eigen::Isometry3d& T_base_tip) {
  ++ik_calls_;
  found_.reset(6);
  arm.wider->solvePose(T_base_tip, nullptr, found_);
}

bool RollSearch::visitWithin(const Arm& arm, const Visitor& visit) {
  whole_.reset(dof_);
  std::array<double, 7> q{};
  for (int i = 0; i < found_.size(); ++i) {
    const double* row = found_.row(i);
    if (!arm.chain.withinLimits(row, 0.0)) continue;
    for (int k = 0; k < dof_; ++k) q[static_cast<size_t>(k)] = k == held_joint_ ? arm.held : *row++;
    whole_.push(q.data());
  }
  return !whole_.empty() && visit(whole_);
}

}  // namespace capability_map
