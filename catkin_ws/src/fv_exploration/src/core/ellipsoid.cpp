#include "fv_exploration/ellipsoid.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>

namespace fv {

namespace {
constexpr double kBall = 4.0 / 3.0 * M_PI;
const double kAxisScale = std::sqrt(5.0);  // a solid ellipsoid with semi-axis a has variance a^2 / 5

/// Entries xx, yy, zz, xy, xz, yz of the covariance in voxels^2: formula 3.1.
std::array<double, 6> covarianceEntries(const Moments& m) {
  const double n = static_cast<double>(m.n);
  const double x = m.sum[0] / n, y = m.sum[1] / n, z = m.sum[2] / n;
  return {m.product[0] / n - x * x, m.product[1] / n - y * y, m.product[2] / n - z * z,
          m.product[3] / n - x * y, m.product[4] / n - x * z, m.product[5] / n - y * z};
}

/// The same with the extent of a voxel, in m^2.
std::array<double, 6> modelEntries(const Moments& m, const EllipsoidModel& model) {
  std::array<double, 6> c = covarianceEntries(m);
  if (!model.literal)
    for (int i = 0; i < 3; ++i) c[i] += 1.0 / 12.0;
  for (double& entry : c) entry *= model.resolution_m * model.resolution_m;
  return c;
}

Eigen::Matrix3d symmetric(const std::array<double, 6>& c) {
  Eigen::Matrix3d out;
  out << c[0], c[3], c[4], c[3], c[1], c[5], c[4], c[5], c[2];
  return out;
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

void Moments::addRow(const Voxel& first, int length) {
  const int64_t x = first.x(), y = first.y(), z = first.z(), k = length;
  const int64_t sum_i = k * (k - 1) / 2, sum_ii = k * (k - 1) * (2 * k - 1) / 6;  // of 0, 1, ... k - 1
  const int64_t sum_x = k * x + sum_i;
  n += k;
  sum[0] += sum_x;
  sum[1] += k * y;
  sum[2] += k * z;
  product[0] += k * x * x + 2 * x * sum_i + sum_ii;
  product[1] += k * y * y;
  product[2] += k * z * z;
  product[3] += sum_x * y;
  product[4] += sum_x * z;
  product[5] += k * y * z;
}

bool Moments::operator==(const Moments& o) const {
  return n == o.n && std::equal(sum, sum + 3, o.sum) && std::equal(product, product + 6, o.product);
}

Eigen::Vector3d Moments::mean() const {
  return Eigen::Vector3d(sum[0], sum[1], sum[2]) / static_cast<double>(n) + Eigen::Vector3d::Constant(0.5);
}

Eigen::Matrix3d Moments::covariance() const { return symmetric(covarianceEntries(*this)); }

double Moments::squaredDistance(const Moments& a, const Moments& b) {
  const double na = static_cast<double>(a.n), nb = static_cast<double>(b.n);
  const double dx = a.sum[0] / na - b.sum[0] / nb;
  const double dy = a.sum[1] / na - b.sum[1] / nb;
  const double dz = a.sum[2] / na - b.sum[2] / nb;
  return dx * dx + dy * dy + dz * dz;
}

double ellipsoidVolume(const Moments& moments, const EllipsoidModel& model) {
  // The product of the eigenvalues is the determinant: no need to find them.
  const auto [xx, yy, zz, xy, xz, yz] = modelEntries(moments, model);
  const double determinant =
      std::max(0.0, xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz));
  if (model.literal) return kBall * determinant;
  return kBall * 5.0 * kAxisScale * std::sqrt(determinant);
}

double ellipsoidFit(const Moments& moments, const EllipsoidModel& model) {
  const double volume = ellipsoidVolume(moments, model);
  const double edge = model.resolution_m;
  const double voxels = static_cast<double>(moments.n) * (edge * edge * edge);
  return volume > 0 ? voxels / volume : std::numeric_limits<double>::infinity();
}

Ellipsoid fitEllipsoid(const Moments& moments, const EllipsoidModel& model) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(symmetric(modelEntries(moments, model)));
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
