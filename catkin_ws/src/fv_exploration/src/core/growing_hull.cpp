#include "growing_hull.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <utility>

namespace fv {

std::vector<int> mixedOrder(std::size_t count) {
  std::vector<int> order(count);
  std::iota(order.begin(), order.end(), 0);
  uint32_t state = 1;
  for (std::size_t i = count; i > 1; --i) {
    state = state * 1664525u + 1013904223u;  // Numerical Recipes' generator: the same everywhere
    std::swap(order[i - 1], order[static_cast<std::size_t>(state >> 8) % i]);
  }
  return order;
}

GrowingHull::GrowingHull(const std::vector<Voxel>& vertices, const std::array<int, 4>& base)
    : vertices_(vertices), begun_(4) {
  for (int apex = 0; apex < 4; ++apex) {
    const int a = base[(apex + 1) % 4], b = base[(apex + 2) % 4], c = base[(apex + 3) % 4];
    if (height(facet(a, b, c), base[apex]) <= 0) continue;
    facets_.pop_back();
    facet(a, c, b);
  }
  connect();
}

GrowingHull::GrowingHull(const std::vector<Voxel>& vertices, const std::vector<HullTriangle>& surface)
    : vertices_(vertices), begun_(surface.size()) {
  facets_.resize(surface.size());
  for (std::size_t i = 0; i < surface.size(); ++i) facets_[i].triangle = surface[i];
  connect();
}

void GrowingHull::add(int first) {
  waits_at_.assign(vertices_.size(), kNone);
  next_.assign(vertices_.size(), kNone);
  fan_of_.assign(vertices_.size(), kNone);
  const std::vector<int> order = mixedOrder(vertices_.size() - first);
  for (const int i : order)
    for (int f = 0; f < static_cast<int>(facets_.size()); ++f)
      if (!facets_[f].gone && height(f, first + i) > 0) {
        wait(first + i, f);
        break;
      }
  for (const int i : order)
    if (waits_at_[first + i] != kNone) insert(first + i);
}

std::vector<HullTriangle> GrowingHull::triangles(std::size_t& kept) const {
  std::vector<HullTriangle> out;
  kept = 0;
  for (std::size_t f = 0; f < facets_.size(); ++f) {
    if (facets_[f].gone) continue;
    kept += f < begun_;
    out.push_back(facets_[f].triangle);
  }
  return out;
}

int GrowingHull::facet(int a, int b, int c) {
  const Eigen::Matrix<int64_t, 3, 1> from = vertices_[a].cast<int64_t>();
  const Eigen::Matrix<int64_t, 3, 1> along = vertices_[b].cast<int64_t>() - from;
  facets_.emplace_back();
  facets_.back().triangle = {{a, b, c}, along.cross(vertices_[c].cast<int64_t>() - from)};
  return static_cast<int>(facets_.size()) - 1;
}

/// Find the facets beside each other: an edge between two of them is there both ways.
void GrowingHull::connect() {
  struct Edge {
    std::pair<int, int> ends;
    int facet, side;
  };
  std::vector<Edge> edges;
  const auto less = [](const Edge& a, const Edge& b) { return a.ends < b.ends; };
  for (int f = 0; f < static_cast<int>(facets_.size()); ++f)
    for (int c = 0; c < 3; ++c) {
      const std::array<int, 3>& corners = facets_[f].triangle.corners;
      edges.push_back({{corners[c], corners[(c + 1) % 3]}, f, c});
    }
  std::sort(edges.begin(), edges.end(), less);
  for (const Edge& e : edges) {
    const auto back =
        std::lower_bound(edges.begin(), edges.end(), Edge{{e.ends.second, e.ends.first}, 0, 0}, less);
    facets_[e.facet].beside[e.side] = back->facet;
  }
}

void GrowingHull::wait(int i, int facet) {
  waits_at_[i] = facet;
  next_[i] = facets_[facet].waiting;
  facets_[facet].waiting = i;
}

void GrowingHull::insert(int i) {
  findVisible(i);
  const int first = fan(i);
  for (const int f : visible_) {
    facets_[f].gone = true;
    for (int j = facets_[f].waiting, following; j != kNone; j = following) {
      following = next_[j];
      waits_at_[j] = kNone;
      if (j == i) continue;
      for (int fresh = first; fresh < static_cast<int>(facets_.size()); ++fresh)
        if (height(fresh, j) > 0) {
          wait(j, fresh);
          break;
        }
    }
  }
}

/// The facets that a vertex lies above, which hang together, and their rim.
void GrowingHull::findVisible(int i) {
  rim_.clear();
  visible_.assign(1, waits_at_[i]);
  facets_[waits_at_[i]].seen = i;
  for (std::size_t k = 0; k < visible_.size(); ++k) {
    const Facet& at = facets_[visible_[k]];
    for (int c = 0; c < 3; ++c) {
      const int beside = at.beside[c];
      if (facets_[beside].seen == i) continue;
      if (height(beside, i) > 0) {
        facets_[beside].seen = i;
        visible_.push_back(beside);
      } else {
        rim_.push_back({at.triangle.corners[c], at.triangle.corners[(c + 1) % 3], beside});
      }
    }
  }
}

/// Facets from the rim to a vertex; returns the first of them.
int GrowingHull::fan(int i) {
  const int first = static_cast<int>(facets_.size());
  for (const RimEdge& edge : rim_) {
    const int fresh = fan_of_[edge.from] = facet(edge.from, edge.to, i);
    facets_[fresh].beside[0] = edge.beyond;
    Facet& beyond = facets_[edge.beyond];
    for (int c = 0; c < 3; ++c)
      if (beyond.triangle.corners[c] == edge.to) beyond.beside[c] = fresh;
  }
  for (int fresh = first; fresh < static_cast<int>(facets_.size()); ++fresh) {
    const int next = fan_of_[facets_[fresh].triangle.corners[1]];
    facets_[fresh].beside[1] = next;
    facets_[next].beside[2] = fresh;
  }
  return first;
}

}  // namespace fv
