#include "app/cell/journal/journal_schema.h"

#include <fmt/format.h>

#include <iterator>

#include "app/cell/journal/row_checksum.h"

namespace plumbline::cell {
namespace {

constexpr const char* kSchema = R"(
CREATE TABLE measurement (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  source TEXT NOT NULL CHECK (source IN ('plc', 'camera', 'import', 'gauge')),
  unix_ms INTEGER,
  t_s REAL,  -- of probes: UTC since the epoch
  session TEXT NOT NULL, command INTEGER,
  q TEXT NOT NULL, qd TEXT, qdd TEXT, tau TEXT,  -- arrays; deg and Nm, mm and N where prismatic
  payload_kg REAL, temp_C REAL,
  predicted_x_mm REAL, predicted_y_mm REAL, predicted_z_mm REAL,
  x_mm REAL, y_mm REAL, z_mm REAL, range_mm REAL,
  qw REAL, qx REAL, qy REAL, qz REAL,
  model_version INTEGER, wild INTEGER NOT NULL DEFAULT 0, alarm INTEGER NOT NULL DEFAULT 0,
  q_step_deg REAL,  -- of the registers that q was read from; 0: finer than matters
  covariance_mm2 TEXT,  -- of x y z by camera: array of 9 row by row
  quarantine INTEGER NOT NULL DEFAULT 0,  -- 0 none; 1 waits for a person; 2 accepted; 3 rejected
  artefact TEXT, gauge_mm REAL,  -- of rows on artefacts
  sigma_mm REAL,  -- of this row alone
  camera TEXT,  -- that saw it, where it has a name: side, side+rear
  -- numbers, where the cell has several; the 95 % radius that was stated for the prediction; the
  -- checksum of all other columns, see row_checksum.h
  tool INTEGER, payload_item INTEGER, predicted_radius_mm REAL, checksum INTEGER
);
CREATE TABLE epoch (
  -- measurements up to `unchecked_through` have no checksum
  utc_s INTEGER NOT NULL, unchecked_through INTEGER NOT NULL DEFAULT 0, checksum INTEGER
);
INSERT INTO epoch (utc_s) VALUES (CAST(strftime('%s', 'now') AS INTEGER));
CREATE TABLE import (
  id INTEGER PRIMARY KEY, file TEXT NOT NULL, content_hash INTEGER NOT NULL,
  rows INTEGER NOT NULL, last_row INTEGER NOT NULL, checksum INTEGER
);
CREATE TABLE monitor_restart (
  id INTEGER PRIMARY KEY, after_row INTEGER NOT NULL, model_version INTEGER NOT NULL,
  reason TEXT NOT NULL, radius_contradicted INTEGER NOT NULL DEFAULT 0, checksum INTEGER
);
CREATE INDEX quarantine_waiting ON measurement (id) WHERE quarantine = 1;
CREATE TABLE quarantine_decision (
  id INTEGER PRIMARY KEY, row INTEGER NOT NULL, accepted INTEGER NOT NULL, unix_ms INTEGER NOT NULL,
  checksum INTEGER
);
CREATE TABLE lost_rows (  -- measurements that a salvage could not save
  id INTEGER PRIMARY KEY, first_row INTEGER NOT NULL, last_row INTEGER NOT NULL,
  unix_ms INTEGER NOT NULL, checksum INTEGER
);
)";

/// In schema 1, t_s counted from the machine's boot, and session names ended with it. The wall
/// clock of each probe was stored.
constexpr const char* kFromSchema1 = R"(
ALTER TABLE measurement ADD COLUMN q_step_deg REAL;
CREATE TABLE epoch (utc_s INTEGER NOT NULL);
INSERT INTO epoch SELECT coalesce(min(unix_ms) / 1000, CAST(strftime('%s', 'now') AS INTEGER))
  FROM measurement WHERE source = 'plc';
UPDATE measurement SET t_s = unix_ms / 1000.0 - (SELECT utc_s FROM epoch)
  WHERE source = 'plc' AND unix_ms IS NOT NULL;
UPDATE measurement SET session = substr(session, 1, length(session) - 14)
  WHERE source = 'plc' AND session LIKE '% boot ________';
UPDATE measurement SET session = '' WHERE source = 'plc' AND session LIKE 'boot ________';
PRAGMA user_version = 2;
)";

/// Schema 2 had no camera probes.
constexpr const char* kFromSchema2 = R"(
ALTER TABLE measurement ADD COLUMN covariance_mm2 TEXT;
PRAGMA user_version = 3;
)";

/// Schema 3 supported one camera only.
constexpr const char* kFromSchema3 = R"(
ALTER TABLE measurement ADD COLUMN camera TEXT;
PRAGMA user_version = 4;
)";

/// Schema 4 had no quarantine.
constexpr const char* kFromSchema4 = R"(
ALTER TABLE measurement ADD COLUMN quarantine INTEGER NOT NULL DEFAULT 0;
CREATE INDEX quarantine_waiting ON measurement (id) WHERE quarantine = 1;
CREATE TABLE quarantine_decision (
  id INTEGER PRIMARY KEY, row INTEGER NOT NULL, accepted INTEGER NOT NULL, unix_ms INTEGER NOT NULL
);
PRAGMA user_version = 5;
)";

/// Schema 5 had no rows on artefacts, and no uncertainty of single rows.
constexpr const char* kFromSchema5 = R"(
ALTER TABLE measurement ADD COLUMN artefact TEXT;
ALTER TABLE measurement ADD COLUMN gauge_mm REAL;
ALTER TABLE measurement ADD COLUMN sigma_mm REAL;
PRAGMA user_version = 6;
)";

/// Schema 6 had no gauges with a button. The constraint of `source` is changed in the stored
/// statement, as sqlite.org/lang_altertable.html describes: copying the table would need as much
/// space again.
constexpr const char* kFromSchema6 = R"(
PRAGMA writable_schema = ON;
UPDATE sqlite_schema SET sql = replace(sql, '''import'')', '''import'', ''gauge'')')
  WHERE type = 'table' AND name = 'measurement';
PRAGMA writable_schema = RESET;
PRAGMA user_version = 7;
)";

/// Schema 7 had one tool and no payload items.
constexpr const char* kFromSchema7 = R"(
ALTER TABLE measurement ADD COLUMN tool INTEGER;
ALTER TABLE measurement ADD COLUMN payload_item INTEGER;
PRAGMA user_version = 8;
)";

/// Schema 8 had no checksums; its measurements remain without.
constexpr const char* kFromSchema8 = R"(
ALTER TABLE measurement ADD COLUMN predicted_radius_mm REAL;
ALTER TABLE measurement ADD COLUMN checksum INTEGER;
ALTER TABLE epoch ADD COLUMN unchecked_through INTEGER NOT NULL DEFAULT 0;
ALTER TABLE epoch ADD COLUMN checksum INTEGER;
UPDATE epoch SET unchecked_through = (SELECT coalesce(max(id), 0) FROM measurement);
ALTER TABLE import ADD COLUMN checksum INTEGER;
ALTER TABLE monitor_restart ADD COLUMN radius_contradicted INTEGER NOT NULL DEFAULT 0;
ALTER TABLE monitor_restart ADD COLUMN checksum INTEGER;
ALTER TABLE quarantine_decision ADD COLUMN checksum INTEGER;
CREATE TABLE lost_rows (
  id INTEGER PRIMARY KEY, first_row INTEGER NOT NULL, last_row INTEGER NOT NULL,
  unix_ms INTEGER NOT NULL, checksum INTEGER
);
PRAGMA user_version = 9;
)";

/// Conversions in order: the n-th from schema n + 1.
constexpr const char* kConversions[] = {kFromSchema1, kFromSchema2, kFromSchema3, kFromSchema4,
                                        kFromSchema5, kFromSchema6, kFromSchema7, kFromSchema8};
static_assert(std::size(kConversions) == kJournalSchema - 1);

/// Checks that the conversion from schema 6 changed the constraint, and makes other connections
/// read the changed statement.
Result<void> FinishSourceChange(sqlite::Database& database) {
  const Result<std::int64_t> changed = database.IntegerOf(
      "SELECT count(*) FROM sqlite_schema WHERE name = 'measurement' AND sql LIKE '%''gauge''%'");
  if (!changed) return changed.failure();
  if (*changed != 1) {
    return Error{
        "its table `measurement` was not made by plumbline, and cannot be converted to this "
        "schema: restore the journal from the backup, or move it away to start a new one"};
  }
  const Result<std::int64_t> cookie = database.IntegerOf("PRAGMA schema_version");
  if (!cookie) return cookie.failure();
  if (!database.Run(fmt::format("PRAGMA schema_version = {}", *cookie + 1).c_str())) {
    return sqlite::Failure(database, "cannot be converted to this schema");
  }
  return {};
}

}  // namespace

Result<void> MigrateSchema(sqlite::Database& database) {
  Result<std::int64_t> version = database.IntegerOf("PRAGMA user_version");
  if (!version) return version.failure();
  if (*version == kJournalSchema) return {};
  const char* const failed =
      *version == 0 ? "cannot be created" : "cannot be converted to this schema";
  const auto problem = [&] { return sqlite::Failure(database, failed); };
  sqlite::Transaction transaction(database);
  if (!transaction.begun()) return problem();
  version =
      database.IntegerOf("PRAGMA user_version");  // another process may have created it meanwhile
  if (!version) return version.failure();
  if (*version == 0 && (!database.Run(kSchema) || !database.Run(kJournalIdentity.Mark().c_str()))) {
    return problem();
  }
  for (std::int64_t from = *version; from >= 1 && from < kJournalSchema; ++from) {
    if (!database.Run(kConversions[from - 1])) return problem();
  }
  if (*version != 0) {
    if (const Result<void> changed = FinishSourceChange(database); !changed) {
      return changed.failure();
    }
  }
  for (const SealedTable& table : SealedTables().subspan(1)) {
    if (!database.Run(SealSql(table, "checksum IS NULL").c_str())) return problem();
  }
  if (!transaction.Commit()) return problem();
  return {};
}

}  // namespace plumbline::cell
