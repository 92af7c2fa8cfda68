#include "fv_exploration/ellipsoid.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <limits>

namespace fv {

namespace {
constexpr double kBall = 4.0 / 3.0 * M_PI;
const double kAxisScale = std::sqrt(5.0);  // a solid ellipsoid with semi-axis a has variance a^2 / 5

Eigen::Matrix3d modelCovariance(const Moments& m, const EllipsoidModel& model) {
  Eigen::Matrix3d c = m.covariance();
  if (!model.literal) c.diagonal().array() += 1.0 / 12.0;
  return c * (model.resolution_m * model.resolution_m);
}
}  // namespace

void Moments::add(const Voxel& v) {
  const int64_t x = v.x(), y = v.y(), z = v.z();
  ++n;
  sum[0] += x;
  sum[1] += y;
  sum[2] += z;
  product[0] += x * x;
  product[1] += y * y;
  product[2] += z * z;
  product[3] += x * y;
  product[4] += x * z;
  product[5] += y * z;
}

Moments& Moments::operator+=(const Moments& o) {
  n += o.n;
  for (int i = 0; i < 3; ++i) sum[i] += o.sum[i];
  for (int i = 0; i < 6; ++i) product[i] += o.product[i];
  return *this;
}

bool Moments::operator==(const Moments& o) const {
  return n == o.n && std::equal(sum, sum + 3, o.sum) && std::equal(product, product + 6, o.product);
}

Eigen::Vector3d Moments::mean() const {
  return Eigen::Vector3d(sum[0], sum[1], sum[2]) / static_cast<double>(n) + Eigen::Vector3d::Constant(0.5);
}

Eigen::Matrix3d Moments::covariance() const {
  const double count = static_cast<double>(n);
  const double m[3] = {sum[0] / count, sum[1] / count, sum[2] / count};
  const double xx = product[0] / count - m[0] * m[0], yy = product[1] / count - m[1] * m[1];
  const double zz = product[2] / count - m[2] * m[2], xy = product[3] / count - m[0] * m[1];
  const double xz = product[4] / count - m[0] * m[2], yz = product[5] / count - m[1] * m[2];
  Eigen::Matrix3d c;
  c << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  return c;
}

double Moments::squaredDistance(const Moments& a, const Moments& b) {
  const double na = static_cast<double>(a.n), nb = static_cast<double>(b.n);
  const double dx = a.sum[0] / na - b.sum[0] / nb;
  const double dy = a.sum[1] / na - b.sum[1] / nb;
  const double dz = a.sum[2] / na - b.sum[2] / nb;
  return dx * dx + dy * dy + dz * dz;
}

double ellipsoidVolume(const Moments& moments, const EllipsoidModel& model) {
  // The product of the eigenvalues is the determinant: no need to find them.
  const double determinant = std::max(0.0, modelCovariance(moments, model).determinant());
  if (model.literal) return kBall * determinant;
  return kBall * 5.0 * kAxisScale * std::sqrt(determinant);
}

double ellipsoidFit(const Moments& moments, const EllipsoidModel& model) {
  const double volume = ellipsoidVolume(moments, model);
  const double voxels = static_cast<double>(moments.n) * std::pow(model.resolution_m, 3);
  return volume > 0 ? voxels / volume : std::numeric_limits<double>::infinity();
}

Ellipsoid fitEllipsoid(const Moments& moments, const EllipsoidModel& model) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(modelCovariance(moments, model));
  Ellipsoid e;
  e.center = moments.mean() * model.resolution_m;
  for (int i = 0; i < 3; ++i) {
    const double lambda = std::max(0.0, solver.eigenvalues()[2 - i]);
    e.semi_axes[i] = model.literal ? lambda : std::sqrt(5.0 * lambda);
    e.axes.col(i) = solver.eigenvectors().col(2 - i);
    Eigen::Index largest;
    e.axes.col(i).cwiseAbs().maxCoeff(&largest);
    if (e.axes(largest, i) < 0) e.axes.col(i) *= -1;
  }
  if (e.axes.determinant() < 0) e.axes.col(2) *= -1;
  e.count = moments.n;
  e.fit = ellipsoidFit(moments, model);
  e.volume = ellipsoidVolume(moments, model);
  return e;
}

}  // namespace fv
