#include "app/plant/page/wall_feed.h"

#include <fmt/format.h>

#include <chrono>
#include <csignal>

#include "app/plant/database/schema.h"
#include "drivers/clock.h"

namespace plumbline::plant {
namespace {

std::chrono::duration<double> Seconds(double s) {
  return std::chrono::duration<double>(s);
}

}  // namespace

WallFeed::WallFeed(std::string settings, std::function<void(const std::string&)> log)
    : settings_(std::move(settings)), log_(std::move(log)), thread_([this] { Run(); }) {}

WallFeed::~WallFeed() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

Result<void> WallFeed::Read() {
  if (!connection_ || !connection_->alive()) {
    connection_.reset();
    auto opened = Connection::Open(settings_, "plumbline-plant page");
    if (!opened) return opened.failure();
    if (const auto known = RequireSchema(opened.value()); !known) return known.failure();
    // A query that waits for a lock must not let the wall grow old in silence.
    const auto limited = opened.value().Run("SET statement_timeout = '4s'");
    if (!limited) return limited.failure();
    connection_.emplace(std::move(opened).value());
  }
  double now_utc = 0;
  const auto cells = ReadCells(*connection_, now_utc);
  if (!cells) {
    connection_.reset();
    return cells.failure();
  }
  auto wall = std::make_shared<const Wall>(WallFrom(*cells, now_utc, *Get().wall));
  const std::lock_guard lock(mutex_);
  wall_ = std::move(wall);
  read_s_ = MonotonicSeconds();
  return {};
}

void WallFeed::Run() {
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, nullptr);  // signals belong to the main thread
  double next_s = MonotonicSeconds();
  for (;;) {
    const auto read = Read();
    std::unique_lock lock(mutex_);
    const std::string failure = read ? "" : read.error();
    if (failure.empty() != failure_.empty()) {
      log_(failure.empty() ? "the plant's database answers again"
                           : fmt::format("the plant's database does not answer: {}. The page shows "
                                         "this; it is tried every second",
                                         failure));
    }
    failure_ = failure;
    changed_.notify_all();
    next_s = std::max(next_s + kPeriod_s, MonotonicSeconds());
    if (changed_.wait_for(lock, Seconds(next_s - MonotonicSeconds()), [this] { return ending_; })) {
      return;
    }
  }
}

std::string WallFeed::Problem() const {
  if (!failure_.empty()) return "the plant's database does not answer: " + failure_;
  const double age_s = MonotonicSeconds() - read_s_;
  return age_s > kOld_s ? "the plant's database has not answered yet" : "";
}

WallFeed::Newest WallFeed::Get() const {
  const std::lock_guard lock(mutex_);
  return {wall_, Problem()};
}

WallFeed::Newest WallFeed::Await(std::uint64_t version, double limit_s) const {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, Seconds(limit_s), [&] { return ending_ || wall_->version != version; });
  return {wall_, Problem()};
}

}  // namespace plumbline::plant
