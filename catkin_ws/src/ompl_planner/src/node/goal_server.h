/// An action whose goals are handled one after the other.
#pragma once

#include <actionlib/server/action_server.h>
#include <ros/console.h>

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

namespace ompl_planner {

/// Handles goals in a thread of its own; a new goal cancels those before it. Every goal gets exactly one
/// answer, with a status. (But actionlib itself gives an empty one to a goal whose cancel has overtaken it.)
/// SimpleActionServer answers all goals that it drops with nothing, and drops those whose stamps are older
/// than the last one's, as they are after /clock has jumped back.
///
/// The action's result needs `status` with SUCCESS and CANCELLED, and `message`.
template <typename Action>
class GoalServer {
 public:
  ACTION_DEFINITION(Action);
  using Tell = std::function<void(const Feedback&)>;
  /// Gives the goal's result; asks whether it is cancelled meanwhile, often.
  using Handle = std::function<Result(const Goal&, const std::function<bool()>& cancelled, const Tell&)>;

  GoalServer(ros::NodeHandle& nh, const std::string& name, Handle handle)
      : handle_(std::move(handle)),
        server_(
            nh, name, [this](ServerGoal goal) { onGoal(goal); }, [this](ServerGoal goal) { onCancel(goal); },
            /*auto_start=*/false) {
    worker_ = std::thread([this] { work(); });
    server_.start();
  }
  ~GoalServer() { close(); }
  GoalServer(const GoalServer&) = delete;
  GoalServer& operator=(const GoalServer&) = delete;

  /// Cancels what there is and returns once it is answered; goals that come later are refused. A second call
  /// does nothing.
  void close() {
    std::shared_ptr<Task> dropped;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      closed_ = true;
      dropped = std::move(next_);
      if (running_) running_->cancelled = true;
    }
    changed_.notify_all();
    if (dropped) answerCancelled(dropped->goal, "the planner is shutting down");
    if (worker_.joinable()) worker_.join();
  }

 private:
  using ServerGoal = typename actionlib::ActionServer<Action>::GoalHandle;
  struct Task {
    explicit Task(const ServerGoal& goal) : goal(goal) {}
    ServerGoal goal;
    std::atomic<bool> cancelled{false};
  };

  // actionlib holds its lock while it calls these two, and takes it in every answer: no answer with mutex_
  // held.
  void onGoal(const ServerGoal& goal) {
    std::shared_ptr<Task> dropped = std::make_shared<Task>(goal);
    bool closed = false;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      closed = closed_;
      if (!closed) {
        std::swap(next_, dropped);
        if (running_) running_->cancelled = true;
      }
    }
    changed_.notify_all();
    if (dropped)
      answerCancelled(dropped->goal, closed ? "the planner is shutting down" : "replaced by a newer goal");
  }

  void onCancel(const ServerGoal& goal) {
    std::shared_ptr<Task> dropped;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (running_ && running_->goal == goal) running_->cancelled = true;
      if (next_ && next_->goal == goal) dropped = std::move(next_);
    }
    if (dropped) answerCancelled(dropped->goal, "cancelled before it was begun");
  }

  void work() {
    while (const auto task = begin()) {
      task->goal.setAccepted();
      answer(task->goal, resultOf(*task));
      const std::lock_guard<std::mutex> lock(mutex_);
      running_.reset();
    }
  }

  /// Waits for a goal; nothing when the server is closed.
  std::shared_ptr<Task> begin() {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return next_ || closed_; });
    running_ = std::move(next_);
    return running_;
  }

  Result resultOf(Task& task) {
    try {
      return handle_(
          *task.goal.getGoal(), [&task] { return task.cancelled.load(); },
          [&task](const Feedback& feedback) { task.goal.publishFeedback(feedback); });
    } catch (const std::exception& error) {
      Result result;
      result.message = error.what();
      return result;
    }
  }

  static void answerCancelled(ServerGoal& goal, const std::string& why) {
    Result result;
    result.status = Result::CANCELLED;
    result.message = why;
    answer(goal, result);
  }

  static void answer(ServerGoal& goal, const Result& result) {
    if (result.status == Result::SUCCESS) {
      goal.setSucceeded(result, result.message);
    } else if (result.status == Result::CANCELLED) {
      goal.setCanceled(result, result.message);
    } else {
      ROS_WARN("ompl_planner: %s", result.message.c_str());
      goal.setAborted(result, result.message);
    }
  }

  Handle handle_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::shared_ptr<Task> next_;     ///< The newest goal, not begun.
  std::shared_ptr<Task> running_;  ///< The one that the worker handles.
  bool closed_{false};
  actionlib::ActionServer<Action> server_;
  std::thread worker_;
};

}  // namespace ompl_planner
