#pragma once
#include <array>
#include <vector>

#include "fv_exploration/grid.h"

namespace fv {

/// A triangle of a hull: indices of its corners and its outward normal, exact.
struct HullTriangle {
  std::array<int, 3> corners;
  Eigen::Matrix<int64_t, 3, 1> normal;
};

/// Convex hull of voxels, as triangles with integer planes; exact.
/// @param[in,out] voxels on return only the corners.
/// @return empty when the voxels lie in one plane, or are fewer than 4.
std::vector<HullTriangle> hullTriangles(std::vector<Voxel>& voxels);

/// The voxels inside a hull: in each row along x an interval. The surface belongs to it.
struct HullRows {
  GridFrame frame;
  std::vector<int> low, high;  ///< by row: y + ny z of the frame; x as voxel; empty: low > high

  HullRows() = default;
  explicit HullRows(const GridFrame& frame);  ///< all rows empty
  std::size_t row(int y, int z) const {
    return static_cast<std::size_t>(z - frame.origin.z()) * frame.dims().y() + (y - frame.origin.y());
  }
  bool contains(const Voxel& v) const {
    const std::size_t r = row(v.y(), v.z());
    return low[r] <= v.x() && v.x() <= high[r];
  }
  bool empty() const { return triangles.empty(); }
  /// What a row was before a change.
  struct Before {
    std::size_t row;
    int low, high;
  };
  /// Take in more voxels; the hull must not be empty. As hullOfRows of all, at the cost of what is new.
  /// @return what rows were that may have changed; some more than once
  std::vector<Before> grow(const std::vector<Voxel>& added);

  std::vector<Voxel> vertices;  ///< corners of the triangles
  std::vector<HullTriangle> triangles;
};

/// First and last occupied voxel of each row of the frame; low > high: none.
struct RowExtremes {
  std::vector<int> low, high;
};

/// Rows inside the convex hull of the voxels with these row extremes.
HullRows hullOfRows(const GridFrame& frame, const RowExtremes& rows);

}  // namespace fv
