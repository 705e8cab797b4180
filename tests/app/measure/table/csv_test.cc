#include "app/measure/table/csv.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>

#include "app/base/config/toml_reader.h"

namespace plumbline::csv_test {

using namespace plumbline::measure;

namespace {

/// A revolute and a prismatic joint.
std::vector<model::Joint> TwoJoints() {
  std::vector<model::Joint> joints(2);
  joints[1].type = model::JointType::kPrismatic;
  return joints;
}

std::optional<MeasuredTable> Read(const std::string& text, config::FaultList& faults) {
  return TableFromCsv(text, "measured.csv", TwoJoints(), faults);
}

TEST_CASE("Rows on artefacts may be mixed with measured points") {
  config::FaultList faults;
  const auto table = Read(
      "q1_deg,q2_mm,x_mm,y_mm,z_mm,artefact,gauge_mm,range_mm,sigma_mm\n"
      "1,2,10,20,30,,,,0.05\n"
      "1,3,,,,socket,,,\n"
      "1,4,,,,dial,-0.25,,0.002\n"
      "1,5,,,,anchor,,812.5,\n"
      "1,6,,,,,,,\n"
      "1,7,,,,socket,,,0\n"
      "1,8,,,,socket,,,1e6\n",
      faults);
  REQUIRE(table);
  CHECK(FaultsText(faults) ==
        "measured.csv:7 sigma_mm: warning: \"0\" is not positive; row not used\n"
        "measured.csv:8 sigma_mm: warning: \"1e6\" is outside 1e-06..100; row not used\n");
  REQUIRE(table->rows.size() == 4);
  CHECK(table->rows[0].sigma_m.value() == Approx(5e-5));
  CHECK(table->rows[0].artefact.empty());
  CHECK(table->rows[1].artefact == "socket");
  CHECK_FALSE((table->rows[1].measured_W || table->rows[1].sigma_m));
  CHECK(table->rows[2].gauge_m.value() == Approx(-2.5e-4));
  CHECK_FALSE(table->rows[3].gauge_m);
  CHECK(table->rows[3].range_m.value() == Approx(0.8125));
  REQUIRE(table->unmeasured.size() == 3);  // they keep their place in the order of moves
  CHECK(table->unmeasured[0].line == 6);
  CHECK(table->unmeasured[1].artefact.empty());
}

TEST_CASE("A row names the camera that measured it, or two whose mean it is") {
  config::FaultList faults;
  const auto table = Read(
      "q1_deg,q2_mm,x_mm,y_mm,z_mm,camera\n"
      "1,2,10,20,30,side\n"
      "1,3,10,20,31,\n"
      "1,4,10,20,32,rear+side\n"
      "1,5,10,20,33,left\n"
      "1,6,10,20,34,top+top\n",
      faults);
  REQUIRE(table);
  CHECK(table->recorded.camera);
  REQUIRE(table->rows.size() == 3);
  CHECK(table->rows[0].camera == "side");
  CHECK(table->rows[1].camera.empty());
  CHECK(table->rows[2].camera == "side+rear");
  CHECK(FaultsText(faults) ==
        "measured.csv:5 camera: warning: \"left\" is not a camera: write side, rear, front or top, "
        "or two of them joined by + for their mean; 2 of 5 rows not used. If the column holds "
        "something else, such as serial numbers, rename it\n");
}

TEST_CASE("Numbers of tools and items may have been written by a spreadsheet") {
  config::FaultList faults;
  const auto table = Read(
      "q1_deg,q2_mm,x_mm,y_mm,z_mm,tool,payload_item\n"
      "1,2,10,20,30,1.0,0\n"
      "1,3,10,20,31,2,7.00\n"
      "1,4,10,20,32,1.5,-1\n"
      "1,5,10,20,33,70000,gripper\n",
      faults);
  REQUIRE(table);
  REQUIRE(table->rows.size() == 4);
  CHECK(table->rows[0].tool_number == 1);
  CHECK(table->rows[0].payload_item == 0);
  CHECK(table->rows[1].payload_item == 7);
  for (const std::size_t k : {2U, 3U}) {
    CHECK_FALSE(table->rows[k].tool_number);
    CHECK_FALSE(table->rows[k].payload_item);
  }
}

TEST_CASE("Every column is converted to SI, in any order") {
  config::FaultList faults;
  const auto table = Read(
      "z_mm,session,q2_mm,q1_deg,t_s,qd1_deg_s,qd2_mm_s,qdd1_deg_s2,qdd2_mm_s2,tau1_Nm,tau2_N,"
      "payload_kg,temp_C,x_mm,y_mm,qw,qx,qy,qz,range_mm\n"
      "30,a,250,90,12.5,180,1000,360,2000,7,8,20,23.5,10,20,0,0,0.6,0.8,1500\n",
      faults);
  CAPTURE(FaultsText(faults));
  REQUIRE(table);
  CHECK(faults.All().empty());
  CHECK(table->recorded == RecordedColumns{.session = true,
                                           .time = true,
                                           .qd = true,
                                           .qdd = true,
                                           .tau = true,
                                           .payload = true,
                                           .temperature = true,
                                           .position = true,
                                           .range = true,
                                           .orientation = true});
  REQUIRE(table->rows.size() == 1);
  const MeasuredRow& row = table->rows[0];
  CHECK(row.line == 2);
  CHECK(row.session == "a");
  CHECK(row.t_s == 12.5);
  CHECK(row.q[0] == Approx(90 * kRadPerDeg));
  CHECK(row.q[1] == Approx(0.25));
  CHECK(row.qd[0] == Approx(180 * kRadPerDeg));
  CHECK(row.qd[1] == Approx(1));
  CHECK(row.qdd[0] == Approx(360 * kRadPerDeg));
  CHECK(row.qdd[1] == Approx(2));
  CHECK(row.tau[0] == 7.0);
  CHECK(row.tau[1] == 8.0);
  CHECK(row.payload_kg == 20.0);
  CHECK(row.temp_C == 23.5);
  CHECK(row.measured_W.value().isApprox(Vec3(0.01, 0.02, 0.03)));
  CHECK(row.range_m.value() == Approx(1.5));
  CHECK(row.orientation_W.value().w() == 0.0);
  CHECK(row.orientation_W->y() == Approx(0.6));
  CHECK(row.orientation_W->z() == Approx(0.8));
}

TEST_CASE("A missing column is not recorded; joints alone are enough") {
  config::FaultList faults;
  const auto table = Read("q1_deg,q2_mm\n1,2\n3,4\n", faults);
  REQUIRE(table);
  CHECK(table->recorded == RecordedColumns{});
  CHECK(table->rows.size() == 2);
  CHECK(table->rows[1].qd.size() == 0);
}

TEST_CASE("A measured point has the values that the table recorded and the row contains") {
  config::FaultList faults;
  const auto whole = Read(
      "q1_deg,q2_mm,qd1_deg_s,qd2_mm_s,tau1_Nm,tau2_N,t_s,payload_kg,temp_C,q_step_deg,x_mm,y_mm,"
      "z_mm,range_mm\n"
      "90,250,180,1000,7,8,12.5,0,23.5,0.01,10,20,30,1500\n"
      "90,250,180,1000,7,8,12.6,0,23.5,0.01,,,,1500\n",
      faults);
  REQUIRE(whole);
  const model::MeasuredPoint& point = whole->rows.at(0);
  CHECK(point.q[1] == Approx(0.25));
  CHECK(point.qd[0] == Approx(180 * kRadPerDeg));
  CHECK(point.qdd.size() == 0);
  CHECK(point.tau[1] == 8);
  CHECK(point.t_s.value() == 12.5);
  CHECK(point.payload_kg.value() == 0);  // recorded as zero, not absent
  CHECK(point.temp_C.value() == 23.5);
  CHECK(point.q_step_rad.value() == Approx(0.01 * kRadPerDeg));
  CHECK(point.measured_W.value().isApprox(Vec3(0.01, 0.02, 0.03)));
  CHECK(point.range_m.value() == Approx(1.5));
  CHECK_FALSE(point.orientation_W);
  CHECK_FALSE(whole->rows.at(1).measured_W);

  const auto bare = Read("q1_deg,q2_mm\n90,250\n", faults);
  REQUIRE(bare);
  const model::MeasuredPoint& joints = bare->rows.at(0);
  CHECK(joints.q.size() == 2);
  CHECK((joints.qd.size() == 0 && joints.tau.size() == 0));
  CHECK_FALSE((joints.t_s || joints.payload_kg || joints.temp_C || joints.q_step_rad));
  CHECK_FALSE((joints.measured_W || joints.range_m));
}

TEST_CASE("A byte-order mark, CRLF and a missing last line end are accepted") {
  config::FaultList faults;
  const auto table = Read("\xEF\xBB\xBFq1_deg , q2_mm,temp_C\r\n1,2,3\r\n 4 ,5,6", faults);
  REQUIRE(table);
  CHECK(faults.All().empty());
  REQUIRE(table->rows.size() == 2);
  CHECK(table->rows[1].line == 3);
  CHECK(table->rows[1].temp_C == 6.0);
}

TEST_CASE("Unknown columns with numbers become signals, with a warning") {
  config::FaultList faults;
  const auto table = Read("q1_deg,operator,q2_mm,,air_bar\n1,4,2,x,6.1\n1,Jo,2,x,6.2\n", faults);
  REQUIRE(table);
  CHECK(FaultsText(faults) ==
        "measured.csv:1 operator: warning: is not a column of the format: treated as an additional "
        "signal\n"
        "measured.csv:1: warning: a column without a name is ignored\n"
        "measured.csv:1 air_bar: warning: is not a column of the format: treated as an additional "
        "signal\n"
        "measured.csv:3 operator: warning: is not a column of the format, and not a number here: "
        "the column is ignored\n");
  REQUIRE(table->rows.size() == 2);
  CHECK(table->further == std::vector<std::string>{"air_bar"});
  CHECK(table->rows[1].further == std::vector<double>{6.2});
}

TEST_CASE("Points in metres get a warning") {
  config::FaultList faults;
  REQUIRE(Read("q1_deg,q2_mm,x_mm,y_mm,z_mm\n1,2,1.2,0.4,0.9\n1,3,1.1,-0.4,2.9\n", faults));
  CHECK(FaultsText(faults) ==
        "measured.csv:1 x_mm: warning: no point is farther than 3.13 mm from the origin: it looks "
        "like metres; write mm (a factor of 1000)\n");
  config::FaultList none;
  REQUIRE(Read("q1_deg,q2_mm,x_mm,y_mm,z_mm\n1,2,1200,0.4,0.9\n", none));
  CHECK(FaultsText(none).empty());
}

TEST_CASE("A payload that no robot can carry is rejected in every table") {
  config::FaultList faults;
  const auto table = Read("q1_deg,q2_mm,payload_kg\n1,2,5000\n1,2,60000\n1,2,-1\n", faults);
  REQUIRE(table);
  CHECK(table->rows.size() == 1);
  CHECK(FaultsText(faults) ==
        "measured.csv:3 payload_kg: warning: 60000 is outside 0..5000; row not used\n"
        "measured.csv:4 payload_kg: warning: -1 is outside 0..5000; row not used\n");
}

TEST_CASE("Each unreadable row is reported with line and reason, and the others remain") {
  const std::string header = "q1_deg,q2_mm,range_mm,qw,qx,qy,qz\n1,2,3,1,0,0,0\n";
  const std::string last = "4,5,6,1,0,0,0\n";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"1,2,3,1,0,0", ": warning: has 6 fields, but the header has 7; row not used\n"},
      {"1,2,3,1,0,0,0,9", ": warning: has 8 fields, but the header has 7; row not used\n"},
      {"", ": warning: the line is empty; row not used\n"},
      {"1,,3,1,0,0,0", " q2_mm: warning: is empty; row not used\n"},
      {"abc,2,3,1,0,0,0", " q1_deg: warning: \"abc\" is not a number; row not used\n"},
      {"1.0.0,2,3,1,0,0,0", " q1_deg: warning: \"1.0.0\" is not a number; row not used\n"},
      {"1 2,2,3,1,0,0,0", " q1_deg: warning: \"1 2\" is not a number; row not used\n"},
      {"nan,2,3,1,0,0,0", " q1_deg: warning: \"nan\" is not a finite number; row not used\n"},
      {"1,-inf,3,1,0,0,0", " q2_mm: warning: \"-inf\" is not a finite number; row not used\n"},
      {"1,1e999,3,1,0,0,0", " q2_mm: warning: \"1e999\" is out of range; row not used\n"},
      {"1,1e13,3,1,0,0,0", " q2_mm: warning: \"1e13\" is out of range; row not used\n"},
      {"1,2,-3,1,0,0,0", " range_mm: warning: \"-3\" is negative; row not used\n"},
      {"1,2,3,0.5,0,0,0", " qw: warning: the quaternion has length 0.5, not 1; row not used\n"},
      {"\x01\xFF,2,3,1,0,0,0", " q1_deg: warning: \"??\" is not a number; row not used\n"}};
  for (const auto& [row, expected] : cases) {
    config::FaultList faults;
    const auto table = Read(fmt::format("{}{}\n{}", header, row, last), faults);
    CAPTURE(row);
    REQUIRE(table);
    CHECK(FaultsText(faults) == "measured.csv:3" + expected);
    CHECK(table->unreadable_lines == std::vector<int>{3});
    REQUIRE(table->rows.size() == 2);
    CHECK(table->rows[1].line == 4);
  }
}

TEST_CASE("An empty cell loses only that cell, and a row without a point counts as a move") {
  config::FaultList faults;
  const auto table = Read(
      "t_s,q1_deg,q2_mm,qd1_deg_s,qd2_mm_s,payload_kg,temp_C,air_bar,x_mm,y_mm,z_mm\n"
      "0,1,2,5,5,20,20,6,100,1,1\n"
      "10,2,2,5,5,,,7,100,1,1\n"
      ",3,2,,5,20,24,,100,1,1\n"
      "40,4,2,5,5,20,26,9,,,\n"
      "50,5,2,5,5,,27,9,100,1,\n"
      "60,6,2,5,5,40,28,9,100,1,1\n",
      faults);
  REQUIRE(table);
  CHECK(table->unreadable_lines.empty());
  REQUIRE(table->rows.size() == 4);
  REQUIRE(table->unmeasured.size() == 2);
  CHECK(table->unmeasured[0].line == 5);
  CHECK(table->unmeasured[1].line == 6);
  CHECK(table->rows[1].payload_kg == 20);
  CHECK(table->rows[1].temp_C.value() == Approx(20 + 4 * 10.0 / 25));
  CHECK(table->rows[2].t_s == 25);
  CHECK(table->rows[2].further[0] == Approx(8));
  CHECK(table->rows[2].qd.size() == 0);
  CHECK(table->rows[1].qd.size() == 2);
  CHECK(table->breaks.empty());
  const std::string told = FaultsText(faults);
  CHECK_THAT(told, Catch::Contains("measured.csv:4 t_s: warning: is empty in 1 rows (first: line "
                                   "4): interpolated from adjacent rows"));
  CHECK_THAT(told, Catch::Contains("1 are between different payloads"));
}

TEST_CASE("A column that most rows lack is not recorded") {
  config::FaultList faults;
  const auto table = Read("q1_deg,q2_mm,temp_C\n1,2,\n1,3,\n1,4,20\n", faults);
  REQUIRE(table);
  CHECK(table->rows.size() == 3);
  CHECK_FALSE(table->recorded.temperature);
  CHECK_THAT(FaultsText(faults), Catch::Contains("the column is not used"));
}

TEST_CASE("Poses are read without their measured points") {
  config::FaultList faults;
  const auto table = TableFromCsv("q1_deg,q2_mm,x_mm,y_mm,z_mm\n1,2,,,\n3,4,n/a,1,2\n", "p.csv",
                                  TwoJoints(), faults, TableUse::kPoses);
  REQUIRE(table);
  CHECK(faults.All().empty());
  CHECK(table->rows.size() == 2);
}

TEST_CASE("Lost lines are detected by a row counter, a regular clock, and unreadable rows") {
  const auto rows = [](const std::function<std::string(int)>& line) {
    std::string text;
    for (int i = 0; i < 20; ++i) {
      if (i != 7 && i != 12) text += line(i) + "\n";
    }
    return text;
  };
  config::FaultList faults;
  const auto counted = Read(
      "n,q1_deg,q2_mm\n" + rows([](int i) { return fmt::format("{},{},2", i + 5, i); }), faults);
  REQUIRE(counted);
  CHECK(counted->breaks == std::vector<int>{9, 13});
  CHECK(counted->further.empty());
  const auto timed = Read(
      "t_s,q1_deg,q2_mm\n" + rows([](int i) { return fmt::format("{},{},2", 30 * i + i % 3, i); }),
      faults);
  REQUIRE(timed);
  CHECK(timed->breaks == std::vector<int>{9, 13});
  const auto twice = Read(
      "t_s,q1_deg,q2_mm\n" +
          [] {
            std::string text;
            for (int i = 0; i < 40; ++i) text += fmt::format("{},{},2\n", 30 * (i / 2), i / 2);
            return text;
          }(),
      faults);
  REQUIRE(twice);
  CHECK(twice->breaks.empty());  // each line is duplicated, and none is missing
  const auto irregular = Read(
      "t_s,q1_deg,q2_mm\n" + rows([](int i) { return fmt::format("{},{},2", i * i, i); }), faults);
  REQUIRE(irregular);
  CHECK(irregular->breaks.empty());
  const auto unread =
      Read("q1_deg,q2_mm,x_mm,y_mm,z_mm\n1,2,1,1,1\n,2,1,1,1\n1,2\n1,2,a,1,1\n", faults);
  REQUIRE(unread);
  CHECK(unread->breaks == std::vector<int>{3, 4});
  REQUIRE(unread->unmeasured.size() == 1);
  CHECK(unread->unmeasured[0].line == 5);
}

TEST_CASE("12,000 rows of 8 columns are read completely") {
  std::string text = "t_s,q1_deg,q2_mm,payload_kg,temp_C,x_mm,y_mm,z_mm\n";
  for (int i = 0; i < 12000; ++i) {
    text += fmt::format("{},{:.5f},{:.5f},40,23.5,{:.5f},2,3\n", i, 0.01 * i, -0.5 * i, 1.5 * i);
  }
  config::FaultList faults;
  const auto table = Read(text, faults);
  REQUIRE(table);
  REQUIRE(table->rows.size() == 12000);
  CHECK(table->rows[11999].measured_W.value().x() == Approx(17.9985));
}

TEST_CASE("Every measured table is read completely", "[measured]") {
  const char* given = std::getenv("PLUMBLINE_MEASURED");
  const std::filesystem::path measured = given != nullptr ? given : "../shared/measured";
  if (!std::filesystem::is_directory(measured)) {
    WARN("SKIPPED: no folder " << measured.string() << "; set PLUMBLINE_MEASURED");
    std::cout << "SKIPPED: no measured tables\n";
    return;
  }
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(measured)) {
    for (const char* name : {"measured.csv", "test_poses.csv"}) {
      const auto file = entry.path() / name;
      if (!std::filesystem::exists(file)) continue;
      const std::string folder = entry.path().filename().string();
      const bool seven = folder == "real-iiwa7" || folder.starts_with("real-panda");
      config::FaultList faults;
      const auto table = ReadTable(file.string(), std::vector<model::Joint>(seven ? 7 : 6), faults);
      CAPTURE(FaultsText(faults));
      REQUIRE(table);
      CHECK(faults.All().empty());
      CHECK(table->rows.size() > 10);
      ++count;
    }
  }
  CHECK(count > 0);
}

}  // namespace
TEST_CASE("Payloads in grams are one fault, not a warning for each row") {
  std::string text = "q1_deg,q2_mm,payload_kg\n";
  for (int k = 0; k < 20; ++k) text += k % 2 == 0 ? "1,2,2000\n" : "1,2,20700\n";
  config::FaultList faults;
  CHECK_FALSE(Read(text, faults));
  CHECK(FaultsText(faults) ==
        "measured.csv:3 payload_kg: 20700 and other payloads (10 rows in all) are above the 5000 "
        "kg of "
        "the largest robot: the column is in grams; divide it by 1000, or import the table with "
        "the unit g\n");
  // Grams in some rows only: one warning; the diagnosis finds where the unit changes.
  config::FaultList mixed;
  const auto table = Read(text + "1,2,2.0\n", mixed);
  REQUIRE(table);
  CHECK(table->excessive_payloads.size() == 10);
  CHECK(mixed.All().size() == 1);
}

}  // namespace plumbline::csv_test
