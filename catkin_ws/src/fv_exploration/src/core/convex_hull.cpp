#include "convex_hull.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <climits>

#include "growing_hull.h"

namespace fv {

namespace {

using Vector3l = Eigen::Matrix<int64_t, 3, 1>;

constexpr std::size_t kManyPairs = std::size_t{1} << 22;  // of a voxel and a triangle: some milliseconds

/// Four voxels that span space; false when there are none.
bool spanning(const std::vector<Voxel>& p, std::array<int, 4>& out) {
  int found = 1;
  out = {0, 0, 0, 0};
  Vector3l along, across;
  for (int i = 1; i < static_cast<int>(p.size()) && found < 4; ++i) {
    const Vector3l d = (p[i] - p[0]).cast<int64_t>();
    bool independent = false;
    if (found == 1 && !d.isZero()) {
      along = d;
      independent = true;
    } else if (found == 2 && !along.cross(d).isZero()) {
      across = along.cross(d);
      independent = true;
    } else if (found == 3) {
      independent = across.dot(d) != 0;
    }
    if (independent) out[found++] = i;
  }
  return found == 4;
}

int64_t floorDivide(int64_t a, int64_t b) {  // b > 0
  return a >= 0 ? a / b : -((-a + b - 1) / b);
}

/// Narrow [first, last] to the y for which p lies on the inner side of the edge from a to b, at a given z.
void clipByEdge(const Voxel& a, const Voxel& b, int64_t side, int64_t z, int64_t& first, int64_t& last) {
  // side * ((b.y - a.y) (z - a.z) - (b.z - a.z) (y - a.y)) >= 0
  const int64_t slope = -side * (b.z() - a.z());
  const int64_t offset = side * (int64_t{b.y() - a.y()} * (z - a.z())) - slope * a.y();
  if (slope > 0)
    first = std::max(first, -floorDivide(offset, slope));
  else if (slope < 0)
    last = std::min(last, floorDivide(offset, -slope));
  else if (offset < 0)
    last = first - 1;
}

/// Call visit(first row, rows, y, z) for each line of a triangle's shadow on the y-z plane, its edges
/// included.
template <class Visit>
void forShadow(const HullRows& hull, const HullTriangle& triangle, const Visit& visit) {
  const Voxel& a = hull.vertices[triangle.corners[0]];
  const Voxel& b = hull.vertices[triangle.corners[1]];
  const Voxel& c = hull.vertices[triangle.corners[2]];
  if (triangle.normal.x() == 0) return;
  const Voxel low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
  const int64_t side = triangle.normal.x() > 0 ? 1 : -1;  // sense of the shadow
  for (int z = low.z(); z <= high.z(); ++z) {
    int64_t first = low.y(), last = high.y();
    clipByEdge(a, b, side, z, first, last);
    clipByEdge(b, c, side, z, first, last);
    clipByEdge(c, a, side, z, first, last);
    if (first <= last)
      visit(hull.row(static_cast<int>(first), z), static_cast<int>(last - first + 1), first, z);
  }
}

/// Cut the rows below a triangle's shadow by its plane.
void cutRows(HullRows& hull, const HullTriangle& triangle) {
  const Voxel& a = hull.vertices[triangle.corners[0]];
  const Vector3l n = triangle.normal;
  const int64_t divisor = std::abs(n.x());
  forShadow(hull, triangle, [&](std::size_t row, int count, int64_t y, int64_t z) {
    // |n.x| times the distance from a along x, which must not be above `rest`; as quotient and remainder from
    // y to y
    const int64_t rest = -(n.y() * (y - a.y()) + n.z() * (z - a.z()));
    const int64_t step = floorDivide(-n.y(), divisor), step_rest = -n.y() - step * divisor;
    int64_t reach = floorDivide(rest, divisor), left = rest - reach * divisor;
    for (int i = 0; i < count; ++i) {
      if (n.x() > 0)
        hull.high[row + i] = std::min<int64_t>(hull.high[row + i], a.x() + reach);
      else
        hull.low[row + i] = std::max<int64_t>(hull.low[row + i], a.x() - reach);
      reach += step;
      left += step_rest;
      if (left >= divisor) {
        left -= divisor;
        ++reach;
      }
    }
  });
}

/// Corners of the convex polygon around the extremes of one layer (Andrew's monotone chain), exact.
void layerCorners(const GridFrame& frame, const RowExtremes& rows, int z, std::vector<Voxel>& out) {
  std::vector<Voxel> chain[2];
  const int ny = frame.dims().y();
  for (int side = 0; side < 2; ++side)
    for (int y = 0; y < ny; ++y) {
      const std::size_t row = static_cast<std::size_t>(z) * ny + y;
      if (rows.low[row] > rows.high[row]) continue;
      const Voxel p(side ? rows.high[row] : rows.low[row], y + frame.origin.y(), z + frame.origin.z());
      std::vector<Voxel>& c = chain[side];
      const auto outside = [&] {  // the last corner is not beyond the line from the one before it to p
        const Voxel &a = c[c.size() - 2], &b = c.back();
        const int64_t turn =
            int64_t{b.x() - a.x()} * (p.y() - a.y()) - int64_t{b.y() - a.y()} * (p.x() - a.x());
        return side ? turn <= 0 : turn >= 0;
      };
      while (c.size() >= 2 && outside()) c.pop_back();
      c.push_back(p);
    }
  out.insert(out.end(), chain[0].begin(), chain[0].end());
  for (const Voxel& p : chain[1])  // a row of one voxel may be in both
    if (std::find(chain[0].begin(), chain[0].end(), p) == chain[0].end()) out.push_back(p);
}

/// The corners of the convex polygon around the voxels of each layer.
std::vector<Voxel> layeredCorners(const GridFrame& frame, const std::vector<Voxel>& voxels) {
  HullRows rows(frame);
  std::vector<uint8_t> layers(frame.dims().z(), 0);
  for (const Voxel& v : voxels) {
    const std::size_t row = rows.row(v.y(), v.z());
    rows.low[row] = std::min(rows.low[row], v.x());
    rows.high[row] = std::max(rows.high[row], v.x());
    layers[v.z() - frame.origin.z()] = 1;
  }
  const RowExtremes extremes{std::move(rows.low), std::move(rows.high)};
  std::vector<Voxel> out;
  for (int z = 0; z < frame.dims().z(); ++z)
    if (layers[z]) layerCorners(frame, extremes, z, out);
  return out;
}

/// Closed surface around voxels that span space.
/// @param base four of the vertices that span it.
std::vector<HullTriangle> surfaceAround(const std::vector<Voxel>& vertices, const std::array<int, 4>& base) {
  GrowingHull hull(vertices, base);
  hull.add(0);
  std::size_t kept;
  return hull.triangles(kept);
}

/// Vertices in which three or more planes meet; others have ceased to be corners, or never were.
std::vector<Voxel> sharpCorners(const std::vector<Voxel>& vertices,
                                const std::vector<HullTriangle>& triangles) {
  std::vector<std::array<const Vector3l*, 2>> seen(vertices.size(), {nullptr, nullptr});
  std::vector<uint8_t> sharp(vertices.size(), 0);
  const auto parallel = [](const Vector3l& a, const Vector3l& b) { return a.cross(b).isZero(); };
  for (const HullTriangle& triangle : triangles)
    for (const int corner : triangle.corners) {
      auto& [one, two] = seen[corner];
      if (!one)
        one = &triangle.normal;
      else if (parallel(*one, triangle.normal))
        continue;
      else if (!two)
        two = &triangle.normal;
      else if (!parallel(*two, triangle.normal))
        sharp[corner] = 1;
    }
  std::vector<Voxel> out;
  for (std::size_t i = 0; i < vertices.size(); ++i)
    if (sharp[i]) out.push_back(vertices[i]);
  return out;
}

}  // namespace

std::vector<HullTriangle> hullTriangles(std::vector<Voxel>& voxels) {
  std::array<int, 4> base;
  if (!spanning(voxels, base)) return {};
  voxels = sharpCorners(voxels, surfaceAround(voxels, base));
  spanning(voxels, base);
  return surfaceAround(voxels, base);
}

HullRows::HullRows(const GridFrame& f)
    : frame(f),
      low(static_cast<std::size_t>(f.dims().y()) * f.dims().z(), INT_MAX),
      high(low.size(), INT_MIN) {}

HullRows hullOfRows(const GridFrame& frame, const RowExtremes& rows) {
  HullRows hull(frame);
  for (int z = 0; z < frame.dims().z(); ++z) layerCorners(frame, rows, z, hull.vertices);
  hull.triangles = hullTriangles(hull.vertices);
  if (hull.triangles.empty()) return hull;
  std::fill(hull.low.begin(), hull.low.end(), INT_MIN);
  std::fill(hull.high.begin(), hull.high.end(), INT_MAX);
  for (const HullTriangle& triangle : hull.triangles) cutRows(hull, triangle);
  for (std::size_t i = 0; i < hull.low.size(); ++i)
    if (hull.low[i] == INT_MIN || hull.high[i] == INT_MAX) {  // no triangle above or below: not inside
      hull.low[i] = INT_MAX;
      hull.high[i] = INT_MIN;
    }
  return hull;
}

std::vector<HullRows::Before> HullRows::grow(const std::vector<Voxel>& added) {
  const std::size_t old = vertices.size();
  const std::vector<Voxel> candidates = layeredCorners(frame, added);
  vertices.insert(vertices.end(), candidates.begin(), candidates.end());
  std::array<int, 4> base;
  std::size_t kept = 0;
  if (candidates.size() * triangles.size() < kManyPairs) {
    GrowingHull hull(vertices, triangles);
    hull.add(static_cast<int>(old));
    triangles = hull.triangles(kept);
  } else {  // to look for a triangle below each would take longer than to begin anew
    spanning(vertices, base);
    triangles = surfaceAround(vertices, base);
  }
  // What old triangles say of the rows below the new ones no longer holds.
  std::vector<Before> before;
  for (std::size_t i = kept; i < triangles.size(); ++i)
    forShadow(*this, triangles[i], [&](std::size_t row, int count, int64_t, int64_t) {
      for (std::size_t r = row; r < row + count; ++r) before.push_back({r, low[r], high[r]});
    });
  for (std::size_t i = kept; i < triangles.size(); ++i)
    forShadow(*this, triangles[i], [&](std::size_t row, int count, int64_t, int64_t) {
      if (triangles[i].normal.x() > 0)
        std::fill_n(high.begin() + row, count, INT_MAX);
      else
        std::fill_n(low.begin() + row, count, INT_MIN);
    });
  for (std::size_t i = kept; i < triangles.size(); ++i) cutRows(*this, triangles[i]);
  vertices = sharpCorners(vertices, triangles);
  spanning(vertices, base);
  triangles = surfaceAround(vertices, base);
  return before;
}

}  // namespace fv
