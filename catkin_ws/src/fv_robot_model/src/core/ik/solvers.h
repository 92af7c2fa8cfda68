/// The solvers behind makeIkSolver. Each make... returns nullptr when the chain is not of its family.
#pragma once

#include <memory>

#include "fv_robot_model/ik/ik_solver.h"

namespace fv_robot_model::ik {

/// 6R with its last or its first three axes through one point.
std::unique_ptr<IkSolver> makeSpherical6R(const SerialChain& chain, const IkOptions& options);

/// 7R shoulder-elbow-wrist: axes 1-3 through one point, axes 5-7 through another.
std::unique_ptr<IkSolver> makeShoulderElbowWrist7R(const SerialChain& chain, const IkOptions& options);

/// 5R whose axes 2, 3 and 4 are parallel.
std::unique_ptr<IkSolver> makeParallel5R(const SerialChain& chain, const IkOptions& options);

/// 7R and 8R that become a 6R with closed form when one or two joints are held.
std::unique_ptr<IkSolver> makeJointSweep(const SerialChain& chain, const IkOptions& options);

/// Any chain: the least miss of a pose within the options' tolerances.
std::unique_ptr<IkSolver> makeTolerant(const SerialChain& chain, const IkOptions& options);

/// The point in which three lines meet, if they do to 1e-6 m.
bool commonPoint(const ChainJoint& a, const ChainJoint& b, const ChainJoint& c, Eigen::Vector3d& point);

/// True when every joint is revolute.
bool allRevolute(const SerialChain& chain);

}  // namespace fv_robot_model::ik
