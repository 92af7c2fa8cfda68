#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <string>
#include <vector>

#include "fv_robot_model/ik/serial_chain.h"

namespace fv_robot_model::ik {

/// Settings of every solver; each solver uses those that concern it.
struct IkOptions {
  double position_tolerance_m{1e-6};    ///< Every returned solution reproduces the pose to this by FK [m].
  double angle_tolerance_rad{1e-6};     ///< The same for the rotation [rad].
  double limit_tolerance_rad{1e-9};     ///< A joint this far outside its limits counts as on the limit [rad].
  double sweep_step_rad{0.0872664626};  ///< Step of a redundant joint or of the arm angle [rad] (5 degrees).
  int sweep_refinements{2};  ///< One redundant joint: so often its step is quartered where nothing was found.
  double direction_tolerance_rad{
      0.0};                       ///< Arms with fewer than 6 joints: how far the tip's z may miss [rad].
  int numerical_starts{40};       ///< Numerical: starts per pose.
  int numerical_iterations{150};  ///< Numerical: iterations per start.
  unsigned numerical_seed{1};     ///< Numerical: which starts; equal seeds give equal answers.
};

/// Solutions of one pose, a reusable buffer: size() rows of dof values.
class IkSolutions {
 public:
  explicit IkSolutions(int dof = 0) : dof_(dof) {}
  void reset(int dof) {
    dof_ = dof;
    values_.clear();
  }
  int dof() const { return dof_; }
  int size() const { return dof_ == 0 ? 0 : static_cast<int>(values_.size()) / dof_; }
  bool empty() const { return values_.empty(); }
  const double* row(int i) const { return values_.data() + static_cast<ptrdiff_t>(i) * dof_; }
  double* row(int i) { return values_.data() + static_cast<ptrdiff_t>(i) * dof_; }
  void push(const double* q) { values_.insert(values_.end(), q, q + dof_); }
  void resize(int rows) { values_.resize(static_cast<size_t>(rows) * static_cast<size_t>(dof_)); }

 private:
  int dof_;
  std::vector<double> values_;
};

/// Solutions of N poses: those of pose i are rows offsets[i] to offsets[i + 1] of joints.
struct IkBatch {
  std::vector<int64_t> offsets;  ///< N + 1, ascending, starts with 0.
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> joints;  ///< (total, dof) [rad or m]
};

/// All inverse kinematic solutions of a chain. Stateless: one object serves many threads.
class IkSolver {
 public:
  IkSolver(SerialChain chain, const IkOptions& options);
  virtual ~IkSolver() = default;
  IkSolver(const IkSolver&) = delete;
  IkSolver& operator=(const IkSolver&) = delete;

  /// Solutions for many tip poses in the chain's base frame; deterministic.
  /// @param seeds Empty, or one configuration per pose (N, dof): its solutions come nearest first, and
  /// numerical
  ///              solvers start there. Closed forms list the same solutions with and without a seed.
  /// @throws std::invalid_argument for a pose that is not finite or whose rotation is none (the index is
  /// named),
  ///         and for seeds of another shape.
  IkBatch solve(const std::vector<Eigen::Isometry3d>& poses, const Eigen::MatrixXd& seeds = {}) const;

  /// Solutions of one pose, appended to out (which is not cleared). The pose is trusted to be a rigid motion.
  /// Joints that may turn by more than 2 pi are listed once, as near to the middle of their range as can be.
  /// @param seed nullptr or dof() values.
  virtual void solvePose(const Eigen::Isometry3d& T_base_tip, const double* seed, IkSolutions& out) const = 0;

  /// Short family name, stored with what was computed by it, e.g. "spherical-shoulder-6R".
  virtual std::string family() const = 0;
  /// What was chosen and why, one sentence.
  virtual std::string name() const = 0;
  /// True when a pose that the chain can hold is never missed (no sampling, no iteration from starts).
  virtual bool exact() const = 0;
  /// True when all joints are iterated on from starts, false for closed forms and sweeps over them.
  virtual bool numerical() const { return false; }

  const SerialChain& chain() const { return chain_; }
  const IkOptions& options() const { return options_; }

 protected:
  /// Bring q to the pose by Newton steps when it is close, check limits and residual, then append it.
  /// @return whether it was appended.
  bool accept(const Eigen::Isometry3d& T_base_tip, double* q, IkSolutions& out) const;

  SerialChain chain_;
  IkOptions options_;
};

/// The best solver for a chain: closed forms where its axes allow them, else KDL with several starts.
/// - 6R whose three last or three first axes meet: closed form;
/// - 7R shoulder-elbow-wrist: closed form over the arm angle with exact feasible intervals;
/// - 7R (or 8R) that becomes such a 6R when one (or two) joints are held: sweep over those joints;
/// - 5R with three parallel middle axes (youBot): closed form;
/// - everything else (prismatic joints too) of fewer than six joints, with mimic joints, or with tolerances
///   above 1e-5: the least miss within the tolerances;
/// - the rest: KDL.
std::unique_ptr<IkSolver> makeIkSolver(const SerialChain& chain, const IkOptions& options = {});

/// The joint of a 7R chain that, when held, leaves a 6R with a closed form; -1 when there is none.
int jointToHold(const SerialChain& chain);

/// The numerical solver alone, as reference.
std::unique_ptr<IkSolver> makeNumericalIkSolver(const SerialChain& chain, const IkOptions& options = {});

/// Brings an angle into [lower, upper] by whole turns, the copy nearest the middle of the range.
/// @return false when no copy fits; then the angle is unspecified.
bool fitToLimits(double& angle, double lower, double upper, double tolerance);

}  // namespace fv_robot_model::ik
