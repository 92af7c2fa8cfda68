#include <cstdio>
#include <memory>

#include "fv_robot_model/shape.h"
#include "internal.h"

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace fv_robot_model {
namespace {

/// Qhull's state with its memory; Qhull reports errors by a code and text in a file.
struct Qhull {
  Qhull() : errors(std::tmpfile()) { qh_zero(&qh, errors); }
  ~Qhull() {
    qh_freeqhull(&qh, !qh_ALL);
    int memory_left = 0;
    int total = 0;
    qh_memfreeshort(&qh, &memory_left, &total);
    if (errors != nullptr) std::fclose(errors);
  }
  Qhull(const Qhull&) = delete;
  Qhull& operator=(const Qhull&) = delete;

  qhT qh{};
  std::FILE* errors;
};

void checkPoints(const Eigen::Ref<const Points>& points) {
  if (points.rows() < 4)
    throw std::invalid_argument(text("a convex hull needs at least 4 points, got ", points.rows()));
  if (!points.allFinite())
    throw std::invalid_argument("a convex hull needs finite points, got NaN or infinity");
}

/// Compact numbering of the hull's corners by Qhull's point numbers.
std::vector<int> numberVertices(qhT& qh, const Points& points, Points& vertices) {
  std::vector<int> number(points.rows(), -1);
  vertices.resize(qh.num_vertices, 3);
  int next = 0;
  for (vertexT* vertex = qh.vertex_list; vertex != nullptr && vertex->next != nullptr;
       vertex = vertex->next) {
    const int id = qh_pointid(&qh, vertex->point);
    vertices.row(next) = points.row(id);
    number[id] = next++;
  }
  return number;
}

void readFacets(qhT& qh, const std::vector<int>& number, Shape& shape) {
  shape.faces.resize(qh.num_facets, 3);
  shape.planes.resize(qh.num_facets, 4);
  Eigen::Index row = 0;
  for (facetT* facet = qh.facet_list; facet != nullptr && facet->next != nullptr;
       facet = facet->next, ++row) {
    int corner = 0;
    for (int k = 0; k < 3; ++k) {
      auto* vertex = static_cast<vertexT*>(facet->vertices->e[k].p);
      shape.faces(row, corner++) = number[qh_pointid(&qh, vertex->point)];
    }
    const Eigen::Vector3d normal(facet->normal[0], facet->normal[1], facet->normal[2]);
    shape.planes.row(row) << normal.transpose(), facet->offset;
    if ((facet->toporient ^ qh_ORIENTclock) != 0) std::swap(shape.faces(row, 1), shape.faces(row, 2));
  }
}

}  // namespace

Shape Shape::convexHull(const Eigen::Ref<const Points>& points, const Eigen::Isometry3d& T_link_shape) {
  checkPoints(points);
  Points input = points;  // Qhull wants them writable
  Qhull hull;
  char command[] = "qhull Qt Pp";  // triangles only, no complaints about narrow hulls
  const int code = qh_new_qhull(&hull.qh, 3, static_cast<int>(input.rows()), input.data(), False, command,
                                nullptr, hull.errors);
  if (code != 0)
    throw std::invalid_argument(text("no convex hull of ", input.rows(), " points (Qhull error ", code,
                                     "): do they lie in one plane?"));
  Shape shape;
  shape.kind = Kind::Convex;
  shape.T_link_shape = T_link_shape;
  readFacets(hull.qh, numberVertices(hull.qh, input, shape.vertices), shape);
  return shape;
}

}  // namespace fv_robot_model
