// Queue of jobs in the database, shared by any number of workers.
//
// A worker that takes a job holds a lease, which it extends while it works. A lease that expires,
// because the worker, its machine or its network failed, makes the job available to others. The
// number of the attempt is the fence: whoever has lost a job can neither extend nor finish it. All
// times are those of the database's clock.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/plant/database/connection.h"

namespace plumbline::plant {

/// After so many attempts that failed, or whose worker vanished, a job is marked as failed.
inline constexpr int kMaxAttempts = 3;

/// A job to be added.
struct NewJob {
  std::string kind;  ///< "diagnose", "compare" or "prior"
  std::optional<int> cell;
  std::optional<std::string> arm_model;
  std::string version;   ///< of the program that is to do it; empty: any
  nlohmann::json input;  ///< which file and rows of the cell
};

/// Adds those that do not exist: kind, cell, input and version identify a job.
/// @return  the number of each, also of those that existed
Result<std::vector<std::int64_t>> AddJobs(Connection& connection, std::span<const NewJob> jobs);

/// A job that a worker has taken.
struct TakenJob {
  std::int64_t job = 0;
  int attempt = 0;  ///< the fence
  std::string kind, version;
  std::optional<int> cell;
  nlohmann::json input;
};

/// What a worker did.
struct JobResult {
  std::string program;  ///< version of the program that did it
  double seconds = 0;
  std::string output;  ///< JSON
};

/// The queue as seen by one worker. Holds no connection: the caller replaces a lost one.
class JobQueue {
 public:
  /// @param worker    unique: of a process, not of a machine
  /// @param lease_s   how long a job is held without being extended
  /// @param versions  of the programs that this worker has
  JobQueue(std::string worker, double lease_s, const std::vector<std::string>& versions);

  /// The next job that no one holds; nullopt if there is none. Jobs that were tried before come
  /// last. Marks as failed those whose workers vanished kMaxAttempts times.
  Result<std::optional<TakenJob>> Take(Connection& connection) const;
  /// @return  whether the job is still this worker's
  Result<bool> Extend(Connection& connection, const TakenJob& job) const;
  /// Stores the result and ends the job, in one transaction.
  /// @return  false if the job was no longer this worker's; nothing is stored then
  Result<bool> Finish(Connection& connection, const TakenJob& job, const JobResult& result) const;
  /// Records the reason, and makes the job available again unless it was the last attempt.
  /// @return  whether the job ended: it was the last attempt
  Result<bool> Fail(Connection& connection, const TakenJob& job, const std::string& reason) const;
  /// Makes the job available at once, without counting the attempt.
  Result<void> HandBack(Connection& connection, const TakenJob& job) const;

  const std::string& worker() const { return worker_; }

 private:
  std::string worker_;
  double lease_s_;
  std::string versions_;  ///< an array literal
};

}  // namespace plumbline::plant
