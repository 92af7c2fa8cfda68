#include "urdf_text.h"

#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

#include <mutex>

#include "fv_robot_model/types.h"
#include "internal.h"
#include "urdf_check.h"

namespace fv_robot_model {
namespace {

/// While it lives, what urdfdom would print is collected instead.
class CollectComplaints : public console_bridge::OutputHandler {
 public:
  CollectComplaints() { console_bridge::useOutputHandler(this); }
  ~CollectComplaints() override { console_bridge::restorePreviousOutputHandler(); }
  CollectComplaints(const CollectComplaints&) = delete;
  CollectComplaints& operator=(const CollectComplaints&) = delete;

  void log(const std::string& message, console_bridge::LogLevel level, const char*, int) override {
    if (level < console_bridge::CONSOLE_BRIDGE_LOG_WARN) return;
    if (!complaints_.empty()) complaints_ += "; ";
    complaints_ += message;
    const bool about_looks = message.find("material") != std::string::npos;  // a colour that nobody defines
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR && !about_looks) refused_ = true;
  }
  const std::string& complaints() const { return complaints_; }
  /// Something was left out of the tree, such as a shape whose numbers are none.
  bool refused() const { return refused_; }

 private:
  std::string complaints_;
  bool refused_{false};
};

/// console_bridge has one output handler per process, so only one parser at a time may borrow it.
std::mutex& consoleBridgeMutex() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace

urdf::ModelInterfaceSharedPtr parseUrdfText(const std::string& xml) {
  checkUrdf(xml);
  const std::lock_guard<std::mutex> lock(consoleBridgeMutex());
  const CollectComplaints collector;
  urdf::ModelInterfaceSharedPtr tree;
  std::string reason;
  try {
    tree = urdf::parseURDF(xml);
  } catch (const std::exception& error) {
    reason = error.what();
  }
  if (tree == nullptr || tree->getRoot() == nullptr || collector.refused())
    throw ModelError(text("the URDF cannot be used: ", collector.complaints(), reason));
  return tree;
}

}  // namespace fv_robot_model
