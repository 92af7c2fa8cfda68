#include "capability_map/direction_lookup.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace capability_map {

namespace {

constexpr int kSide = 64;  // texels along each edge of the octahedral square

double angleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// The unit vector of a point of the octahedral square [-1, 1]^2.
Eigen::Vector3d fromSquare(double u, double v) {
  Eigen::Vector3d d(u, v, 1.0 - std::abs(u) - std::abs(v));
  if (d.z() < 0.0) {  // the lower half is folded over the diagonals
    d.x() = (1.0 - std::abs(v)) * (u < 0.0 ? -1.0 : 1.0);
    d.y() = (1.0 - std::abs(u)) * (v < 0.0 ? -1.0 : 1.0);
  }
  return d.normalized();
}

int squareIndex(double u) { return std::clamp(static_cast<int>((u + 1.0) * (0.5 * kSide)), 0, kSide - 1); }

}  // namespace

DirectionLookup::DirectionLookup(const Points& directions,
                                 const Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor>& triangles) {
  for (Eigen::Index i = 0; i < directions.rows(); ++i) {
    if (!(std::abs(directions.row(i).norm() - 1.0) < 1e-6)) {
      throw std::invalid_argument("direction " + std::to_string(i) + " is no unit vector");
    }
    directions_.push_back(directions.row(i).transpose().normalized());
  }
  Eigen::MatrixX4d caps(triangles.rows(), 4);  // circumscribed cap: axis and opening angle
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    Eigen::Matrix3d corners;
    for (int k = 0; k < 3; ++k) {
      const int corner = triangles(t, k);
      if (corner < 0 || corner >= directions.rows()) {
        throw std::invalid_argument("triangle " + std::to_string(t) + " names direction " +
                                    std::to_string(corner));
      }
      corners.col(k) = directions_[static_cast<size_t>(corner)];
    }
    if (std::abs(corners.determinant()) < 1e-12) {
      throw std::invalid_argument("triangle " + std::to_string(t) + " lies in a plane through the center");
    }
    triangles_.push_back({triangles(t, 0), triangles(t, 1), triangles(t, 2)});
    to_weights_.push_back(corners.inverse());
    Eigen::Vector3d axis =
        (corners.col(1) - corners.col(0)).cross(corners.col(2) - corners.col(0)).normalized();
    if (axis.dot(corners.col(0)) < 0.0) axis = -axis;
    caps.row(t) << axis.transpose(), angleBetween(axis, corners.col(0));
  }
  near_.start.push_back(0);
  around_.start.push_back(0);
  for (int texel = 0; texel < kSide * kSide; ++texel) listTexel(texel, caps);
}

void DirectionLookup::listTexel(int texel, const Eigen::MatrixX4d& caps) {
  const double step = 2.0 / kSide;
  const double u = -1.0 + step * (texel / kSide);
  const double v = -1.0 + step * (texel % kSide);
  const Eigen::Vector3d middle = fromSquare(u + 0.5 * step, v + 0.5 * step);
  double reach = 0.0;
  for (const double du : {0.0, step}) {
    for (const double dv : {0.0, step})
      reach = std::max(reach, angleBetween(middle, fromSquare(u + du, v + dv)));
  }
  reach *= 1.05;  // edges of a texel bend a little beyond its corners
  double closest = M_PI;
  for (const Eigen::Vector3d& d : directions_) closest = std::min(closest, angleBetween(middle, d));
  for (size_t i = 0; i < directions_.size(); ++i) {
    if (angleBetween(middle, directions_[i]) <= closest + 2.0 * reach)
      near_.item.push_back(static_cast<int>(i));
  }
  for (Eigen::Index t = 0; t < caps.rows(); ++t) {
    const Eigen::Vector3d axis = caps.row(t).head<3>();
    if (angleBetween(middle, axis) <= caps(t, 3) + reach) around_.item.push_back(static_cast<int>(t));
  }
  if (static_cast<int>(around_.item.size()) == around_.start.back()) {
    throw std::invalid_argument("the triangles of the directions do not cover the sphere");
  }
  near_.start.push_back(static_cast<int>(near_.item.size()));
  around_.start.push_back(static_cast<int>(around_.item.size()));
}

int DirectionLookup::texelAt(const Eigen::Vector3d& d) const {
  const double scale = 1.0 / (std::abs(d.x()) + std::abs(d.y()) + std::abs(d.z()));
  double u = d.x() * scale;
  double v = d.y() * scale;
  if (d.z() < 0.0) {
    const double folded = (1.0 - std::abs(v)) * (u < 0.0 ? -1.0 : 1.0);
    v = (1.0 - std::abs(u)) * (v < 0.0 ? -1.0 : 1.0);
    u = folded;
  }
  return squareIndex(u) * kSide + squareIndex(v);
}

int DirectionLookup::nearest(const Eigen::Vector3d& d) const {
  const auto texel = static_cast<size_t>(texelAt(d));
  int best = 0;
  double largest = -2.0;
  for (int i = near_.start[texel]; i < near_.start[texel + 1]; ++i) {
    const int candidate = near_.item[static_cast<size_t>(i)];
    const double cosine = d.dot(directions_[static_cast<size_t>(candidate)]);
    if (cosine > largest) {
      largest = cosine;
      best = candidate;
    }
  }
  return best;
}

DirectionLookup::Blend DirectionLookup::blend(const Eigen::Vector3d& d) const {
  const auto texel = static_cast<size_t>(texelAt(d));
  Eigen::Vector3d weights = Eigen::Vector3d::Zero();
  size_t best = 0;
  double largest = -1e9;
  for (int i = around_.start[texel]; i < around_.start[texel + 1]; ++i) {
    const auto t = static_cast<size_t>(around_.item[static_cast<size_t>(i)]);
    const Eigen::Vector3d w = to_weights_[t] * d;
    const double smallest = w.minCoeff();
    if (smallest > largest) {
      largest = smallest;
      weights = w;
      best = t;
      if (smallest >= 0.0) break;
    }
  }
  weights = weights.cwiseMax(0.0);
  weights /= weights.sum();
  return {triangles_[best], {weights[0], weights[1], weights[2]}};
}

}  // namespace capability_map
