// Cells and probes put into a plant's database, as the collector would.
#pragma once

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "app/base/config/cell_reader.h"
#include "app/cell/journal/journal_csv.h"
#include "app/plant/database/connection.h"
#include "app/plant/jobs/cell_data.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/model/joint_columns.h"
#include "tests/file_text.h"

namespace plumbline::test {

inline constexpr std::int64_t kEpoch = 1'790'000'000;  ///< of the cells' journals, UTC [s]

inline plant::CellName AddCell(plant::Connection& owner, const std::string& line,
                               const std::string& node, const std::string& toml,
                               const std::string& arm_model = "UR10") {
  const auto added =
      owner.Run("INSERT INTO cell (line, node, arm_model) VALUES ($1, $2, $3) RETURNING cell",
                {line, node, arm_model});
  REQUIRE(added.ok());
  const plant::CellName cell{static_cast<int>(added->Integer(0, 0)), line, node};
  REQUIRE(owner
              .Run("INSERT INTO cell_file (cell, utc, fingerprint, model, toml)"
                   " VALUES ($1, to_timestamp($2), 'first', 1, $3)",
                   {cell.cell, kEpoch, toml})
              .ok());
  return cell;
}

/// Stores rows as probes, one a minute after the newest of `from` minutes.
inline void AddProbes(plant::Connection& owner, const plant::CellName& cell,
                      const std::vector<cell::JournalRow>& rows,
                      const std::vector<model::Joint>& joints, std::int64_t first_id = 1) {
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto id = first_id + static_cast<std::int64_t>(k);
    plant::ArrayText q;
    for (std::size_t i = 0; i < joints.size(); ++i) {
      q.Add(rows[k].q[static_cast<Eigen::Index>(i)] * model::PositionForm(joints[i].type).from_SI);
    }
    const Vec3 tip_mm = *rows[k].measured_W * kMmPerMetre;
    REQUIRE(owner.Run("SELECT ensure_month(to_timestamp($1))", {kEpoch + 60 * id}).ok());
    REQUIRE(
        owner
            .Run("INSERT INTO probe (cell, stream, seq, utc, journal, id, model, x_mm, y_mm,"
                 " z_mm, payload_kg, temp_c, wild, alarm, quarantined, source, session, q, more)"
                 " VALUES ($1, 1, $2, to_timestamp($3), $4, $2, 1, $5, $6, $7, $8, $9, false,"
                 " false, false, 'plc', 'boot', $10::float8[], $11::jsonb)",
                 {cell.cell, id, kEpoch + 60 * id, kEpoch, tip_mm.x(), tip_mm.y(), tip_mm.z(),
                  rows[k].payload_kg, rows[k].temp_C, q.Text(),
                  "{\"t_s\": " + std::to_string(60 * id) + ".25}"})
            .ok());
  }
}

/// The joints of a valid cell file.
inline std::vector<model::Joint> JointsOf(const std::string& toml) {
  config::FaultList faults;
  const auto cell = config::CellFromText(toml, "cell.toml", faults);
  REQUIRE(cell);
  return cell->robot.joints;
}

/// Rows at distinct poses, for tests whose child does not compute.
inline std::vector<cell::JournalRow> AnyRows(int count, std::size_t joints) {
  std::vector<cell::JournalRow> rows(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k) {
    cell::JournalRow& row = rows[static_cast<std::size_t>(k)];
    row.q = model::JointVector::Constant(static_cast<Eigen::Index>(joints), 0.01 * k);
    row.measured_W = Vec3(0.5, 0.001 * k, 0.25);
    row.payload_kg = 2.5;
  }
  return rows;
}

}  // namespace plumbline::test
