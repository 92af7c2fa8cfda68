#include "path_publisher.h"

#include "conversions.h"

namespace ompl_planner {

void PathPublisher::publish(const ShownPath& path) const {
  fv_msgs::PlannedPath msg;
  msg.header.stamp = ros::Time::now();
  msg.header.frame_id = path.frame;
  msg.map_sequence = path.map_sequence;
  msg.trajectory = path.trajectory;
  msg.executing = path.executing;
  if (path.group.isChain()) {
    const auto tip = static_cast<std::size_t>(path.model.linkIndex(path.group.tip_link));
    Eigen::VectorXd q = path.q_all;
    for (const auto& point : path.trajectory.points) {
      path.model.setGroup(path.group,
                          Eigen::Map<const Eigen::VectorXd>(
                              point.positions.data(), static_cast<Eigen::Index>(point.positions.size())),
                          q);
      msg.tip_poses.push_back(msgFromIsometry(path.T_frame_root * path.model.forward(q)[tip]));
    }
  }
  publisher_.publish(msg);
}

}  // namespace ompl_planner
