#include "app/plant/jobs/cell_data.h"

#include <catch2/catch.hpp>
#include <sstream>

#include "app/base/text/json_text.h"
#include "app/measure/table/csv.h"
#include "app/plant/jobs/cell_work.h"
#include "tests/app/plant/database/postgres_process.h"
#include "tests/app/plant/jobs/plant_cells.h"

namespace plumbline::plant::cell_data_test {

TEST_CASE("further columns of a probe are read whatever they contain") {
  std::vector<model::Joint> joints(2);
  joints[1].type = model::JointType::kPrismatic;
  cell::JournalRow row;
  AddFurtherColumns(text::JsonOrNull(R"({"t_s": 12.5, "tool": 3, "payload_item": 0,
      "sigma_mm": 0.05, "camera": "side", "q_step_deg": 0.01, "qd": [180, 5], "tau": [1, 2, 3],
      "range_mm": 1500, "orientation": [1, 0, 0, 0], "other": [1]})"),
                    joints, row);
  CHECK(row.t_s == 12.5);
  CHECK(row.tool_number == 3);
  CHECK(row.payload_item == 0);
  CHECK(*row.sigma_m == Approx(5e-5));
  CHECK(row.camera == "side");
  REQUIRE(row.qd.size() == 2);
  CHECK(row.qd[0] == Approx(3.14159265));
  CHECK(row.qd[1] == Approx(0.005));
  CHECK(row.tau.size() == 0);  // of another number of joints
  CHECK(row.range_m == 1.5);
  CHECK(row.orientation_W->w() == 1);
  for (const char* text : {"null", "[]", "7", R"({"t_s": "x", "tool": 1e300, "camera": 3})",
                           R"({"payload_item": 9999999999, "sigma_mm": []})",
                           R"({"qd": ["a", 1], "orientation": [1, 0, 0, null], "tau": {}})"}) {
    cell::JournalRow none;
    AddFurtherColumns(text::JsonOrNull(text), joints, none);
    CHECK_FALSE(none.t_s);
    CHECK_FALSE(none.tool_number);
    CHECK_FALSE(none.payload_item);
    CHECK_FALSE(none.sigma_m);
    CHECK(none.camera.empty());
  }
}

TEST_CASE("a cell's rows leave the database as its journal exports them") {
  if (test::PostgresPrograms().empty()) {
    WARN("SKIPPED: no PostgreSQL 15 here");
    return;
  }
  const test::PostgresProcess server;
  Connection owner = server.ConnectToNewPlant();
  const std::string toml = test::FileText("config/cells/ur10.toml");
  const auto joints = test::JointsOf(toml);
  const CellName cell = test::AddCell(owner, "line-1", "cell-1", toml);
  auto rows = test::AnyRows(40, joints.size());
  test::AddProbes(owner, cell, rows, joints);

  const CellName found = FindCell(owner, "line-1/cell-1").value();
  CHECK(found.cell == cell.cell);
  CHECK_FALSE(FindCell(owner, "line-1/cell-2").ok());
  CHECK(FindCell(owner, "cell-2").error().find("line-1/cell-1") != std::string::npos);
  CHECK(ReadCellFile(owner, cell)->toml == toml);

  for (std::size_t k = 0; k < rows.size(); ++k) {
    rows[k].session = "boot";
    rows[k].t_s = 60 * static_cast<double>(k + 1) + 0.25;
  }
  const CellRows all = ReadCellRows(owner, cell, toml, {}).value();
  CHECK(all.rows == 40);
  CHECK(all.csv == cell::CsvFromJournal(rows, joints).text);
  CHECK(all.time_zero_utc_s == test::kEpoch);
  config::FaultList faults;
  REQUIRE(measure::TableFromCsv(all.csv, "measured.csv", joints, faults));

  RowSelection newest{.last = 5};
  CHECK(ReadCellRows(owner, cell, toml, newest)->rows == 5);
  CHECK(ReadCellRows(owner, cell, toml, {.until = "2026-09-21T14:16:40Z"})->rows == 3);
  CHECK(ReadCellRows(owner, cell, toml, {.since = "2026-09-21T14:16:40Z"})->rows == 37);
  CHECK_FALSE(ReadCellRows(owner, cell, toml, {.model = 2}).ok());

  // A row that was published twice counts once; one in quarantine only if asked for.
  REQUIRE(owner
              .RunScript("INSERT INTO probe SELECT cell, 2, seq, utc, journal, id, model, x_mm,"
                         " y_mm, z_mm, dx_mm, dy_mm, dz_mm, size_mm, payload_kg, temp_c, wild,"
                         " alarm, quarantined, source, session, q, more FROM probe WHERE id = 40;"
                         "UPDATE probe SET quarantined = true WHERE id = 39")
              .ok());
  CHECK(ReadCellRows(owner, cell, toml, {})->rows == 39);
  CHECK(ReadCellRows(owner, cell, toml, {.quarantined = true})->rows == 40);

  // After a new journal, t_s continues to count from the oldest epoch.
  REQUIRE(owner
              .RunScript("UPDATE probe SET journal = journal + 1200, more = '{\"t_s\": 0.5}'"
                         " WHERE id = 40")
              .ok());
  const CellRows two = ReadCellRows(owner, cell, toml, {.last = 3}).value();
  CHECK(two.csv.find("1200.500000") != std::string::npos);

  // Work on a cell: from its newest model on.
  WorkList list = FindWork(owner, {}).value();
  REQUIRE(list.work.size() == 1);
  CHECK_FALSE(list.work.front().input.contains("since"));
  REQUIRE(owner
              .Run("INSERT INTO cell_file VALUES ($1, to_timestamp($2), 'second', 2, $3)",
                   {cell.cell, test::kEpoch + 60 * 15, toml})
              .ok());
  list = FindWork(owner, {}).value();
  REQUIRE(list.work.size() == 1);
  CHECK(list.work.front().input["since"] == "2026-09-21 14:28:20+00");
  CHECK(FindWork(owner, {.arm_model = "other"})->work.empty());
  REQUIRE(
      owner.RunScript("UPDATE cell_file SET utc = utc + interval '10 min' WHERE model = 2").ok());
  list = FindWork(owner, {}).value();
  CHECK(list.work.empty());
  REQUIRE(list.left_out.size() == 1);
  CHECK(list.left_out.front().find("line-1/cell-1: 16 rows") == 0);
}

}  // namespace plumbline::plant::cell_data_test
