#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "convex_hull.h"

namespace fv {

/// Closed surface of triangles around voxels that grows with each voxel outside (beneath-beyond), exact.
///
/// Each voxel that is still to come waits with one triangle that it lies above; when that goes, it moves to
/// one of those that come in its place, or is inside (Barber, Dobkin, Huhdanpaa 1996). In an order without
/// system that makes n log n steps. Triangles that a new voxel lies above are replaced by a fan of others
/// between it and their rim. One in whose plane it lies stays: the rim is the same as for a voxel a little
/// further inside, a single ring.
class GrowingHull {
 public:
  /// Begin with a tetrahedron of four of the vertices, which span space. @param vertices must outlive it.
  GrowingHull(const std::vector<Voxel>& vertices, const std::array<int, 4>& base);
  /// Begin with a closed surface.
  GrowingHull(const std::vector<Voxel>& vertices, const std::vector<HullTriangle>& surface);

  /// Take in vertices, `first` and all after it.
  void add(int first);

  /// The surface, first what is left of the one it began with. @param[out] kept how many these are.
  std::vector<HullTriangle> triangles(std::size_t& kept) const;

 private:
  static constexpr int kNone = -1;
  struct Facet {
    HullTriangle triangle;
    std::array<int, 3> beside{kNone, kNone, kNone};  // facets beyond the edges from corner c to c + 1
    int waiting = kNone;                             // first of a list of vertices
    int seen = kNone;                                // vertex for which it was last found to be visible
    bool gone = false;
  };
  struct RimEdge {
    int from, to, beyond;  // corners, and the facet that stays
  };

  int facet(int a, int b, int c);
  void connect();
  void wait(int i, int facet);
  void insert(int i);
  void findVisible(int i);
  int fan(int i);
  /// Above the plane of a facet: positive.
  int64_t height(int facet, int i) const {
    const HullTriangle& t = facets_[facet].triangle;
    return t.normal.dot((vertices_[i] - vertices_[t.corners[0]]).cast<int64_t>());
  }

  const std::vector<Voxel>& vertices_;
  std::vector<Facet> facets_;
  std::size_t begun_;          // facets that it began with
  std::vector<int> waits_at_;  // by vertex: a facet that it lies above
  std::vector<int> next_;      // by vertex: the next that waits with the same facet
  std::vector<int> fan_of_;    // by corner of the rim: the new facet at the edge from it
  std::vector<int> visible_;   // of insert
  std::vector<RimEdge> rim_;
};

/// 0..count-1 in an order without system: the first few span most of a hull, the others change little.
std::vector<int> mixedOrder(std::size_t count);

}  // namespace fv
