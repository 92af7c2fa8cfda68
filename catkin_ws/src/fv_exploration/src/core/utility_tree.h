#pragma once
#include <octomap/OcTreeNode.h>
#include <octomap/OccupancyOcTreeBase.h>

#include <memory>
#include <string>

#include "fv_exploration/utility.h"

namespace fv {

/// Occupancy, and for free space the utility gathered there and where to look from there (thesis 3.3.1).
class UtilityOcTreeNode : public octomap::OcTreeNode {
 public:
  UtilityOcTreeNode() = default;
  UtilityOcTreeNode(const UtilityOcTreeNode& other) = default;
  UtilityOcTreeNode& operator=(const UtilityOcTreeNode&) = delete;

  /// Equal in everything: nodes that differ in utility are never pruned into one.
  bool operator==(const UtilityOcTreeNode& o) const {
    return value == o.value && utility == o.utility && direction == o.direction;
  }
  void copyData(const UtilityOcTreeNode& from);
  std::istream& readData(std::istream& stream);
  std::ostream& writeData(std::ostream& stream) const;

  static constexpr std::size_t kPayloadBytes = sizeof(float) + sizeof(double) + 3 * sizeof(float);

  double utility = 0;                                   ///< [m^3]
  Eigen::Vector3f direction = Eigen::Vector3f::Zero();  ///< unit, or 0 without utility
};

/// Octree with utilities; tree type "UtilityOcTree", registered with OctoMap's factory of .ot files.
class UtilityOcTree : public octomap::OccupancyOcTreeBase<UtilityOcTreeNode> {
 public:
  explicit UtilityOcTree(double resolution_m);
  UtilityOcTree* create() const override { return new UtilityOcTree(resolution); }
  std::string getTreeType() const override { return "UtilityOcTree"; }
  /// Become a copy of an octree's occupancy, without utility.
  void copyOccupancy(const OccupancyTree& from);

 private:
  void copyBelow(const OccupancyTree& from, const octomap::OcTreeNode* source, UtilityOcTreeNode* target);
  struct Registration {
    Registration();
    void ensureLinking() {}
  };
  static Registration registration_;
};

/// The map's occupancy with the utilities of its voxels; lossless, and as pruned as that allows.
/// @throws InputError when the map does not know such a voxel: the utility is of another one.
std::unique_ptr<UtilityOcTree> utilityTree(const OccupancyMap& map, const Utility& utility);

/// Write and read a .ot file of a UtilityOcTree. @throws MapFileError.
void writeUtilityTree(const UtilityOcTree& tree, const std::string& path);
std::unique_ptr<UtilityOcTree> readUtilityTree(const std::string& path);

/// Write a .ot file of a ColorOcTree for octovis: utility of free voxels from blue to red, shown as occupied
/// because octovis hides free ones; obstacles grey when `with_obstacles`.
/// @throws MapFileError.
void writeColorTree(const OccupancyMap& map, const Utility& utility, bool with_obstacles,
                    const std::string& path);

}  // namespace fv
