#include "app/cell/journal/row_checksum.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>

#include "app/base/sqlite/database.h"

namespace plumbline::cell {
namespace {

constexpr const char* kMeasurementColumns[] = {"id",
                                               "source",
                                               "unix_ms",
                                               "t_s",
                                               "session",
                                               "command",
                                               "q",
                                               "qd",
                                               "qdd",
                                               "tau",
                                               "payload_kg",
                                               "temp_C",
                                               "predicted_x_mm",
                                               "predicted_y_mm",
                                               "predicted_z_mm",
                                               "x_mm",
                                               "y_mm",
                                               "z_mm",
                                               "range_mm",
                                               "qw",
                                               "qx",
                                               "qy",
                                               "qz",
                                               "model_version",
                                               "wild",
                                               "alarm",
                                               "q_step_deg",
                                               "covariance_mm2",
                                               "quarantine",
                                               "artefact",
                                               "gauge_mm",
                                               "sigma_mm",
                                               "camera",
                                               "tool",
                                               "payload_item",
                                               "predicted_radius_mm"};
constexpr const char* kEpochColumns[] = {"rowid", "utc_s", "unchecked_through"};
constexpr const char* kImportColumns[] = {"id", "file", "content_hash", "rows", "last_row"};
constexpr const char* kRestartColumns[] = {"id", "after_row", "model_version", "reason",
                                           "radius_contradicted"};
constexpr const char* kDecisionColumns[] = {"id", "row", "accepted", "unix_ms"};
constexpr const char* kLostColumns[] = {"id", "first_row", "last_row", "unix_ms"};

struct Hash {
  std::uint64_t value = 0xcbf29ce484222325;
  void Add(const void* data, std::size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (std::size_t k = 0; k < size; ++k) {
      value ^= bytes[k];
      value *= 0x100000001b3;
    }
  }
};

void AddValue(Hash& hash, sqlite3_value* value) {
  const int type = sqlite3_value_type(value);
  hash.Add(&type, sizeof type);
  if (type == SQLITE_INTEGER) {
    const sqlite3_int64 number = sqlite3_value_int64(value);
    hash.Add(&number, sizeof number);
  } else if (type == SQLITE_FLOAT) {
    const double number = sqlite3_value_double(value);
    hash.Add(&number, sizeof number);
  } else if (type != SQLITE_NULL) {
    const void* const bytes = sqlite3_value_blob(value);
    const int size = sqlite3_value_bytes(value);
    hash.Add(&size, sizeof size);
    hash.Add(bytes, static_cast<std::size_t>(size));
  }
}

void RowChecksum(sqlite3_context* context, int count, sqlite3_value** values) {
  Hash hash;
  for (int k = 0; k < count; ++k) AddValue(hash, values[k]);
  sqlite3_result_int64(context, static_cast<sqlite3_int64>(hash.value));
}

std::string ChecksumSql(const SealedTable& table) {
  return fmt::format("row_checksum({})", ColumnsText(table));
}

}  // namespace

const SealedTable kMeasurementTable{"measurement", kMeasurementColumns};
const SealedTable kEpochTable{"epoch", kEpochColumns};
const SealedTable kImportTable{"import", kImportColumns};
const SealedTable kRestartTable{"monitor_restart", kRestartColumns};
const SealedTable kDecisionTable{"quarantine_decision", kDecisionColumns};
const SealedTable kLostTable{"lost_rows", kLostColumns};

std::span<const SealedTable> SealedTables() {
  static const std::array<SealedTable, 6> tables = {kMeasurementTable, kEpochTable,    kImportTable,
                                                    kRestartTable,     kDecisionTable, kLostTable};
  return tables;
}

Result<void> AddChecksumFunction(sqlite::Database& database) {
  const int code = sqlite3_create_function_v2(database.get(), "row_checksum", -1,
                                              SQLITE_UTF8 | SQLITE_DETERMINISTIC, nullptr,
                                              &RowChecksum, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) return sqlite::Failure(database, "cannot be checked");
  return {};
}

std::string ColumnsText(const SealedTable& table) {
  return fmt::format("{}", fmt::join(table.columns, ", "));
}

std::string IntactSql(const SealedTable& table) {
  return fmt::format("coalesce(checksum = {}, 0)", ChecksumSql(table));
}

std::string SealSql(const SealedTable& table, std::string_view where) {
  return fmt::format("UPDATE {} SET checksum = {} WHERE {}", table.name, ChecksumSql(table), where);
}

std::string ChangeSql(const SealedTable& table,
                      std::initializer_list<std::pair<std::string_view, std::string_view>> changes,
                      std::string_view where) {
  std::string set, sealed;
  for (const auto& [column, value] : changes) set += fmt::format("{} = {}, ", column, value);
  for (const std::string_view column : table.columns) {
    std::string_view value = column;
    for (const auto& [changed, now] : changes) {
      if (changed == column) value = now;
    }
    sealed += fmt::format("{}{}", sealed.empty() ? "" : ", ", value);
  }
  return fmt::format("UPDATE {} SET {}checksum = row_checksum({}) WHERE {} AND {}", table.name, set,
                     sealed, where, IntactSql(table));
}

}  // namespace plumbline::cell
