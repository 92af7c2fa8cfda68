#include "current_planner.h"

#include <fv_msgs/AttachedObjects.h>

#include <stdexcept>

#include "conversions.h"

namespace ompl_planner {

CurrentPlanner::CurrentPlanner(ros::NodeHandle& nh, std::shared_ptr<const MotionPlanner> empty_handed)
    : empty_handed_(std::move(empty_handed)),
      planner_(empty_handed_),
      publisher_(
          nh.advertise<fv_msgs::AttachedObjects>("/ompl_planner/attached_objects", 1, /*latch=*/true)) {
  publisher_.publish(fv_msgs::AttachedObjects());
  service_ = nh.advertiseService("/ompl_planner/set_attached_objects", &CurrentPlanner::onSet, this);
}

std::shared_ptr<const MotionPlanner> CurrentPlanner::get() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return planner_;
}

bool CurrentPlanner::onSet(fv_msgs::SetAttachedObjects::Request& request,
                           fv_msgs::SetAttachedObjects::Response& response) {
  try {
    auto planner = empty_handed_->holding(heldObjectsFromMsg(request.objects));
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      planner_ = std::move(planner);
    }
    fv_msgs::AttachedObjects held;
    held.header.stamp = ros::Time::now();
    held.objects = request.objects;
    publisher_.publish(held);
    if (on_change_) on_change_();
    response.success = true;
    response.message = "the robot holds " + std::to_string(request.objects.size()) + " objects";
  } catch (const std::invalid_argument& error) {
    response.success = false;
    response.message = clipped(error.what());
  }
  return true;
}

}  // namespace ompl_planner
