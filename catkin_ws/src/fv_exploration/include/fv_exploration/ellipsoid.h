#pragma once
#include <Eigen/Core>

#include "fv_exploration/grid.h"

namespace fv {

/// How voxels become an ellipsoid.
struct EllipsoidModel {
  double resolution_m = 0.05;
  /// Thesis formulas 3.1 and 3.2 to the letter: no extent of the voxels, the eigenvalues themselves as
  /// semi-axes. Otherwise R^2/12 is added along each axis and semi-axes are sqrt(5 lambda): a solid ellipsoid
  /// has S = 1.
  bool literal = false;
};

/// Count, sums and products of sums of voxels: all that thesis formulas 3.3-3.5 need, and exact, so that
/// merging in any order gives the same bits.
struct Moments {
  int64_t n = 0;
  int64_t sum[3] = {0, 0, 0};
  int64_t product[6] = {0, 0, 0, 0, 0, 0};  ///< xx, yy, zz, xy, xz, yz

  void add(const Voxel& v);
  /// Add voxels that follow each other along x.
  void addRow(const Voxel& first, int length);
  Moments& operator+=(const Moments& o) { return *this = *this + o; }
  /// Formulas 3.3-3.5, as sums.
  Moments operator+(const Moments& o) const {
    Moments both;
    both.n = n + o.n;
    for (int i = 0; i < 3; ++i) both.sum[i] = sum[i] + o.sum[i];
    for (int i = 0; i < 6; ++i) both.product[i] = product[i] + o.product[i];
    return both;
  }
  bool operator==(const Moments& o) const;
  /// Mean voxel centre in voxels (not metres): formula 3.4.
  Eigen::Vector3d mean() const;
  /// Covariance of the voxel centres in voxels^2: formula 3.1.
  Eigen::Matrix3d covariance() const;
  /// Squared distance of two centroids in voxels^2.
  static double squaredDistance(const Moments& a, const Moments& b);
};

/// Volume of the ellipsoid of these voxels [m^3; of the literal formula: m^6 as the thesis has it].
double ellipsoidVolume(const Moments& moments, const EllipsoidModel& model);

/// S, formula 3.2: volume of the voxels over volume of their ellipsoid; infinite when that is 0 (literal,
/// flat).
double ellipsoidFit(const Moments& moments, const EllipsoidModel& model);

struct Ellipsoid {
  Eigen::Vector3d center;     ///< [m]
  Eigen::Matrix3d axes;       ///< columns, a rotation; belongs to semi_axes
  Eigen::Vector3d semi_axes;  ///< [m], largest first
  int64_t count;              ///< voxels
  double fit;                 ///< S
  double volume;              ///< [m^3]
};

/// Principal axes of the voxels. Axes point towards their largest component.
Ellipsoid fitEllipsoid(const Moments& moments, const EllipsoidModel& model);

}  // namespace fv
