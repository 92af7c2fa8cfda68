/// Which face of a hull does a point see furthest below it?
#pragma once

#include <fv_robot_model/shape.h>

#include <cstdint>
#include <vector>

namespace ompl_planner {

/// The largest plane value of a hull at a point, found among the few faces that can hold it there: a grid
/// over the hull and its surroundings lists them by cell. Hulls of meshes have hundreds of faces; a cell has
/// about ten. Immutable.
class HullFaces {
 public:
  struct Furthest {
    double height;           ///< Above that face's plane [m]; not positive: the point is inside the hull.
    Eigen::Vector3d normal;  ///< Of that face, outwards, shape frame.
  };

  /// @param hull A shape of kind Convex. @throws std::invalid_argument for other kinds.
  explicit HullFaces(const fv_robot_model::Shape& hull);

  /// Outside of the hull: the face whose plane lies furthest below p_shape (shape frame [m]); its height
  /// there is at most the distance to the hull. Inside: any face that tells so. Far outside of the hull every
  /// face is asked.
  Furthest furthest(const Eigen::Vector3d& p_shape) const;

 private:
  using Faces = std::vector<std::uint32_t>;
  double height(std::uint32_t face, const Eigen::Vector3d& p_shape) const {
    return planes_.row(face).head<3>().dot(p_shape) + planes_(face, 3);
  }
  Furthest among(const std::uint32_t* begin, const std::uint32_t* end, const Eigen::Vector3d& p_shape) const;
  Faces reaching(const Faces& faces, const Eigen::AlignedBox3d& box) const;
  void listFaces();

  decltype(fv_robot_model::Shape::planes) planes_;
  Eigen::Vector3d corner_;             ///< Of the first cell, shape frame [m].
  Eigen::Vector3i size_;               ///< In cells.
  Faces all_;                          ///< Every face.
  Faces faces_;                        ///< Of the first cell, then of the second ..., z fastest.
  std::vector<std::uint32_t> begins_;  ///< Of each cell in faces_, and the end.
};

}  // namespace ompl_planner
