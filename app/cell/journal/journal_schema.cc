#include "app/cell/journal/journal_schema.h"

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
  -- unchecked_through: always 0
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

}  // namespace

Result<void> CreateSchema(sqlite::Database& database) {
  const auto problem = [&] { return sqlite::Failure(database, "cannot be created"); };
  sqlite::Transaction transaction(database);
  if (!transaction.begun()) return problem();
  // Another process may have created it meanwhile.
  const Result<std::int64_t> version = database.IntegerOf("PRAGMA user_version");
  if (!version) return version.failure();
  if (*version != 0) return {};
  const bool created = database.Run(kSchema) && database.Run(kJournalIdentity.Mark().c_str()) &&
                       database.Run(SealSql(kEpochTable, "checksum IS NULL").c_str());
  if (!created || !transaction.Commit()) return problem();
  return {};
}

}  // namespace plumbline::cell
