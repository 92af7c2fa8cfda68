#include "fv_exploration/convex_hull.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <climits>
#include <cstdio>

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace fv {

namespace {

using Vector3l = Eigen::Matrix<int64_t, 3, 1>;

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

/// A Qhull run; frees what it holds.
class QhullRun {
 public:
  explicit QhullRun(const std::vector<Voxel>& voxels) {
    for (const Voxel& v : voxels)
      for (int axis = 0; axis < 3; ++axis) coordinates_.push_back(v[axis]);
    errors_ = std::fopen("/dev/null", "w");
    qh_zero(&qh_, errors_);
    char command[] = "qhull Qt";
    ok_ = qh_new_qhull(&qh_, 3, static_cast<int>(voxels.size()), coordinates_.data(), False, command, nullptr,
                       errors_) == 0;
  }
  ~QhullRun() {
    qh_freeqhull(&qh_, !qh_ALL);
    int current, total;
    qh_memfreeshort(&qh_, &current, &total);
    if (errors_) std::fclose(errors_);
  }
  QhullRun(const QhullRun&) = delete;
  QhullRun& operator=(const QhullRun&) = delete;

  std::vector<std::array<int, 3>> triangles() {
    std::vector<std::array<int, 3>> out;
    if (!ok_) return out;
    qhT* qh = &qh_;  // the name that Qhull's macros expect
    facetT* facet;
    vertexT *vertex, **vertexp;
    FORALLfacets {
      std::array<int, 3> corners{};
      int i = 0;
      FOREACHvertex_(facet->vertices) {
        if (i < 3) corners[i] = qh_pointid(qh, vertex->point);
        ++i;
      }
      if (i == 3) out.push_back(corners);
    }
    return out;
  }

 private:
  qhT qh_;
  std::vector<coordT> coordinates_;
  FILE* errors_;
  bool ok_;
};

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

/// The corners of a triangle, the same in every hull that has it.
std::array<uint64_t, 3> triangleId(const HullRows& hull, const HullTriangle& triangle) {
  std::array<uint64_t, 3> id;
  for (int i = 0; i < 3; ++i) id[i] = voxelId(hull.vertices[triangle.corners[i]]);
  std::sort(id.begin(), id.end());
  return id;
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

}  // namespace

std::vector<HullTriangle> hullTriangles(const std::vector<Voxel>& voxels) {
  std::array<int, 4> base;
  if (!spanning(voxels, base)) return {};
  Vector3l inside4 = Vector3l::Zero();  // four times a point inside
  for (const int i : base) inside4 += voxels[i].cast<int64_t>();
  std::vector<HullTriangle> out;
  for (std::array<int, 3> corners : QhullRun(voxels).triangles()) {
    const Vector3l a = voxels[corners[0]].cast<int64_t>();
    Vector3l normal = (voxels[corners[1]].cast<int64_t>() - a).cross(voxels[corners[2]].cast<int64_t>() - a);
    if (normal.isZero()) continue;  // three points of one line, from triangulating a flat facet
    if (normal.dot(inside4 - 4 * a) > 0) {
      std::swap(corners[1], corners[2]);
      normal = -normal;
    }
    out.push_back({corners, normal});
  }
  return out;
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

HullRows grownHull(const HullRows& hull, const std::vector<Voxel>& added) {
  HullRows next = hull;
  next.vertices = layeredCorners(hull.frame, added);
  std::vector<std::array<uint64_t, 3>> kept;
  for (const HullTriangle& triangle : hull.triangles) {
    kept.push_back(triangleId(hull, triangle));
    for (const int corner : triangle.corners) next.vertices.push_back(hull.vertices[corner]);
  }
  const auto less = [](const Voxel& a, const Voxel& b) { return voxelId(a) < voxelId(b); };
  std::sort(next.vertices.begin(), next.vertices.end(), less);
  next.vertices.erase(std::unique(next.vertices.begin(), next.vertices.end()), next.vertices.end());
  next.triangles = hullTriangles(next.vertices);
  std::sort(kept.begin(), kept.end());
  std::vector<HullTriangle> fresh;
  for (const HullTriangle& triangle : next.triangles)
    if (!std::binary_search(kept.begin(), kept.end(), triangleId(next, triangle))) fresh.push_back(triangle);
  for (const HullTriangle& triangle : fresh)  // what old triangles say of these rows no longer holds
    forShadow(next, triangle, [&](std::size_t row, int count, int64_t, int64_t) {
      if (triangle.normal.x() > 0)
        std::fill_n(next.high.begin() + row, count, INT_MAX);
      else
        std::fill_n(next.low.begin() + row, count, INT_MIN);
    });
  for (const HullTriangle& triangle : fresh) cutRows(next, triangle);
  return next;
}

}  // namespace fv
