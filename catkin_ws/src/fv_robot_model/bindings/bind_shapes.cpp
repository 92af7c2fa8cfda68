#include "bindings.h"
#include "triangle_mesh.h"

namespace fv_robot_model {
namespace {

namespace py = pybind11;

Eigen::Isometry3d poseOrIdentity(const py::object& T) {
  return T.is_none() ? Eigen::Isometry3d::Identity() : isometryFromArray(T.cast<Array>(), "T_link_shape");
}

Eigen::VectorXd signedDistances(const Shape& shape, const Eigen::Ref<const Points>& points) {
  const py::gil_scoped_release release;
  Eigen::VectorXd distances(points.rows());
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    distances[i] = signedDistance(shape, points.row(i).transpose());
  return distances;
}

Points closestPoints(const Shape& shape, const Eigen::Ref<const Points>& points) {
  const py::gil_scoped_release release;
  Points nearest(points.rows(), 3);
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    nearest.row(i) = closestPoint(shape, points.row(i).transpose()).transpose();
  return nearest;
}

Array shapePose(const Shape& shape) {
  Array out({4, 4});
  writeMatrix(shape.T_link_shape, out.mutable_data());
  return out;
}

void defFactories(py::class_<Shape>& c) {
  c.def_static(
      "box",
      [](const Eigen::Vector3d& edges, const py::object& T) { return Shape::box(edges, poseOrIdentity(T)); },
      py::arg("edges_m"), py::arg("T_link_shape") = py::none(), "Box with full edge lengths (3,).");
  c.def_static(
      "cylinder",
      [](double radius, double length, const py::object& T) {
        return Shape::cylinder(radius, length, poseOrIdentity(T));
      },
      py::arg("radius_m"), py::arg("length_m"), py::arg("T_link_shape") = py::none(), "Cylinder along z.");
  c.def_static(
      "sphere", [](double radius, const py::object& T) { return Shape::sphere(radius, poseOrIdentity(T)); },
      py::arg("radius_m"), py::arg("T_link_shape") = py::none(), "Ball.");
  c.def_static(
      "convex_hull",
      [](const Eigen::Ref<const Points>& points, const py::object& T) {
        return Shape::convexHull(points, poseOrIdentity(T));
      },
      py::arg("points"), py::arg("T_link_shape") = py::none(),
      "Convex hull of (N, 3) points, N >= 4, not in one plane.");
}

void defGeometry(py::class_<Shape>& c) {
  c.def("signed_distance", &signedDistances, py::arg("points_shape"),
        "Distance of (N, 3) points, shape frame, to the surface [m], negative inside: (N,).");
  c.def("closest_point", &closestPoints, py::arg("points_shape"),
        "Nearest points of the solid shape to (N, 3) points, shape frame: (N, 3).");
  c.def("padded", &padded, py::arg("padding_m"), "A shape that contains all within padding_m of this one.");
  c.def("scaled", &scaled, py::arg("factor"), "Scaled about the centre of its bounding box.");
  c.def(
      "bounding_sphere",
      [](const Shape& shape) {
        const Sphere ball = boundingSphere(shape);
        return py::make_tuple(ball.center, ball.radius);
      },
      "(centre (3,), radius) of a ball that contains the shape, link frame.");
}

}  // namespace

void bindShapes(py::module_& m) {
  py::class_<Shape> c(m, "Shape", "One convex collision body of a link; a mesh is taken as its convex hull.");
  py::enum_<Shape::Kind>(c, "Kind", "Kinds of shapes.")
      .value("Box", Shape::Kind::Box)
      .value("Cylinder", Shape::Kind::Cylinder)
      .value("Sphere", Shape::Kind::Sphere)
      .value("Convex", Shape::Kind::Convex);
  c.def_readonly("kind", &Shape::kind, "Which kind.");
  c.def_readonly("dimensions", &Shape::dimensions,
                 "(3,) m. Box: edges. Cylinder: radius, length, 0. Sphere: radius, 0, 0. Convex: zeros.");
  c.def_readonly("vertices", &Shape::vertices, "Convex: (V, 3) corners, shape frame; else (0, 3).");
  c.def_readonly("faces", &Shape::faces, "Convex: (F, 3) rows of vertices, counter-clockwise from outside.");
  c.def_property_readonly("T_link_shape", &shapePose, "(4, 4): shape frame to link frame.");
  m.def(
      "load_mesh",
      [](const std::string& file, const Eigen::Vector3d& scale) {
        const TriangleMesh mesh = loadMesh(file, scale);
        return py::make_tuple(mesh.vertices, mesh.triangles);
      },
      py::arg("file"), py::arg("scale") = Eigen::Vector3d(1.0, 1.0, 1.0),
      "A mesh file as (vertices (V, 3) [m], triangles (T, 3) rows of vertices); ModelError names a bad "
      "file.");
  defFactories(c);
  defGeometry(c);
}

}  // namespace fv_robot_model
