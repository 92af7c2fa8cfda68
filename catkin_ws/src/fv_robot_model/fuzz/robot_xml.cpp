/// URDF and SRDF of any content, the two parted by a 0 byte; then what every user of a model asks. Errors are
/// ModelError and std::invalid_argument.
#include <stdexcept>
#include <string>

#include "fv_robot_model/robot_model.h"

namespace {

using fv_robot_model::RobotModel;

void ask(const RobotModel& model) {
  const Eigen::VectorXd q = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.jointNames().size()));
  const auto poses = model.forward(q);
  for (const std::string& name : model.groupNames()) {
    const fv_robot_model::Group& group = model.group(name);
    const Eigen::VectorXd q_group =
        Eigen::VectorXd::Zero(static_cast<Eigen::Index>(group.joint_names.size()));
    model.withinLimits(group, q_group);
    model.namedStates(name);
    if (group.isChain()) model.jacobian(group, q_group);
  }
  for (std::size_t link = 0; link < poses.size(); ++link)
    for (const auto& shape : model.shapes(static_cast<int>(link))) fv_robot_model::boundingSphere(shape);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  const std::string all(reinterpret_cast<const char*>(data), size);
  const std::size_t border = all.find('\0');
  const std::string srdf = border == std::string::npos ? "" : all.substr(border + 1);
  try {
    ask(RobotModel::fromXml(all.substr(0, border), srdf, [](const std::string&) { return std::string(); }));
  } catch (const fv_robot_model::ModelError&) {
  } catch (const std::invalid_argument&) {
  }
  return 0;
}
