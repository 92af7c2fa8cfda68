#include "fv_robot_model/ik/ik_solver.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "solvers.h"

namespace fv_robot_model::ik {

namespace {

void checkPose(const Eigen::Isometry3d& T, size_t index) {
  const bool rotation = T.matrix().allFinite() &&
                        (T.linear() * T.linear().transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-6 &&
                        T.linear().determinant() > 0.0;
  if (!rotation) {
    throw std::invalid_argument("pose " + std::to_string(index) +
                                " is no rigid motion: its matrix must be finite, its rotation orthonormal");
  }
}

/// Error twist of the tip, base frame: (position [m], rotation vector [rad]), both to first order.
Eigen::Matrix<double, 6, 1> poseError(const Eigen::Isometry3d& target, const Eigen::Isometry3d& actual) {
  const Eigen::Matrix3d R = target.linear() * actual.linear().transpose();
  Eigen::Matrix<double, 6, 1> error;
  error.head<3>() = target.translation() - actual.translation();
  error.tail<3>() = 0.5 * Eigen::Vector3d(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
  // The sine hides half turns: there the trace tells.
  if (R.trace() < 1.0) error.tail<3>().setConstant(M_PI);
  return error;
}

/// Rows first to end of out, nearest to the seed first; equal distances keep their order.
void sortBySeed(const double* seed, int first, IkSolutions& out) {
  const int dof = out.dof();
  std::vector<int> order(static_cast<size_t>(out.size() - first));
  std::iota(order.begin(), order.end(), first);
  const auto distance = [&](int row) {
    double sum = 0.0;
    for (int k = 0; k < dof; ++k) sum += (out.row(row)[k] - seed[k]) * (out.row(row)[k] - seed[k]);
    return sum;
  };
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return distance(a) < distance(b); });
  const IkSolutions copy = out;
  for (size_t i = 0; i < order.size(); ++i) {
    std::copy_n(copy.row(order[i]), dof, out.row(first + static_cast<int>(i)));
  }
}

}  // namespace

bool fitToLimits(double& angle, double lower, double upper, double tolerance) {
  constexpr double kTurn = 2.0 * M_PI;
  if (upper - lower >= kTurn) {  // every angle fits: the copy nearest the middle
    angle -= kTurn * std::round((angle - 0.5 * (lower + upper)) / kTurn);
    return true;
  }
  if (angle < lower - tolerance) {
    angle += kTurn * std::ceil((lower - tolerance - angle) / kTurn);
  } else if (angle > upper + tolerance) {
    angle -= kTurn * std::ceil((angle - upper - tolerance) / kTurn);
  }
  if (!(angle >= lower - tolerance && angle <= upper + tolerance)) return false;
  angle = std::clamp(angle, lower, upper);
  return true;
}

IkSolver::IkSolver(SerialChain chain, const IkOptions& options)
    : chain_(std::move(chain)), options_(options) {
  const bool positive = options.position_tolerance_m > 0.0 && options.angle_tolerance_rad > 0.0 &&
                        options.sweep_step_rad > 0.0 && options.numerical_starts > 0 &&
                        options.numerical_iterations > 0 && options.limit_tolerance_rad >= 0.0 &&
                        options.direction_tolerance_rad >= 0.0 && options.sweep_refinements >= 0;
  if (!positive) {
    throw std::invalid_argument("inverse kinematics options: tolerances, steps and counts must be positive");
  }
}

bool IkSolver::accept(const Eigen::Isometry3d& T_base_tip, double* q, IkSolutions& out) const {
  constexpr int kNewtonSteps = 8;
  constexpr double kGood = 1e-9;   // no step needed
  constexpr double kClose = 1e-2;  // beyond it the candidate is none
  double last = 0.0;
  for (int step = 0; step <= kNewtonSteps; ++step) {
    const Eigen::Matrix<double, 6, 1> error = poseError(T_base_tip, chain_.forward(q));
    last = error.norm();
    if (last < kGood || step == kNewtonSteps) {
      if (error.head<3>().norm() > options_.position_tolerance_m) return false;
      if (error.tail<3>().norm() > options_.angle_tolerance_rad) return false;
      break;
    }
    if (last > kClose) return false;
    const auto J = chain_.jacobian(q);
    const Eigen::Matrix<double, 6, 6> damped =
        J * J.transpose() + 1e-12 * Eigen::Matrix<double, 6, 6>::Identity();
    const Eigen::VectorXd correction = J.transpose() * damped.ldlt().solve(error);
    for (int k = 0; k < chain_.dof(); ++k) {
      q[k] = std::clamp(q[k] + correction[k], chain_.joint(k).lower, chain_.joint(k).upper);
    }
  }
  out.push(q);
  return true;
}

IkBatch IkSolver::solve(const std::vector<Eigen::Isometry3d>& poses, const Eigen::MatrixXd& seeds) const {
  const bool seeded = seeds.size() > 0;
  if (seeded && (seeds.rows() != static_cast<Eigen::Index>(poses.size()) || seeds.cols() != chain_.dof())) {
    throw std::invalid_argument("seeds must be (" + std::to_string(poses.size()) + ", " +
                                std::to_string(chain_.dof()) + "), they are (" +
                                std::to_string(seeds.rows()) + ", " + std::to_string(seeds.cols()) + ")");
  }
  IkBatch batch;
  batch.offsets.reserve(poses.size() + 1);
  batch.offsets.push_back(0);
  IkSolutions all(chain_.dof());
  Eigen::VectorXd seed;
  for (size_t i = 0; i < poses.size(); ++i) {
    checkPose(poses[i], i);
    const int first = all.size();
    if (seeded) seed = seeds.row(static_cast<Eigen::Index>(i));
    solvePose(poses[i], seeded ? seed.data() : nullptr, all);
    if (seeded && all.size() - first > 1) sortBySeed(seed.data(), first, all);
    batch.offsets.push_back(all.size());
  }
  batch.joints = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      all.row(0), all.size(), chain_.dof());
  return batch;
}

std::unique_ptr<IkSolver> makeIkSolver(const SerialChain& chain, const IkOptions& options) {
  if (!chain.isCoupled()) {  // no closed form knows mimic joints
    for (const auto make : {makeSpherical6R, makeShoulderElbowWrist7R, makeParallel5R, makeJointSweep}) {
      if (auto solver = make(chain, options)) return solver;
    }
  }
  // To reach a pose exactly is KDL's task; to reach it within tolerances, and by few joints, is not.
  constexpr double kExact = 1e-5;  // m and rad
  const bool loose = std::max(options.position_tolerance_m, options.angle_tolerance_rad) > kExact;
  return chain.dof() < 6 || loose ? makeTolerant(chain, options) : makeNumericalIkSolver(chain, options);
}

}  // namespace fv_robot_model::ik
