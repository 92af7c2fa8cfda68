#include "path_shortcut.h"

#include <algorithm>
#include <random>

namespace ompl_planner {
namespace {

constexpr double kEqualRad = 1e-6;

/// A place on a polyline: after waypoint `segment`, at p.
struct Place {
  std::size_t segment;
  JointVector q;
};

Place placeAt(const JointPath& path, double distance) {
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const double length = (path[i + 1] - path[i]).norm();
    if (distance <= length || i + 2 == path.size()) {
      return {i, path[i] + (path[i + 1] - path[i]) * std::min(1.0, distance / length)};
    }
    distance -= length;
  }
  return {0, path.front()};
}

/// From each kept waypoint straight to the furthest one that can be reached so.
JointPath greedy(const JointPath& path, const EdgeTest& edge_valid, const std::function<bool()>& stop) {
  JointPath result{path.front()};
  std::size_t at = 0;
  while (at + 1 < path.size()) {
    std::size_t next = path.size() - 1;
    while (next > at + 1 && (stop() || !edge_valid(path[at], path[next]))) --next;
    result.push_back(path[next]);
    at = next;
  }
  return result;
}

JointPath replaced(const JointPath& path, const Place& from, const Place& to) {
  JointPath result(path.begin(), path.begin() + static_cast<std::ptrdiff_t>(from.segment) + 1);
  result.push_back(from.q);
  result.push_back(to.q);
  result.insert(result.end(), path.begin() + static_cast<std::ptrdiff_t>(to.segment) + 1, path.end());
  return withoutRepeats(result);
}

}  // namespace

JointPath withoutRepeats(const JointPath& path) {
  JointPath result;
  for (const JointVector& q : path) {
    if (result.empty() || maxJointStep(result.back(), q) > kEqualRad) result.push_back(q);
  }
  // the ends must stay exactly: when the last was dropped, it replaces the one it repeats
  if (result.size() > 1) result.back() = path.back();
  return result;
}

JointPath shortcut(const JointPath& input, const EdgeTest& edge_valid, int rounds, std::uint32_t seed,
                   const std::function<bool()>& stop) {
  JointPath path = withoutRepeats(input);
  if (path.size() < 3) return path;
  path = greedy(path, edge_valid, stop);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int round = 0; round < rounds && path.size() > 2 && !stop(); ++round) {
    const double length = pathLength(path);
    double a = unit(random) * length;
    double b = unit(random) * length;
    if (a > b) std::swap(a, b);
    const Place from = placeAt(path, a);
    const Place to = placeAt(path, b);
    if (from.segment == to.segment || maxJointStep(from.q, to.q) < kEqualRad) continue;
    if (edge_valid(from.q, to.q)) path = replaced(path, from, to);
  }
  return path;
}

}  // namespace ompl_planner
