#include "fv_robot_model/ik/pose_target.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace fv_robot_model::ik {

namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr double kRounding = 1e-6;  // [m], [rad]
constexpr double kSettled = 1e-8;   // cost, in squared tolerances, that is as good as none
constexpr double kNearlyKept =
    4.0;                          // cost above which no pose nearby keeps both tolerances; 2 would do exactly
constexpr double kInside = 0.95;  // of the tolerances is aimed at: their borders are no place to end on
constexpr double kTurn = 2.0 * M_PI;

/// The shortest rotation vector that turns unit vector a into b.
Eigen::Vector3d shortestTurn(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d cross = a.cross(b);
  const double sine = cross.norm(), cosine = a.dot(b);
  if (sine > 1e-12) return cross * (std::atan2(sine, cosine) / sine);
  return cosine > 0.0 ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : Eigen::Vector3d(M_PI * a.unitOrthogonal());
}

bool turnsAllTheWay(const ChainJoint& joint) {
  return !joint.prismatic && joint.upper - joint.lower >= kTurn - 1e-9;
}

/// The part of a vector that is longer than `slack`.
Eigen::Vector3d beyond(const Eigen::Vector3d& v, double slack) {
  const double length = v.norm();
  return length > slack ? Eigen::Vector3d(v * (1.0 - slack / length)) : Eigen::Vector3d::Zero();
}

}  // namespace

PoseMiss missOf(const PoseTarget& target, const Eigen::Isometry3d& T_base_tip) {
  const Eigen::Isometry3d T_base_tool = T_base_tip * target.T_tip_tool;
  PoseMiss miss;
  miss.translation = target.T_base_tool.translation() - T_base_tool.translation();
  if (target.free_roll) {
    miss.rotation =
        shortestTurn(T_base_tool.linear() * target.roll_axis, target.T_base_tool.linear() * target.roll_axis);
    return miss;
  }
  const Eigen::AngleAxisd turn(target.T_base_tool.linear() * T_base_tool.linear().transpose());
  miss.rotation = turn.angle() * turn.axis();
  return miss;
}

bool reaches(const PoseTarget& target, const Eigen::Isometry3d& T_base_tip) {
  const PoseMiss miss = missOf(target, T_base_tip);
  return miss.translation.norm() <= target.position_tolerance_m + kRounding &&
         miss.rotation.norm() <= target.angle_tolerance_rad + kRounding;
}

/// One descent: joint values, what they miss, and the method's damping.
struct TolerantIk::Descent {
  const TolerantIk& ik;
  const PoseTarget& target;
  Eigen::VectorXd q;
  double slack;  ///< Share of the tolerances that counts as no miss.
  Vector6 residual{Vector6::Zero()};
  double cost{0.0};
  double damping{1e-3};

  Vector6 residualAt(const Eigen::VectorXd& at) const {
    const PoseMiss miss = missOf(target, ik.chain_.forward(at.data()));
    Vector6 r;
    r << beyond(miss.translation / target.position_tolerance_m, slack),
        beyond(miss.rotation / target.angle_tolerance_rad, slack);
    return r;
  }

  void begin(double with_slack) {
    slack = with_slack;
    damping = 1e-3;
    residual = residualAt(q);
    cost = residual.squaredNorm();
  }

  /// Derivative of what has been gone towards the target, in units of the tolerances; (6, dof).
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian() const {
    auto J = ik.chain_.jacobian(q.data());
    const Eigen::Isometry3d T_base_tip = ik.chain_.forward(q.data());
    const Eigen::Vector3d lever = T_base_tip.linear() * target.T_tip_tool.translation();
    for (Eigen::Index k = 0; k < J.cols(); ++k) {
      const Eigen::Vector3d turning = J.col(k).tail<3>();
      J.col(k).head<3>() += turning.cross(lever);
    }
    if (target.free_roll) {
      const Eigen::Vector3d axis = T_base_tip.linear() * (target.T_tip_tool.linear() * target.roll_axis);
      const Eigen::RowVectorXd rolling = axis.transpose() * J.bottomRows<3>();
      J.bottomRows<3>() -= axis * rolling;
    }
    J.topRows<3>() /= target.position_tolerance_m;
    J.bottomRows<3>() /= target.angle_tolerance_rad;
    return J;
  }

  /// Joints that a limit keeps from going where the gradient wants them do not take part in the step.
  Eigen::VectorXd step(const Eigen::Matrix<double, 6, Eigen::Dynamic>& J) const {
    Eigen::VectorXd gradient = J.transpose() * residual;
    Eigen::MatrixXd normal = J.transpose() * J;
    const double least = 1e-9 * std::max(normal.diagonal().maxCoeff(), 1e-12);
    for (Eigen::Index k = 0; k < q.size(); ++k) {
      const bool held = gradient[k] < 0.0 ? q[k] <= ik.lower_[k] : q[k] >= ik.upper_[k];
      normal(k, k) += damping * normal(k, k) + least;
      if (!held) continue;
      gradient[k] = 0.0;
      normal.row(k).setZero();
      normal.col(k).setZero();
      normal(k, k) = 1.0;
    }
    return normal.ldlt().solve(gradient);
  }

  /// Until nothing is missed, or nothing gets better.
  void run() {
    constexpr double kWorstDamping = 1e8;
    for (int i = 0; i < ik.iterations_ && cost > kSettled && damping < kWorstDamping; ++i) {
      const auto J = jacobian();
      while (damping < kWorstDamping) {
        const Eigen::VectorXd trial = (q + step(J)).cwiseMax(ik.lower_).cwiseMin(ik.upper_);
        const Vector6 next = residualAt(trial);
        const double gained = cost - next.squaredNorm();
        if (!(gained > 0.0)) {
          damping *= 8.0;
          continue;
        }
        const bool settled = gained < 1e-9 * cost;
        q = trial;
        residual = next;
        cost -= gained;
        damping = settled ? kWorstDamping : std::max(0.1 * damping, 1e-9);
        break;
      }
    }
  }
};

TolerantIk::TolerantIk(SerialChain chain, int iterations)
    : chain_(std::move(chain)), iterations_(iterations), lower_(chain_.dof()), upper_(chain_.dof()) {
  if (iterations <= 0) {
    throw std::invalid_argument("inverse kinematics: iterations is " + std::to_string(iterations) +
                                ", must be positive");
  }
  constexpr double kFar = std::numeric_limits<double>::infinity();
  for (int k = 0; k < chain_.dof(); ++k) {
    const ChainJoint& joint = chain_.joint(k);
    const bool endless = !chain_.isCoupled() && turnsAllTheWay(joint);  // mimics turn by other angles
    lower_[k] = endless ? -kFar : joint.lower;
    upper_[k] = endless ? kFar : joint.upper;
  }
}

bool TolerantIk::descend(const PoseTarget& target, double* q) const {
  Eigen::Map<Eigen::VectorXd> values(q, chain_.dof());
  Descent descent{*this, target, values.cwiseMax(lower_).cwiseMin(upper_), 0.0};
  descent.begin(0.0);
  descent.run();
  if (!reaches(target, chain_.forward(descent.q.data()))) {
    if (descent.cost > kNearlyKept) return false;
    descent.begin(kInside);
    descent.run();
  }
  values = descent.q;
  return fit(q) && reaches(target, chain_.forward(q));
}

void TolerantIk::solve(const PoseTarget& target, const double* seed, int first, int count,
                       IkSolutions& out) const {
  constexpr double kSame = 1e-3;
  const auto dof = static_cast<std::size_t>(chain_.dof());
  std::vector<double> q(dof);
  for (int i = 0; i < count; ++i) {
    if (i == 0 && seed != nullptr) {
      std::copy_n(seed, dof, q.begin());
    } else {
      start(first + i, q.data());
    }
    if (!descend(target, q.data())) continue;
    bool is_new = true;
    for (int row = 0; row < out.size() && is_new; ++row) {
      double largest = 0.0;
      for (std::size_t k = 0; k < dof; ++k) largest = std::max(largest, std::abs(out.row(row)[k] - q[k]));
      is_new = largest > kSame;
    }
    if (is_new) out.push(q.data());
  }
}

/// Roberts's additive recurrence: multiples of powers of 1/g modulo 1, where g^(dof + 1) = g + 1.
void TolerantIk::start(int index, double* q) const {
  double g = 2.0;
  for (int i = 0; i < 30; ++i) g = std::pow(1.0 + g, 1.0 / (chain_.dof() + 1));
  double power = 1.0;
  for (int k = 0; k < chain_.dof(); ++k) {
    power /= g;
    const double whole = 0.5 + power * index;
    const ChainJoint& joint = chain_.joint(k);
    q[k] = joint.lower + (whole - std::floor(whole)) * (joint.upper - joint.lower);
  }
}

/// Whole turns back into the range.
bool TolerantIk::fit(double* q) const {
  for (int k = 0; k < chain_.dof(); ++k) {
    const ChainJoint& joint = chain_.joint(k);
    if (!std::isfinite(q[k])) return false;
    if (std::isfinite(lower_[k])) continue;  // kept within its limits all the way
    fitToLimits(q[k], joint.lower, joint.upper, 1e-9);
    q[k] = std::clamp(q[k], joint.lower, joint.upper);
  }
  return true;
}

}  // namespace fv_robot_model::ik
