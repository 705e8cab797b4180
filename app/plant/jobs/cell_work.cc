#include "app/plant/jobs/cell_work.h"

#include <fmt/format.h>

#include <map>

#include "app/base/text/json_text.h"

namespace plumbline::plant {
namespace {

using nlohmann::json;

/// One row a cell. `since` is when the newest model came into force, NULL if no other was seen.
constexpr const char* kFind = R"sql(
SELECT c.cell, c.line, c.node, f.utc, f.fingerprint, s.since, n.until, n.rows
FROM cell c
LEFT JOIN LATERAL (
  SELECT utc, fingerprint, model FROM cell_file WHERE cell = c.cell ORDER BY utc DESC LIMIT 1
) f ON true
LEFT JOIN LATERAL (
  SELECT min(utc) AS since FROM cell_file
  WHERE cell = c.cell AND NOT $4 AND utc > (SELECT max(utc) FROM cell_file
                                 WHERE cell = c.cell AND model IS DISTINCT FROM f.model)
) s ON true
LEFT JOIN LATERAL (
  SELECT max(utc) AS until, count(*) AS rows FROM (
    SELECT utc FROM probe
    WHERE cell = c.cell AND q IS NOT NULL AND NOT quarantined
      AND utc >= coalesce(s.since, '-infinity')
    ORDER BY utc DESC LIMIT $3) newest
) n ON true
WHERE (cardinality($1::text[]) = 0 OR c.line || '/' || c.node = ANY($1))
  AND ($2::text IS NULL OR c.arm_model = $2)
ORDER BY c.line, c.node
)sql";

constexpr const char* kProgress = R"sql(
SELECT count(*) FILTER (WHERE finished IS NOT NULL AND failed IS NULL),
       count(*) FILTER (WHERE finished IS NOT NULL AND failed IS NOT NULL),
       count(*) FILTER (WHERE finished IS NULL AND lease_until >= now()),
       count(*) FILTER (WHERE finished IS NULL AND (lease_until IS NULL OR lease_until < now()))
FROM job WHERE job = ANY($1::bigint[])
)sql";

std::string ArrayOf(const std::vector<std::int64_t>& jobs) {
  ArrayText array;
  for (const std::int64_t job : jobs) array.Add(job);
  return array.Text();
}

std::string WhyLeftOut(const Rows& rows, int k) {
  if (rows.IsNull(k, 3)) return "has not published its cell.toml";
  const std::int64_t count = rows.Integer(k, 7);
  const std::string since =
      rows.IsNull(k, 5) ? "" : fmt::format(" since its model changed at {}", rows.Text(k, 5));
  return fmt::format("{} rows{}, at least {} are needed", count, since, kMinRows);
}

}  // namespace

Result<WorkList> FindWork(Connection& connection, const WorkSelection& selection) {
  ArrayText wanted;
  for (const std::string& cell : selection.cells) {
    const auto known = FindCell(connection, cell);
    if (!known) return known.failure();
    wanted.Add(cell);
  }
  const auto found = connection.Run(
      kFind, {wanted.Text(), selection.arm_model, selection.last, selection.any_model});
  if (!found) return found.failure();
  WorkList list;
  for (int k = 0; k < found->size(); ++k) {
    const CellName cell{static_cast<int>(found->Integer(k, 0)), std::string(found->Text(k, 1)),
                        std::string(found->Text(k, 2))};
    if (found->IsNull(k, 3) || found->Integer(k, 7) < kMinRows) {
      list.left_out.push_back(fmt::format("{}: {}", cell.Text(), WhyLeftOut(*found, k)));
      continue;
    }
    json input = {{"file_utc", found->Text(k, 3)},
                  {"fingerprint", found->Text(k, 4)},
                  {"until", found->Text(k, 6)},
                  {"last", selection.last}};
    if (!found->IsNull(k, 5)) input["since"] = found->Text(k, 5);
    list.work.push_back({cell, std::move(input)});
  }
  return list;
}

Result<std::vector<std::int64_t>> AddCellJobs(Connection& connection, const std::string& kind,
                                              const std::string& version,
                                              const std::optional<std::string>& arm_model,
                                              const std::vector<CellWork>& work) {
  std::vector<NewJob> jobs;
  for (const CellWork& one : work)
    jobs.push_back({kind, one.cell.cell, arm_model, version, one.input});
  return AddJobs(connection, jobs);
}

Result<JobProgress> ReadProgress(Connection& connection, const std::vector<std::int64_t>& jobs) {
  const auto counted = connection.Run(kProgress, {ArrayOf(jobs)});
  if (!counted) return counted.failure();
  const auto count = [&counted](int column) {
    return static_cast<int>(counted->Integer(0, column));
  };
  return JobProgress{count(0), count(1), count(2), count(3)};
}

Result<std::vector<JobAnswer>> ReadAnswers(Connection& connection,
                                           const std::vector<std::int64_t>& jobs) {
  const auto found = connection.Run(
      "SELECT job.job, output, CASE WHEN finished IS NOT NULL THEN failed END, program"
      " FROM job LEFT JOIN result USING (job) WHERE job.job = ANY($1::bigint[])",
      {ArrayOf(jobs)});
  if (!found) return found.failure();
  std::map<std::int64_t, JobAnswer> by_job;
  for (int k = 0; k < found->size(); ++k) {
    JobAnswer& answer = by_job[found->Integer(k, 0)];
    if (!found->IsNull(k, 1)) answer.output = text::JsonOrNull(found->Text(k, 1));
    answer.failed = found->TextOrNull(k, 2).value_or("");
    answer.program = found->TextOrNull(k, 3).value_or("");
  }
  std::vector<JobAnswer> answers;
  for (const std::int64_t job : jobs) answers.push_back(by_job[job]);
  return answers;
}

}  // namespace plumbline::plant
