#include "app/plant/publish/probe_tail.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "app/cell/journal/journal_schema.h"
#include "app/cell/journal/row_checksum.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::plant {
namespace {

/// The last column: whether the row is as it was written.
const std::string& ProbesBehindSql() {
  static const std::string sql =
      "SELECT id, unix_ms, source, session, model_version, x_mm, y_mm, z_mm, predicted_x_mm,"
      " predicted_y_mm, predicted_z_mm, payload_kg, temp_C, wild, alarm,"
      " quarantine, " +
      cell::IntactSql(cell::kMeasurementTable) +
      " FROM measurement"
      " WHERE id > ? AND id <= ? ORDER BY id LIMIT ?";
  return sql;
}

ProbeRow ProbeFrom(const sqlite::Statement& row, std::int64_t journal) {
  const auto point = [&row](int column) -> Vec3 {
    return kMetrePerMm * Vec3(row.Number(column), row.Number(column + 1), row.Number(column + 2));
  };
  ProbeRow probe;
  probe.journal = journal;
  probe.id = row.Integer(0);
  probe.unix_ms = row.Integer(1);
  probe.source = cell::SourceNamed(row.Text(2));
  probe.session = row.Text(3);
  probe.model_version = static_cast<int>(row.Integer(4));
  probe.measured_W = point(5);
  probe.predicted_W = point(8);
  probe.payload_kg = row.OptionalNumberAt(11);
  probe.temp_C = row.OptionalNumberAt(12);
  probe.wild = row.Integer(13) != 0;
  probe.alarm = row.Integer(14) != 0;
  probe.quarantine = static_cast<cell::JournalRow::Quarantine>(row.Integer(15));
  return probe;
}

/// Whether the row has a residual and a known time.
bool IsProbe(const sqlite::Statement& row) {
  return row.Text(2) != "import" && !row.IsNull(1) && !row.IsNull(5) && !row.IsNull(8);
}

}  // namespace

Result<ProbeTail::Taken> ProbeTail::ReadNew(const std::optional<ProbeMark>& mark) {
  std::error_code unknown;
  if (!std::filesystem::exists(path_, unknown)) {
    // All rows of a journal that is created later are new.
    settled_ = {};
    return Taken{{}, mark.value_or(ProbeMark{})};
  }
  Result<sqlite::Database> opened = sqlite::Database::Open(path_, sqlite::Database::Mode::kRead);
  if (!opened) return Error{opened.error()};
  sqlite::Database& database = opened.value();
  if (const Result<void> added = cell::AddChecksumFunction(database); !added)
    return added.failure();
  const auto current = sqlite::RequireCurrentSchema(database, cell::kJournalIdentity);
  if (!current) return current.failure();
  const auto epoch = database.IntegerOf("SELECT utc_s FROM epoch");
  const auto last = database.IntegerOf("SELECT coalesce(max(id), 0) FROM measurement");
  if (!epoch) return Error{epoch.error()};
  if (!last) return Error{last.error()};
  const ProbeMark settled = settled_;
  settled_ = {*epoch, *last};
  if (!mark) return Taken{{}, settled_};
  // A journal restored from a backup may have fewer rows than were already published.
  Taken taken{{}, {*epoch, mark->journal == *epoch ? std::min(mark->id, *last) : 0}};
  if (settled.journal != *epoch) return Taken{{}, taken.mark};  // first call for this journal
  sqlite::Statement rows(database.get(), ProbesBehindSql());
  rows.Bind(1, taken.mark.id);
  rows.Bind(2, settled.id);
  rows.Bind(3, std::int64_t{kMaxRows});
  int code = SQLITE_ROW;
  while ((code = rows.Step()) == SQLITE_ROW) {
    if (rows.Integer(16) == 0) {
      return Error{
          fmt::format("{}: row {} was changed since it was written; `plumbline journal "
                      "salvage` saves the others",
                      path_, rows.Integer(0))};
    }
    if (IsProbe(rows)) taken.probes.push_back(ProbeFrom(rows, *epoch));
    taken.mark.id = rows.Integer(0);
  }
  if (code != SQLITE_DONE) return Error{fmt::format("{}: {}", path_, database.Problem())};
  return taken;
}

}  // namespace plumbline::plant
