#include "app/plant/jobs/worker.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <climits>
#include <random>

#include "app/plant/database/schema.h"
#include "drivers/clock.h"

namespace plumbline::plant {
namespace {

using log::Event;

constexpr double kAskPeriod_s = 1;        ///< for new jobs
constexpr double kIdlePeriod_s = 0.25;    ///< between two looks at the clock
constexpr double kChildPeriod_s = 0.02;   ///< between two looks at the children
constexpr double kShortestPause_s = 0.5;  ///< between two attempts to connect
constexpr double kLongestPause_s = 10;
constexpr double kLeasePart = 0.25;  ///< a lease is extended after this part of it

std::vector<std::string> VersionsOf(const std::vector<JobProgram>& programs) {
  std::vector<std::string> versions;
  for (const JobProgram& program : programs) versions.push_back(program.version);
  return versions;
}

}  // namespace

std::string WorkerName() {
  char host[HOST_NAME_MAX + 1] = "";
  gethostname(host, sizeof host - 1);
  std::random_device random;
  return fmt::format("{}/{}/{:08x}", host, getpid(), random());
}

/// A job of this worker, and what has become of it.
struct Worker::Slot {
  TakenJob job;
  JobProgram program;
  std::optional<JobRun> run;            ///< while it runs
  std::optional<JobOutcome> outcome{};  ///< afterwards, until it is stored
  double extend_s = 0;                  ///< when to extend the lease
};

Worker::Worker(WorkerOptions options, log::LogSink log)
    : options_(std::move(options)),
      log_(std::move(log)),
      queue_(WorkerName(), options_.lease_s, VersionsOf(options_.programs)) {}

Worker::~Worker() = default;

void Worker::Run(int stop) {
  for (;;) {
    if (options_.heartbeat) options_.heartbeat();
    if (Connected()) FillSlots();
    ServeSlots();
    if (options_.once && slots_.empty() && (empty_ || (usable_ == false && !was_usable_))) return;
    const double wait_s = slots_.empty() ? kIdlePeriod_s : kChildPeriod_s;
    pollfd descriptor{stop, POLLIN, 0};
    if (poll(&descriptor, stop < 0 ? 0 : 1, static_cast<int>(1e3 * wait_s)) > 0) break;
  }
  for (Slot& slot : slots_) {
    slot.run.reset();  // kills the child
    const bool stored = slot.outcome && connection_ && Deliver(slot);
    if (!stored && connection_) static_cast<void>(queue_.HandBack(*connection_, slot.job).ok());
    if (!stored)
      log_({Event::kWorkerJobReturned, fmt::format("job {}: handed back", slot.job.job)});
  }
  slots_.clear();
}

bool Worker::Connected() {
  if (connection_ && connection_->alive()) return true;
  connection_.reset();
  const double now_s = MonotonicSeconds();
  if (now_s < retry_s_) return false;
  auto opened = Connection::Open(options_.database, "plumbline-worker");
  const Result<void> known = opened ? RequireSchema(opened.value()) : opened.failure();
  if (!known) {
    Disconnect(known.error());
    return false;
  }
  connection_ = std::move(opened).value();
  return true;
}

void Worker::Disconnect(const std::string& why) {
  connection_.reset();
  if (usable_ != false) {
    log_({Event::kWorkerDatabaseLost, fmt::format("database: {}; running jobs continue", why)});
  }
  usable_ = false;
  pause_s_ = std::clamp(2 * pause_s_, kShortestPause_s, kLongestPause_s);
  retry_s_ = MonotonicSeconds() + pause_s_;
}

void Worker::FillSlots() {
  if (MonotonicSeconds() < ask_s_) return;
  while (connection_ && static_cast<int>(slots_.size()) < options_.slots) {
    if (StartNext()) continue;
    ask_s_ = MonotonicSeconds() + kAskPeriod_s;
    return;
  }
}

/// @return  whether there was a job
bool Worker::StartNext() {
  auto taken = queue_.Take(*connection_);
  if (!taken) {
    Disconnect(taken.error());
    return false;
  }
  if (usable_ != true) log_({Event::kWorkerDatabaseUp, "database connected"});
  usable_ = was_usable_ = true;
  pause_s_ = 0;
  empty_ = !taken->has_value();
  if (empty_) return false;
  Slot slot{**taken, ProgramFor((*taken)->version), std::nullopt};
  slot.extend_s = MonotonicSeconds() + kLeasePart * options_.lease_s;
  auto task = PrepareJob(*connection_, slot.job);
  if (!task) {
    if (!connection_->alive()) {
      Disconnect(task.error());
    } else {
      GiveUp(slot, task.error());
    }
    return true;
  }
  auto run = JobRun::Start(slot.program, std::move(task).value(), options_.limits);
  if (!run) {
    GiveUp(slot, run.error());
    return true;
  }
  slot.run = std::move(run).value();
  slots_.push_back(std::move(slot));
  return true;
}

const JobProgram& Worker::ProgramFor(const std::string& version) const {
  const auto found =
      std::find_if(options_.programs.begin(), options_.programs.end(),
                   [&version](const JobProgram& one) { return one.version == version; });
  return found == options_.programs.end() ? options_.programs.front() : *found;
}

void Worker::ServeSlots() {
  std::erase_if(slots_, [this](Slot& slot) {
    if (slot.run && !slot.outcome) {
      slot.outcome = slot.run->Poll();
      if (slot.outcome) {
        slot.run.reset();
        ask_s_ = 0;
      }
    }
    if (!connection_) return false;
    if (slot.outcome) return Deliver(slot);
    return !ExtendLease(slot);
  });
}

bool Worker::Deliver(Slot& slot) {
  if (!slot.outcome->answered) {
    GiveUp(slot, slot.outcome->text);
    return connection_.has_value();
  }
  const auto stored = queue_.Finish(
      *connection_, slot.job, {slot.program.version, slot.outcome->seconds, slot.outcome->text});
  if (stored) {
    answered_ += *stored ? 1 : 0;
    // Or this worker stored it, and the confirmation was lost with the connection.
    if (!*stored) LogJobLost(slot);
    return true;
  }
  // Class 22: the answer itself cannot be stored, for example a text with a NUL character.
  if (connection_->alive() && connection_->last_state().starts_with("22")) {
    GiveUp(slot, "the answer cannot be stored: " + stored.error());
    return connection_.has_value();
  }
  Disconnect(stored.error());
  return false;
}

bool Worker::ExtendLease(Slot& slot) {
  if (MonotonicSeconds() < slot.extend_s) return true;
  const auto held = queue_.Extend(*connection_, slot.job);
  if (!held) {
    Disconnect(held.error());
    return true;
  }
  slot.extend_s = MonotonicSeconds() + kLeasePart * options_.lease_s;
  if (!*held) LogJobLost(slot);
  return *held;
}

void Worker::GiveUp(Slot& slot, const std::string& reason) {
  const auto last = queue_.Fail(*connection_, slot.job, reason);
  if (!last) {
    Disconnect(last.error());
    return;
  }
  ++failed_;
  empty_ = empty_ && *last;  // unless it was the last attempt, the job can be taken again
  log_({Event::kWorkerJobFailed,
        fmt::format("job {} ({}), attempt {}: {}{}", slot.job.job, slot.job.kind, slot.job.attempt,
                    reason, *last ? "; marked as failed" : "")});
}

void Worker::LogJobLost(const Slot& slot) const {
  log_({Event::kWorkerJobLost, fmt::format("job {}: taken by another worker", slot.job.job)});
}

}  // namespace plumbline::plant
