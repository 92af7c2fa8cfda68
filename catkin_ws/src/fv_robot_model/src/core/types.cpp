#include "fv_robot_model/types.h"

#include "internal.h"

namespace fv_robot_model {

std::string joined(const std::vector<std::string>& names) {
  if (names.empty()) return "(none)";
  std::string all = names.front();
  for (std::size_t i = 1; i < names.size(); ++i) all += ", " + names[i];
  return all;
}

UnknownNameError::UnknownNameError(const std::string& kind, const std::string& name,
                                   const std::vector<std::string>& valid)
    : std::invalid_argument(text("unknown ", kind, " '", name, "'; valid: ", joined(valid))) {}

void checkPoses(const LinkPoses& poses, std::size_t link_count) {
  if (poses.size() != link_count)
    throw std::invalid_argument(text("expected the poses of ", link_count, " links, got ", poses.size(),
                                     "; use RobotModel::forward"));
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (!poses[i].matrix().allFinite())
      throw std::invalid_argument(text("the pose of link number ", i, " is not finite"));
}

}  // namespace fv_robot_model
