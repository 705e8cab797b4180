#include "app/plant/jobs/job_queue.h"

#include <fmt/format.h>

#include "app/base/text/json_text.h"
#include "app/base/text/sha256.h"

namespace plumbline::plant {
namespace {

/// The inner statement finds jobs that exist already: a conflict that changes nothing does not
/// return them.
constexpr const char* kAdd = R"sql(
WITH wanted AS (
  SELECT * FROM unnest($1::text[], $2::int[], $3::text[], $4::text[], $5::text[], $6::jsonb[])
    WITH ORDINALITY AS w (kind, cell, arm_model, version, key, input, place)
), added AS (
  INSERT INTO job (kind, cell, arm_model, version, key, input)
  SELECT kind, cell, arm_model, version, key, input FROM wanted ORDER BY place
  -- A failure may have been that of a machine: who asks again gets it tried again.
  ON CONFLICT (kind, key) DO UPDATE SET finished = NULL, attempts = 0, lease_until = NULL
    WHERE job.finished IS NOT NULL AND job.failed IS NOT NULL
  RETURNING job, kind, key
)
SELECT coalesce(added.job, job.job)
FROM wanted LEFT JOIN added USING (kind, key) LEFT JOIN job USING (kind, key) ORDER BY place
)sql";

constexpr const char* kGiveUp = R"sql(
UPDATE job SET finished = now(), lease_until = NULL,
  failed = coalesce(failed || '; ', '') || 'last taken by ' || worker || ', which vanished'
WHERE job IN (
  SELECT job FROM job WHERE finished IS NULL AND attempts >= $1 AND lease_until < now()
  FOR UPDATE SKIP LOCKED)
)sql";

constexpr const char* kTake = R"sql(
UPDATE job SET worker = $1, lease_until = now() + $2 * interval '1 second', attempts = attempts + 1
WHERE job = (
  SELECT job FROM job
  WHERE finished IS NULL AND attempts < $3 AND (lease_until IS NULL OR lease_until < now())
    AND (version = '' OR version = ANY($4::text[]))
  ORDER BY attempts, job LIMIT 1 FOR UPDATE SKIP LOCKED)
RETURNING job, attempts, kind, version, cell, input
)sql";

constexpr const char* kExtend = R"sql(
UPDATE job SET lease_until = now() + $4 * interval '1 second'
WHERE job = $1 AND worker = $2 AND attempts = $3 AND finished IS NULL
)sql";

/// One statement is one transaction: the fence, the end of the job and its result.
constexpr const char* kFinish = R"sql(
WITH ended AS (
  UPDATE job SET finished = now(), failed = NULL, lease_until = NULL
  WHERE job = $1 AND worker = $2 AND attempts = $3 AND finished IS NULL RETURNING job
)
INSERT INTO result (job, worker, program, seconds, output)
SELECT job, $2, $4, $5, $6::jsonb FROM ended ON CONFLICT (job) DO NOTHING
)sql";

constexpr const char* kFail = R"sql(
UPDATE job SET failed = $4, lease_until = NULL,
  worker = CASE WHEN attempts >= $5 THEN worker END,
  finished = CASE WHEN attempts >= $5 THEN now() END
WHERE job = $1 AND worker = $2 AND attempts = $3 AND finished IS NULL RETURNING finished IS NOT NULL
)sql";

constexpr const char* kHandBack = R"sql(
UPDATE job SET worker = NULL, lease_until = NULL, attempts = attempts - 1
WHERE job = $1 AND worker = $2 AND attempts = $3 AND finished IS NULL
)sql";

/// The same work has the same key: members of an object are sorted.
std::string KeyOf(const NewJob& job) {
  return fmt::format("{} {} {}", job.cell.value_or(0), text::Sha256Hex(text::JsonText(job.input)),
                     job.version);
}

}  // namespace

Result<std::vector<std::int64_t>> AddJobs(Connection& connection, std::span<const NewJob> jobs) {
  ArrayText kinds, cells, models, versions, keys, inputs;
  for (const NewJob& job : jobs) {
    kinds.Add(job.kind);
    cells.Add(job.cell);
    models.Add(job.arm_model);
    versions.Add(job.version);
    keys.Add(KeyOf(job));
    inputs.Add(text::JsonText(job.input));
  }
  const auto added = connection.Run(kAdd, {kinds.Text(), cells.Text(), models.Text(),
                                           versions.Text(), keys.Text(), inputs.Text()});
  if (!added) return added.failure();
  std::vector<std::int64_t> numbers;
  for (int k = 0; k < added->size(); ++k) {
    // Added by another session since this statement began: found when it is repeated.
    if (added->IsNull(k, 0)) return AddJobs(connection, jobs);
    numbers.push_back(added->Integer(k, 0));
  }
  return numbers;
}

JobQueue::JobQueue(std::string worker, double lease_s, const std::vector<std::string>& versions)
    : worker_(std::move(worker)), lease_s_(lease_s) {
  ArrayText array;
  for (const std::string& version : versions) array.Add(version);
  versions_ = array.Text();
}

Result<std::optional<TakenJob>> JobQueue::Take(Connection& connection) const {
  const auto given_up = connection.Run(kGiveUp, {kMaxAttempts});
  if (!given_up) return given_up.failure();
  const auto taken = connection.Run(kTake, {worker_, lease_s_, kMaxAttempts, versions_});
  if (!taken) return taken.failure();
  if (taken->empty()) return std::optional<TakenJob>();
  TakenJob job{taken->Integer(0, 0),
               static_cast<int>(taken->Integer(0, 1)),
               std::string(taken->Text(0, 2)),
               std::string(taken->Text(0, 3)),
               std::nullopt,
               text::JsonOrNull(taken->Text(0, 5))};
  if (!taken->IsNull(0, 4)) job.cell = static_cast<int>(taken->Integer(0, 4));
  return std::optional(job);
}

Result<bool> JobQueue::Extend(Connection& connection, const TakenJob& job) const {
  return connection.Run(kExtend, {job.job, worker_, job.attempt, lease_s_})
      .transform([](const Rows& rows) { return rows.changed() > 0; });
}

Result<bool> JobQueue::Finish(Connection& connection, const TakenJob& job,
                              const JobResult& result) const {
  return connection
      .Run(kFinish, {job.job, worker_, job.attempt, result.program, result.seconds, result.output})
      .transform([](const Rows& rows) { return rows.changed() > 0; });
}

Result<bool> JobQueue::Fail(Connection& connection, const TakenJob& job,
                            const std::string& reason) const {
  return connection.Run(kFail, {job.job, worker_, job.attempt, reason, kMaxAttempts})
      .transform([](const Rows& rows) { return !rows.empty() && rows.Bool(0, 0); });
}

Result<void> JobQueue::HandBack(Connection& connection, const TakenJob& job) const {
  return connection.Run(kHandBack, {job.job, worker_, job.attempt}).transform([](const Rows&) {});
}

}  // namespace plumbline::plant
