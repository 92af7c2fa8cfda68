/// Shorter polylines out of found ones.
#pragma once

#include <cstdint>
#include <functional>

#include "ompl_planner/blended_path.h"

namespace ompl_planner {

using EdgeTest = std::function<bool(const JointVector&, const JointVector&)>;

/// The path without equal neighbours.
JointPath withoutRepeats(const JointPath& path);

/// Replaces stretches of the path by straight lines that pass edge_valid: first between waypoints, greedily,
/// then `rounds` times between two random points of the path. Never longer than the input; the ends stay.
/// Deterministic for a seed unless stop fires.
JointPath shortcut(const JointPath& path, const EdgeTest& edge_valid, int rounds, std::uint32_t seed,
                   const std::function<bool()>& stop);

}  // namespace ompl_planner
