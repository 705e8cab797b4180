#include "drivers/robot/robot_link.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "drivers/real_time.h"

namespace plumbline::robot {

void ShortText::Assign(std::string_view text) {
  size = std::min(text.size(), characters.size());
  std::copy_n(text.begin(), size, characters.begin());
}

RobotLink::RobotLink(std::unique_ptr<RobotDevice> device) : device_(std::move(device)) {}

RobotLink::~RobotLink() {
  Stop();
}

void RobotLink::Start() {
  if (thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);  // the cycle may already be requesting and waiting
    stop_ = false;
    may_push_ = false;
    status_.since_s = MonotonicSeconds();
    PublishStatus();
  }
  ended_ = false;
  thread_ = std::thread([this] {
    SetRealTimePriority(kRobotPriority, "robot");  // the control cycle waits for it
    Run();
    ended_ = true;
  });
}

void RobotLink::RequestStop() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  served_changed_.notify_all();
}

void RobotLink::Stop() {
  if (!thread_.joinable()) return;
  RequestStop();
  thread_.join();
}

void RobotLink::RequestRead() {
  {
    const std::lock_guard lock(mutex_);
    ++requested_;
  }
  wake_.notify_one();
}

bool RobotLink::WaitForState(std::chrono::steady_clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  const std::uint64_t wanted = requested_;
  const bool served = served_changed_.wait_until(
      lock, deadline, [this, wanted] { return stop_ || served_ >= wanted; });
  return served && served_ >= wanted && status_.connected;
}

model::RobotState RobotLink::Latest() const {
  const std::lock_guard lock(mutex_);
  return latest_;
}

RobotLinkStatus RobotLink::Status() const {
  const std::lock_guard lock(status_readers_);
  return *published_status_.Read();
}

void RobotLink::QueuePush(std::span<const PushPoint> points) {
  {
    const std::lock_guard lock(mutex_);
    queued_count_ = std::min(points.size(), queued_.size());
    std::copy_n(points.begin(), queued_count_, queued_.begin());
  }
  wake_.notify_one();
}

void RobotLink::Run() {
  model::RobotState state;
  std::array<PushPoint, kMaxPushPoints> points;
  while (true) {
    std::optional<std::uint64_t> request;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [this] {
        return stop_ || requested_ != served_ || (queued_count_ > 0 && may_push_);
      });
      if (stop_) break;
      if (requested_ != served_) request = requested_;
    }
    heartbeat_.Beat();
    if (request) {
      const LinkResult result = device_->Read(state);
      NoteReading(result, state, *request);
      if (result != LinkResult::kOk) continue;
    }

    std::size_t count = 0;
    {
      const std::lock_guard lock(mutex_);
      if (stop_) break;
      count = std::exchange(queued_count_, 0);
      std::copy_n(queued_.begin(), count, points.begin());
    }
    heartbeat_.Beat();
    if (count > 0) NotePush(device_->Push(std::span(points).first(count)));
  }
  NotePush(device_->WithdrawAll(kWithdrawal_s));
}

void RobotLink::NoteReading(LinkResult result, const model::RobotState& state,
                            std::uint64_t request) {
  const bool good = result == LinkResult::kOk;
  {
    const std::lock_guard lock(mutex_);
    if (good) latest_ = state;
    if (status_.connected != good) {
      if (good && status_.changes > 0) ++status_.reconnects;
      status_.connected = good;
      status_.since_s = MonotonicSeconds();
      ++status_.changes;
    }
    if (result != LinkResult::kWaiting) status_.result = result;
    if (!good) status_.problem.Assign(device_->problem());
    may_push_ = good;
    NoteNotice();
    ++(good ? status_.readings : status_.failures);
    PublishStatus();
    served_ = request;
  }
  served_changed_.notify_all();
}

void RobotLink::NoteNotice() {
  for (auto notice = device_->TakeNotice(); !notice.empty(); notice = device_->TakeNotice()) {
    status_.notices[status_.notice_count % RobotLinkStatus::kKeptNotices].Assign(notice);
    ++status_.notice_count;
  }
}

void RobotLink::NotePush(LinkResult result) {
  const std::lock_guard lock(mutex_);
  if (status_.push_result != result) ++status_.push_changes;
  status_.push_result = result;
  if (result != LinkResult::kOk) status_.push_problem.Assign(device_->problem());
  PublishStatus();
}

void RobotLink::PublishStatus() {
  published_status_.Begin() = status_;
  published_status_.Publish();
}

}  // namespace plumbline::robot
