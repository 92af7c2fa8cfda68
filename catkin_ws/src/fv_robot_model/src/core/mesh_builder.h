/// What the readers of mesh formats share: words and numbers of a text, and a mesh that grows.
#pragma once

#include <Eigen/Core>
#include <charconv>
#include <string_view>
#include <vector>

#include "internal.h"
#include "triangle_mesh.h"

namespace fv_robot_model {

/// The words of a text, one after the other.
class Words {
 public:
  explicit Words(std::string_view text) : rest_(text) {}

  /// The next word; empty at the end.
  std::string_view next() {
    constexpr std::string_view kBlank = " \t\r\n\f\v";
    const std::size_t begin = rest_.find_first_not_of(kBlank);
    rest_.remove_prefix(begin == std::string_view::npos ? rest_.size() : begin);
    const std::string_view word = rest_.substr(0, rest_.find_first_of(kBlank));
    rest_.remove_prefix(word.size());
    return word;
  }

 private:
  std::string_view rest_;
};

/// A word as a whole or other number. @param what it is, for the error. @throws ModelError unless it is one,
/// and nothing else.
template <typename Number>
Number numberOf(std::string_view word, const char* what) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  Number value{};
  const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (word.empty()) throw ModelError(text("ends where ", what, " should follow"));
  if (end != word.data() + word.size() || problem != std::errc())
    throw ModelError(text("'", word.substr(0, 40), "' is no ", what));
  return value;
}

/// Three numbers in a row.
inline Eigen::Vector3d pointOf(Words& words) {
  Eigen::Vector3d point;
  for (int i = 0; i < 3; ++i) point[i] = numberOf<double>(words.next(), "coordinate");
  return point;
}

/// Triangles with corners of their own.
class MeshBuilder {
 public:
  /// A convex polygon as a fan; fewer than three corners are none.
  void add(const std::vector<Eigen::Vector3d>& corners) {
    for (std::size_t k = 2; k < corners.size(); ++k) addTriangle(corners[0], corners[k - 1], corners[k]);
  }
  void addTriangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
    if (corners_.size() >= kMostCorners)
      throw ModelError(text("has more than ", kMostCorners / 3, " triangles"));
    corners_.insert(corners_.end(), {a, b, c});
  }

  TriangleMesh take() const {
    TriangleMesh mesh{pointsOf(corners_), {static_cast<Eigen::Index>(corners_.size() / 3), 3}};
    for (Eigen::Index i = 0; i < mesh.triangles.size(); ++i) mesh.triangles.data()[i] = static_cast<int>(i);
    return mesh;
  }

  static Points pointsOf(const std::vector<Eigen::Vector3d>& list) {
    Points points(static_cast<Eigen::Index>(list.size()), 3);
    for (std::size_t i = 0; i < list.size(); ++i) points.row(static_cast<Eigen::Index>(i)) = list[i];
    return points;
  }

 private:
  static constexpr std::size_t kMostCorners = 30'000'000;

  std::vector<Eigen::Vector3d> corners_;
};

}  // namespace fv_robot_model
