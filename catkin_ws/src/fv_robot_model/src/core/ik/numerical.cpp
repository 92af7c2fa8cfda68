// KDL's Newton-Raphson with joint limits, and a damped descent without, from several starts: for chains
// without a closed form, and the reference that the closed forms are measured against.

#include <Eigen/Cholesky>
#include <cmath>
#include <kdl/chain.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainiksolverpos_nr_jl.hpp>
#include <kdl/chainiksolvervel_pinv.hpp>
#include <kdl/chainjnttojacsolver.hpp>
#include <random>
#include <sstream>

#include "fv_robot_model/ik/ik_solver.h"
#include "solvers.h"

namespace fv_robot_model::ik {

namespace {

KDL::Vector kdlVector(const Eigen::Vector3d& v) { return KDL::Vector(v.x(), v.y(), v.z()); }

KDL::Frame kdlFrame(const Eigen::Isometry3d& T) {
  const Eigen::Matrix3d R = T.linear();
  return KDL::Frame(
      KDL::Rotation(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)),
      kdlVector(T.translation()));
}

/// Every segment's frame coincides with the base at zero; the last one carries the tip.
KDL::Chain kdlChain(const SerialChain& chain) {
  KDL::Chain kdl;
  for (const ChainJoint& joint : chain.joints()) {
    const auto type = joint.prismatic ? KDL::Joint::TransAxis : KDL::Joint::RotAxis;
    kdl.addSegment(KDL::Segment(KDL::Joint(joint.name, kdlVector(joint.point), kdlVector(joint.axis), type),
                                KDL::Frame()));
  }
  kdl.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), kdlFrame(chain.zeroPose())));
  return kdl;
}

/// Levenberg and Marquardt's method without regard to limits. KDL has one too, but it aborts in processes in
/// which another library instantiates Eigen's JacobiSVD (seen in the planning node).
/// @param q  start, and the answer when true is returned; [rad or m].
bool descend(const KDL::Chain& chain, const KDL::Frame& target, int iterations, KDL::JntArray& q) {
  constexpr double kConverged = 1e-7;  // m and rad together
  KDL::ChainFkSolverPos_recursive fk(chain);
  KDL::ChainJntToJacSolver jacobian_of(chain);
  KDL::Jacobian jacobian(q.rows());
  KDL::Frame pose;
  const auto errorAt = [&](const KDL::JntArray& at) {
    fk.JntToCart(at, pose);
    const KDL::Twist twist = KDL::diff(pose, target);
    Eigen::Matrix<double, 6, 1> error;
    error << twist.vel.x(), twist.vel.y(), twist.vel.z(), twist.rot.x(), twist.rot.y(), twist.rot.z();
    return error;
  };
  double damping = 1e-3;
  Eigen::Matrix<double, 6, 1> error = errorAt(q);
  for (int i = 0; i < iterations && error.norm() > kConverged; ++i) {
    jacobian_of.JntToJac(q, jacobian);
    Eigen::MatrixXd normal = jacobian.data.transpose() * jacobian.data;
    normal.diagonal().array() += damping;
    KDL::JntArray trial = q;
    trial.data += normal.ldlt().solve(jacobian.data.transpose() * error);
    const Eigen::Matrix<double, 6, 1> next = errorAt(trial);
    const bool better = next.norm() < error.norm();
    damping = better ? std::max(0.2 * damping, 1e-9) : 5.0 * damping;
    if (better) {
      q = trial;
      error = next;
    }
  }
  return error.norm() <= kConverged;
}

class Numerical : public IkSolver {
 public:
  Numerical(const SerialChain& chain, const IkOptions& options)
      : IkSolver(chain, options), kdl_(kdlChain(chain)), lower_(chain.dof()), upper_(chain.dof()) {
    for (int i = 0; i < chain.dof(); ++i) {
      lower_(static_cast<unsigned>(i)) = chain.joint(i).lower;
      upper_(static_cast<unsigned>(i)) = chain.joint(i).upper;
    }
  }

  bool exact() const override { return false; }
  bool numerical() const override { return true; }
  std::string family() const override { return "kdl"; }
  std::string name() const override {
    std::ostringstream text;
    text << family() << ": Newton-Raphson and Levenberg-Marquardt from " << options_.numerical_starts
         << " starts, because the chain has no closed form here";
    return text.str();
  }

  void solvePose(const Eigen::Isometry3d& T_base_tip, const double* seed, IkSolutions& out) const override {
    // KDL's solvers carry state: one set per call keeps this object shareable among threads.
    KDL::ChainFkSolverPos_recursive fk(kdl_);
    KDL::ChainIkSolverVel_pinv velocity(kdl_);
    KDL::ChainIkSolverPos_NR_JL position(kdl_, lower_, upper_, fk, velocity,
                                         static_cast<unsigned>(options_.numerical_iterations), 1e-6);
    const KDL::Frame target = kdlFrame(T_base_tip);
    const auto dof = static_cast<unsigned>(chain_.dof());
    KDL::JntArray start(dof), answer(dof);
    std::mt19937_64 random(options_.numerical_seed);
    const int first = out.size();
    for (int i = 0; i < options_.numerical_starts; ++i) {
      chooseStart(i, seed, random, start);
      answer = start;
      const bool found = i % 2 == 0 ? position.CartToJnt(start, target, answer) >= 0
                                    : descend(kdl_, target, options_.numerical_iterations, answer);
      if (!found || !answer.data.allFinite() || !fitAll(answer)) continue;
      if (isNew(answer, first, out)) accept(T_base_tip, answer.data.data(), out);
    }
  }

 private:
  void chooseStart(int i, const double* seed, std::mt19937_64& random, KDL::JntArray& start) const {
    for (unsigned k = 0; k < start.rows(); ++k) {
      const double span = upper_(k) - lower_(k);
      // 53 bits of the generator, not uniform_real_distribution: the same numbers with every standard
      // library.
      const double share = static_cast<double>(random() >> 11) * 0x1.0p-53;
      if (i == 0) {
        start(k) = seed != nullptr ? seed[k] : lower_(k) + 0.5 * span;
      } else {
        start(k) = lower_(k) + share * span;
      }
    }
  }

  bool fitAll(KDL::JntArray& q) const {
    for (int k = 0; k < chain_.dof(); ++k) {
      const ChainJoint& joint = chain_.joint(k);
      double& value = q(static_cast<unsigned>(k));
      const bool fits = joint.prismatic
                            ? value >= joint.lower && value <= joint.upper
                            : fitToLimits(value, joint.lower, joint.upper, options_.limit_tolerance_rad);
      if (!fits) return false;
    }
    return true;
  }

  bool isNew(const KDL::JntArray& q, int first, const IkSolutions& out) const {
    constexpr double kSame = 1e-3;
    for (int row = first; row < out.size(); ++row) {
      double largest = 0.0;
      for (int k = 0; k < chain_.dof(); ++k) {
        largest = std::max(largest, std::abs(out.row(row)[k] - q(static_cast<unsigned>(k))));
      }
      if (largest < kSame) return false;
    }
    return true;
  }

  KDL::Chain kdl_;
  KDL::JntArray lower_, upper_;
};

}  // namespace

std::unique_ptr<IkSolver> makeNumericalIkSolver(const SerialChain& chain, const IkOptions& options) {
  if (chain.isCoupled()) return makeTolerant(chain, options);  // KDL knows no mimic joints
  return std::make_unique<Numerical>(chain, options);
}

}  // namespace fv_robot_model::ik
