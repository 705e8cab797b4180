#include "app/base/log/catalogue_parts.h"

namespace plumbline::log {
namespace {

constexpr EventEntry kWorkerEntries[] = {
    {Event::kWorkerStarted, "worker-started", LogLevel::kNotice, "8de37b113a524e8aa59dd961e1b161ff",
     "worker", "plumbline plant worker NAME, N jobs at a time",
     "jobs of the plant are done here from now on", ""},
    {Event::kWorkerDatabaseLost, "worker-database-lost", LogLevel::kWarning,
     "7cd6c531899542b8b3771b41293f0b6a", "worker", "database: ...; running jobs continue",
     "the connection is tried again; answers are stored when the database answers, unless another "
     "worker has taken the job meanwhile",
     "as the line says; after an update `plumbline plant init`"},
    {Event::kWorkerDatabaseUp, "worker-database-up", LogLevel::kNotice,
     "2014d4ac964447aea712f094e0abf892", "worker", "database connected", "", ""},
    {Event::kWorkerJobFailed, "worker-job-failed", LogLevel::kWarning,
     "3150128c461d4209ad43a1de4c56c9ee", "worker", "job N (KIND), attempt N: ...",
     "the diagnosis crashed, hung or exceeded its memory; it is tried three times, by any worker, "
     "and then marked as failed with this reason",
     "hung: a longer `--timeout-s`; memory: a larger `--memory-mb`, or fewer rows with `--last` of "
     "`plumbline plant schedule`. A crash: report it with the cell's `plumbline plant export`"},
    {Event::kWorkerJobLost, "worker-job-lost", LogLevel::kWarning,
     "f5684cf13859487d9fb14c4b303c1fcf", "worker", "job N: taken by another worker",
     "this worker could not extend its lease in time; only the other one's answer counts",
     "often: a faster network, or a larger `--lease-s`"},
    {Event::kWorkerJobReturned, "worker-job-returned", LogLevel::kNotice,
     "392b3b766b2d46798703ee8ea7f9b62d", "worker", "job N: handed back",
     "this worker was stopped; another one does the job", ""},
};

}  // namespace

std::span<const EventEntry> WorkerEvents() {
  return kWorkerEntries;
}

}  // namespace plumbline::log
