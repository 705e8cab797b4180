// Which rows of which cells a round of jobs is about.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/plant/jobs/cell_data.h"
#include "app/plant/jobs/job_queue.h"

namespace plumbline::plant {

/// A cell with fewer rows is left out: nothing could be held out of them.
inline constexpr int kMinRows = 20;
/// The newest rows of a cell that a job works on; the diagnosis of so many takes about a minute.
inline constexpr std::int64_t kMaxRows = 4000;

struct WorkSelection {
  std::vector<std::string> cells = {};                  ///< LINE/NODE; empty: all
  std::optional<std::string> arm_model = std::nullopt;  ///< only its cells
  std::int64_t last = kMaxRows;                         ///< rows of a cell at most, the newest
  bool any_model = false;  ///< also rows from before the model in force, which measure the same arm
};

/// Work on one cell: its newest file, and its rows since that model came into force (or all), up to
/// the newest one. Names file and rows, so that the same jobs are found again as long as none is
/// added.
struct CellWork {
  CellName cell;
  nlohmann::json input;
};

struct WorkList {
  std::vector<CellWork> work;         ///< in the order of lines and nodes
  std::vector<std::string> left_out;  ///< "line/node: only 3 rows since ...", one a cell
};

Result<WorkList> FindWork(Connection& connection, const WorkSelection& selection);

/// Adds one job for each cell.
/// @param version  of the program; empty: any
/// @return         the jobs, in the order of `work`
Result<std::vector<std::int64_t>> AddCellJobs(Connection& connection, const std::string& kind,
                                              const std::string& version,
                                              const std::optional<std::string>& arm_model,
                                              const std::vector<CellWork>& work);

/// Where jobs stand.
struct JobProgress {
  int finished = 0, failed = 0, running = 0, waiting = 0;
  bool Ended() const { return running + waiting == 0; }
};
Result<JobProgress> ReadProgress(Connection& connection, const std::vector<std::int64_t>& jobs);

/// Answer of a job.
struct JobAnswer {
  nlohmann::json output;  ///< null if there is none
  std::string failed;     ///< the reason, if it failed
  std::string program;    ///< version of the program that did it
};
/// @return  one element for each of `jobs`
Result<std::vector<JobAnswer>> ReadAnswers(Connection& connection,
                                           const std::vector<std::int64_t>& jobs);

}  // namespace plumbline::plant
