#include "bindings.h"

namespace fv_robot_model {
namespace {

using RowMatrix4 = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

Eigen::Isometry3d isometryFrom(const double* numbers, const std::string& name) {
  Eigen::Isometry3d T;
  T.matrix() = Eigen::Map<const RowMatrix4>(numbers);
  const bool rigid = T.matrix().allFinite() && T.linear().isUnitary(1e-6) && T.linear().determinant() > 0.0 &&
                     T.matrix().row(3).isApprox(Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0), 1e-6);
  if (!rigid) throw std::invalid_argument(name + " is not a finite rigid motion (rotation and translation)");
  return T;
}

}  // namespace

Eigen::Isometry3d isometryFromArray(const Array& matrix, const std::string& name) {
  if (matrix.ndim() != 2 || matrix.shape(0) != 4 || matrix.shape(1) != 4)
    throw std::invalid_argument(name + " must have shape (4, 4)");
  return isometryFrom(matrix.data(), name);
}

LinkPoses posesFromArray(const Array& matrices) {
  if (matrices.ndim() != 3 || matrices.shape(1) != 4 || matrices.shape(2) != 4)
    throw std::invalid_argument("link poses must have shape (L, 4, 4)");
  LinkPoses poses(matrices.shape(0));
  for (std::size_t i = 0; i < poses.size(); ++i)
    poses[i] = isometryFrom(matrices.data() + 16 * i, "link pose number " + std::to_string(i));
  return poses;
}

void writeMatrix(const Eigen::Isometry3d& T, double* out) {
  Eigen::Map<RowMatrix4> view(out);
  view = T.matrix();
}

}  // namespace fv_robot_model
