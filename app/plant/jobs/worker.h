// Worker: takes jobs from the queue, runs each as a child process, and stores the answers.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/base/log/log_entry.h"
#include "app/plant/jobs/job_queue.h"
#include "app/plant/jobs/job_run.h"

namespace plumbline::plant {

struct WorkerOptions {
  std::string database;              ///< libpq connection string
  std::vector<JobProgram> programs;  ///< the first one also does jobs for any version
  int slots = 1;                     ///< jobs at the same time
  bool once = false;                 ///< end when there is no job left to take
  double lease_s = 60;
  JobLimits limits;
  std::function<void()> heartbeat = {};  ///< called several times a second while it is healthy
};

/// Single-threaded. A lost database is looked for until it answers again; meanwhile the children
/// continue, and their answers are stored if no other worker has taken their jobs.
class Worker {
 public:
  Worker(WorkerOptions options, log::LogSink log);
  ~Worker();

  /// Runs until `stop` is readable (SIGTERM), or, with `once`, until the queue is empty; children
  /// that still run are then killed and their jobs handed back.
  /// @param stop  descriptor, not read; -1: none
  void Run(int stop);
  /// Whether jobs could ever be asked for. With `once`, the worker ends where they cannot.
  bool was_usable() const { return was_usable_; }

  const std::string& name() const { return queue_.worker(); }

  int answered() const { return answered_; }  ///< jobs whose answer was stored
  int failed() const { return failed_; }      ///< attempts that failed

 private:
  struct Slot;
  bool Connected();
  /// Without this, the next call of Connected() opens another connection.
  void Disconnect(const std::string& why);
  void FillSlots();
  bool StartNext();
  void ServeSlots();
  /// @return  whether the slot is free again
  bool Deliver(Slot& slot);
  bool ExtendLease(Slot& slot);
  void GiveUp(Slot& slot, const std::string& reason);
  void LogJobLost(const Slot& slot) const;
  const JobProgram& ProgramFor(const std::string& version) const;

  const WorkerOptions options_;
  const log::LogSink log_;
  const JobQueue queue_;
  std::optional<Connection> connection_;
  std::vector<Slot> slots_;
  bool was_usable_ = false;
  std::optional<bool> usable_;  ///< whether the database did what was asked; nullopt at the start
  bool empty_ = false;          ///< no job was left at the last attempt to take one
  double retry_s_ = 0;          ///< when to open the next connection
  double pause_s_ = 0;          ///< before the one after that
  double ask_s_ = 0;            ///< when to ask the queue again
  int answered_ = 0, failed_ = 0;
};

/// Unique name of this process among all workers: host, process and a random number.
std::string WorkerName();

}  // namespace plumbline::plant
