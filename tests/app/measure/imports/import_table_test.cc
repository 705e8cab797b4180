// Exports as measured.csv, read back by the product's own reader.
#include "app/measure/imports/import_table.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <tuple>

#include "app/base/text/text_encoding.h"
#include "app/measure/table/csv.h"

namespace plumbline::import_table_test {

using namespace plumbline::measure;

namespace {

/// The layout of a Leica export: Latin-1, CRLF, double blanks, apostrophe before the time.
const std::string kTracker =
    "X  [mm],Y  [mm],Z  [mm],U(95)  [mm],U(95) X  [mm],U(95) Y  [mm],U(95) Z  [mm],Tilt  [deg],"
    "Temperature  [C],Image RMS  [\xB5m],Time Stamp,Delete\r\n"
    "1000.5,-20.25,300.125,0.01,0.002,0.004,0.006,1,21.5,3,'08.11.2022 16:17:28.353,\r\n"
    "1001.5,-21.25,301.125,0.01,0.002,0.004,0.006,1,21.6,3,'08.11.2022 16:17:38.853,1\r\n"
    "1002.5,???,302.125,0.01,0.002,0.004,0.006,1,21.7,3,'08.11.2022 16:17:48.353,\r\n";
const std::string kJoints = "j1;j2;j3\n0,1;-0,2;0,35\n0,2;-0,3;0,45\n0,3;-0,4;0,5\n";

UnderstoodFile Understood(const std::string& text, const ImportOptions& options = {},
                          const std::string& mapping = "") {
  config::FaultList faults;
  Mapping read;
  if (!mapping.empty()) read = *MappingFromText(mapping, "m.toml", faults);
  const UnderstoodFile file =
      Understand(text, "f.csv", FileRole::kMeasured, read, "m.toml", options, faults);
  INFO(config::FaultsText(faults));
  REQUIRE_FALSE(faults.HasFaults());
  return file;
}

std::string UnderstandFaults(const std::string& text) {
  config::FaultList faults;
  Understand(text, "f.csv", FileRole::kMeasured, {}, "", {}, faults);
  return config::FaultsText(faults);
}

}  // namespace

TEST_CASE("time stamps as seconds") {
  const double noon = *SecondsOfTimeStamp("'08.11.2022 12:00:00");
  CHECK(*SecondsOfTimeStamp("'08.11.2022 12:00:28.353") - noon == Approx(28.353));
  CHECK(*SecondsOfTimeStamp("2022-11-08T12:00:00") == noon);
  CHECK(*SecondsOfTimeStamp("11/08/2022 12:00:00 PM") == noon);
  CHECK(*SecondsOfTimeStamp("11/09/2022 12:00:00 AM") == noon + 43200);
  CHECK(*SecondsOfTimeStamp("08/11/2022 12:00:00", DateOrder::kDayFirst) == noon);
  CHECK_FALSE(SecondsOfTimeStamp("13/11/2022 12:00:00"));
  CHECK(HasSlashDate("13/11/2022 12:00:00"));
  CHECK_FALSE(HasSlashDate("13.11.2022 12:00:00"));
  CHECK_FALSE(HasSlashDate("1/2"));
  for (const char* wrong : {"", "12.5", "31.02.2022 12:00:00", "08.11.2022", "a.b.c d:e:f"}) {
    CHECK_FALSE(SecondsOfTimeStamp(wrong));
  }
}

TEST_CASE("a file with a line of very many fields is refused before it is split") {
  std::string text = "x;y;z\n1.5";
  for (int k = 0; k < 1'000'000; ++k) text += ";2.5";
  config::FaultList faults;
  const UnderstoodFile file = Understand(text, "f.csv", FileRole::kMeasured, {}, "", {}, faults);
  CHECK_FALSE(file.readable);
  CHECK(file.layout.records.empty());
  REQUIRE(faults.All().size() == 1);
  CHECK(faults.All()[0].line == 2);
  CHECK_THAT(faults.All()[0].what, Catch::StartsWith("has 1000000 separators, but at most 1000"));
}

TEST_CASE("a tracker's export and the robot's joints become measured.csv") {
  ImportOptions options;
  options.angle_unit = "rad";
  const ImportedTable measured = RowsOf(Understood(kTracker), options);
  config::FaultList faults;
  const ImportedTable rows =
      WithJoints(measured, RowsOf(Understood(kJoints, options), options), "joints.csv", faults);
  REQUIRE_FALSE(faults.HasFaults());
  REQUIRE(rows.rejected.size() == 2);
  CHECK(rows.rejected[0].line == 3);
  CHECK(rows.rejected[0].reason == "is marked as deleted");
  CHECK(rows.rejected[1].reason == "y_mm is \"???\", which is not a number with a decimal point");

  const std::vector<model::Joint> joints(3);
  const auto table = measure::TableFromCsv(MeasuredCsv(rows), "measured.csv", joints, faults);
  INFO(config::FaultsText(faults));
  REQUIRE(table);
  REQUIRE(table->rows.size() == 1);
  CHECK(table->unmeasured.size() == 2);  // the robot was there
  const measure::MeasuredRow& row = table->rows[0];
  CHECK((*row.measured_W - Vec3(1.0005, -0.02025, 0.300125)).norm() < 1e-12);
  CHECK((row.q - Eigen::Vector3d(0.1, -0.2, 0.35)).norm() < 1e-8);
  CHECK(row.temp_C == 21.5);
  // Root mean square of U/2 over the axes: sqrt((1 + 4 + 9) / 3) um.
  CHECK(row.sigma_m.value() == Approx(1e-6 * std::sqrt(14.0 / 3)));
  CHECK(table->unmeasured[0].t_s.value() == Approx(10.5));
}

TEST_CASE("cameras, tools and payload items keep their columns") {
  const ImportedTable table =
      RowsOf(Understood("x [mm],y [mm],z [mm],camera,tool,payload_item,Tool\n"
                        "1,2,3,side,2,7,ball\n4,5,6,,1,0,ball\n"),
             {});
  CHECK(MeasuredCsv(table) ==
        "tool,payload_item,camera,x_mm,y_mm,z_mm\n2,7,side,1,2,3\n1,0,,4,5,6\n");
}

TEST_CASE("a permissible error is added to the scatter") {
  ImportOptions options;
  options.permissible_error = PermissibleError{0.015, 0.006};
  const ImportedTable table =
      RowsOf(Understood("x [mm],y [mm],z [mm]\n3000,0,0\n", options), options);
  CHECK(table.rows[0].numbers.at("sigma_mm") == Approx(0.033 / std::sqrt(3.0)));
  const ImportedTable radius = RowsOf(Understood("x_mm,y_mm,z_mm,U95 [um]\n3000,0,0,27.95\n"), {});
  CHECK(radius.rows[0].numbers.at("sigma_mm") == Approx(0.01));
}

TEST_CASE("a permissible error is added to a sigma column and applies to ranges and gauges") {
  ImportOptions options;
  options.permissible_error = PermissibleError{0.015, 0.006};
  const auto sigma = [&](const std::string& text) {
    return RowsOf(Understood(text, options), options).rows[0].numbers.at("sigma_mm");
  };
  const double mpe = 0.033 / std::sqrt(3.0);
  CHECK(sigma("x_mm,y_mm,z_mm,sigma_mm\n3000,0,0,0.02\n") == Approx(std::hypot(mpe, 0.02)));
  CHECK(sigma("q1_deg,range_mm\n1,3000\n") == Approx(mpe));
  CHECK(sigma("q1_deg,gauge_mm\n1,0\n") == Approx(0.015 / std::sqrt(3.0)));
}

TEST_CASE("units that nobody states are asked for, not guessed") {
  using Catch::Contains;
  CHECK_THAT(
      UnderstandFaults("x,y,z\n0.1,0.2,0.93\n"),
      Contains("f.csv:1 columns \"x\", \"y\", \"z\": state no unit (values from 0.1 to 0.93)") &&
          Contains("--length-unit"));
  CHECK_THAT(UnderstandFaults("j1,j2\n0.1,0.2\n"), Contains("--angle-unit"));
  CHECK_THAT(UnderstandFaults("x [furlong],y\n1,2\n"), Contains("\"furlong\", which is not known"));
}

TEST_CASE("joints are matched by number where both files have it") {
  const std::string measured = "no,x_mm,y_mm,z_mm\n2,1,2,3\n2,1.1,2,3\n1,4,5,6\n9,7,8,9\n";
  const std::string joints = "pose,q1_deg\n1,10\n2,20\n3,30\n";
  config::FaultList faults;
  const ImportedTable rows =
      WithJoints(RowsOf(Understood(measured), {}), RowsOf(Understood(joints), {}), "j.csv", faults);
  REQUIRE(rows.rows.size() == 4);
  CHECK(rows.rows[0].numbers.at("x_mm") == 4);
  CHECK(rows.rows[2].numbers.at("x_mm") == 1.1);
  CHECK(rows.rows[2].numbers.at("q1_deg") == 20);
  CHECK_FALSE(rows.rows[3].numbers.contains("x_mm"));
  REQUIRE(rows.rejected.size() == 1);
  CHECK(rows.rejected[0].reason == "number 9 is not in the file of the joints");
  // Lines of the joints must have numbers of their own.
  WithJoints(RowsOf(Understood(measured), {}),
             RowsOf(Understood("no,q1_deg\n1,1\n2,2\n01,3\n"), {}), "j.csv", faults);
  CHECK_THAT(config::FaultsText(faults),
             Catch::Contains("j.csv:4") && Catch::Contains("\"1\" is also in line 2"));
  faults = {};
  // Without numbers, both must have equally many rows.
  WithJoints(RowsOf(Understood("x_mm,y_mm,z_mm\n1,2,3\n"), {}),
             RowsOf(Understood("q1_deg,q2_deg\n1,1\n2,2\n"), {}), "j.csv", faults);
  CHECK_THAT(config::FaultsText(faults), Catch::Contains("has 2 rows, but 1 were measured"));
}

TEST_CASE("day and month have one order in a column, which is stated") {
  const std::string head = "x_mm,y_mm,z_mm,time\n";
  const ImportedTable days =
      RowsOf(Understood(head + "1,2,3,12/11/2022 10:00:00\n1,2,3,13/11/2022 10:00:00\n"), {});
  CHECK(days.rows[1].numbers.at("t_s") == 86400);
  CHECK(days.notes == std::vector<std::string>{"t_s: dates read as day/month/year"});
  const ImportedTable unclear = RowsOf(Understood(head + "1,2,3,12/11/2022 10:00:00\n"), {});
  REQUIRE(unclear.notes.size() == 1);
  CHECK_THAT(unclear.notes[0], Catch::Contains("month/day/year: assumed"));
}

TEST_CASE("an unreadable time, temperature or uncertainty is left out alone") {
  const ImportedTable table = RowsOf(
      Understood("x_mm,y_mm,z_mm,temp_C,sigma_mm\n1,2,3,20,0.1\n1,2,3,---,n/a\n1,2,3,?,0.1\n"), {});
  CHECK(table.rejected.empty());
  CHECK(table.rows[1].numbers.at("x_mm") == 1);
  CHECK_FALSE(table.rows[1].numbers.contains("temp_C"));
  CHECK(table.notes == std::vector<std::string>{
                           "sigma_mm: 1 unusable value left out, the first in line 3: \"n/a\"",
                           "temp_C: 2 unusable values left out, the first in line 3: \"---\""});
}

TEST_CASE("an uncertainty of zero or less is left out, with a note") {
  const ImportedTable table =
      RowsOf(Understood("x_mm,y_mm,z_mm,u95_mm\n1,2,3,0\n1,2,3,-0.1\n1,2,3,0.1\n"), {});
  CHECK(table.rejected.empty());
  CHECK_FALSE(table.rows[0].numbers.contains("sigma_mm"));
  CHECK(table.rows[2].numbers.contains("sigma_mm"));
  CHECK(table.notes.front() == "u95_mm: 2 unusable values left out, the first in line 2: \"0\"");
}

TEST_CASE("commas followed by three digits are a fault until the decimal sign is given") {
  const std::string text = "x_mm;y_mm;z_mm\n1,234;2,345;3,456\n";
  CHECK(UnderstandFaults(text).find("give --decimal comma or --decimal point") !=
        std::string::npos);
  ImportOptions options;
  options.decimal = ',';
  CHECK(RowsOf(Understood(text, options), options).rows[0].numbers.at("x_mm") == Approx(1.234));
  options.decimal = '.';
  CHECK(RowsOf(Understood(text, options), options).rows[0].numbers.at("x_mm") == 1234);
}

TEST_CASE("times of two files count from one origin, or only those of the measurements are kept") {
  const std::string measured = "no,x_mm,y_mm,z_mm,time\n1,1,2,3,2022-11-08T10:00:05\n";
  const auto times = [&](const std::string& joints) {
    config::FaultList faults;
    const ImportedTable rows = WithJoints(RowsOf(Understood(measured), {}),
                                          RowsOf(Understood(joints), {}), "j.csv", faults);
    REQUIRE(rows.rows.size() == 2);
    return rows;
  };
  const ImportedTable stamped =
      times("no,q1_deg,time\n1,10,2022-11-08T10:00:00\n2,20,2022-11-08T10:00:09\n");
  CHECK(stamped.rows[0].numbers.at("t_s") == 5);
  CHECK(stamped.rows[1].numbers.at("t_s") == 9);
  const ImportedTable counted = times("no,q1_deg,t_s\n1,10,100\n2,20,200\n");
  CHECK(counted.rows[0].numbers.at("t_s") == 0);
  CHECK_FALSE(counted.rows[1].numbers.contains("t_s"));
  CHECK_THAT(counted.notes[0], Catch::Contains("t_s of j.csv is left out"));
}

TEST_CASE("readings of a Keyence gauge, one a line") {
  ImportOptions options;
  options.artefact = "dial";
  const ImportedTable table =
      RowsOf(Understood("+01.2345\nXXXXXXXX\n-FFFF.FF\n-00.0100\n", options), options);
  REQUIRE(table.rows.size() == 4);
  CHECK(table.rows[0].numbers.at("gauge_mm") == 1.2345);
  CHECK(table.rows[0].texts.at("artefact") == "dial");
  CHECK(table.rejected.size() == 2);
  CHECK_THAT(table.rejected[0].reason, Catch::Contains("the gauge had no value"));
}

TEST_CASE("a single column has the stated unit") {
  ImportOptions inches;
  inches.length_unit = "in";
  CHECK(RowsOf(Understood("+01.0000\n-00.5000\n", inches), inches).rows[0].numbers.at("gauge_mm") ==
        25.4);
  CHECK_THAT(UnderstandFaults("0.5\n0.25\n"),
             Catch::Contains("column 1: states no unit") && Catch::Contains("--length-unit"));
}

TEST_CASE("columns without names: three are a position, those of a file of joints the joints") {
  config::FaultList faults;
  ImportOptions options;
  options.length_unit = "m";
  options.angle_unit = "rad";
  const UnderstoodFile position = Understand("  0.5   0.25  -1\n  1.5   0.25  -1\n", "p",
                                             FileRole::kMeasured, {}, "", options, faults);
  const UnderstoodFile joints = Understand("1,-0.15,-0.2,1.0\n2,0.1,0.2,1.0\n", "j",
                                           FileRole::kJoints, {}, "", options, faults);
  const ImportedTable rows =
      WithJoints(RowsOf(position, options), RowsOf(joints, options), "j", faults);
  CHECK_FALSE(faults.HasFaults());
  CHECK(rows.rows[1].numbers.at("x_mm") == 1500);
  CHECK(rows.rows[0].numbers.at("q1_deg") == Approx(-8.5943669));
  CHECK(rows.rows[0].numbers.contains("q3_deg"));
  CHECK(rows.rows[0].texts.at("number") == "1");
}

TEST_CASE("a mapping names columns by name or number") {
  const std::string mapping = R"(schema = 1
separator = "blanks"
header_line = 0
[[column]]
number = 2
to = "x_mm"
unit = "m"
[[column]]
number = 3
to = "y_mm"
unit = "m"
[[column]]
number = 4
to = "z_mm"
unit = "m"
)";
  const ImportedTable table = RowsOf(Understood("1 0.5 0.25 -0.125\n", {}, mapping), {});
  CHECK(table.rows[0].numbers.at("z_mm") == -125);
  config::FaultList faults;
  CHECK(TextOfMapping(*MappingFromText(mapping, "m", faults)).find("number = 4") !=
        std::string::npos);
  const auto faults_of = [](const std::string& text) {
    config::FaultList own;
    CHECK_FALSE(MappingFromText(text, "m.toml", own));
    return config::FaultsText(own);
  };
  using Catch::Contains;
  CHECK_THAT(faults_of("schema = 1\n[[column]]\nfrom = \"a\"\nto = \"length\"\n"),
             Contains("m.toml:4") && Contains("\"length\" is neither"));
  CHECK_THAT(faults_of("schema = 1\n[[column]]\nfrom = \"a\"\nto = \"x_mm\"\nunit = \"deg\"\n"),
             Contains("is not a unit of x_mm; allowed: mm"));
  CHECK_THAT(faults_of("schema = 1\ndecimal = \"dot\"\n"), Contains("decimal"));
}

TEST_CASE("names of columns with control characters survive in a mapping file") {
  // tests/fuzz/corpus/import/control_characters, carriage_return
  const UnderstoodFile file = Understood("a\x7f\x01\rb;x_mm\n1;2\n");
  config::FaultList faults;
  const auto kept = MappingFromText(TextOfMapping({{}, {{file.layout.names[0], 0, "t_s", "s"}}}),
                                    "m.toml", faults);
  INFO(config::FaultsText(faults));
  REQUIRE(kept);
  CHECK(kept->columns[0].from == file.layout.names[0]);
}

TEST_CASE("rows that cannot be read are rejected with their reason") {
  const std::string text =
      "x_mm,y_mm,z_mm,qw,qx,qy,qz\n1,2,3,1,0,0,0\n1,2,,1,0,0,0\n1,2,3,2,0,0,0\n1,2,3,1,0,0,0,5\n"
      "1,2,3,1,0\n1,2,nan,1,0,0,0\n";
  const ImportedTable table = RowsOf(Understood(text), {});
  REQUIRE(table.rejected.size() == 5);
  CHECK(table.rejected[0].reason == "x, y and z are not all given");
  CHECK(table.rejected[1].reason == "the quaternion has the length 2, not 1");
  CHECK(table.rejected[2].reason == "has 8 fields instead of 7");
  CHECK(table.rejected[3].reason == "has 5 fields instead of 7");
  CHECK_THAT(table.rejected[4].reason, Catch::Contains("\"nan\""));
}

TEST_CASE("numbers since 1970 are read in the unit that their size implies, from the first one") {
  for (const auto& [first, second, unit] :
       {std::tuple("1764182000", "1764182002", "seconds"),
        std::tuple("1764182000123", "1764182002123", "milliseconds"),
        std::tuple("1764182000123000", "1764182002123000", "microseconds"),
        std::tuple("1764182000123000000", "1764182002123000000", "nanoseconds")}) {
    CAPTURE(unit);
    const ImportedTable table = RowsOf(
        Understood(fmt::format("x_mm,y_mm,z_mm,timestamp\n1,2,3,{}\n1,2,4,{}\n", first, second)),
        {});
    REQUIRE(table.rows.size() == 2);
    CHECK(table.rows[0].numbers.at("t_s") == 0);
    CHECK(table.rows[1].numbers.at("t_s") == Approx(2).margin(1e-3));
    REQUIRE(table.notes.size() == 1);
    CHECK_THAT(table.notes[0], Catch::Contains(unit));
  }
  const ImportedTable counted = RowsOf(Understood("x_mm,y_mm,z_mm,t_s\n1,2,3,12.5\n"), {});
  CHECK(counted.rows[0].numbers.at("t_s") == 12.5);
}

TEST_CASE("a minus sign is read as a hyphen") {
  const text::DecodedText decoded = text::DecodedFromBytes("x_mm,y_mm,z_mm\n\u2212123.5,2,3\n");
  const ImportedTable table = RowsOf(Understood(decoded.text), {});
  CHECK(table.rows[0].numbers.at("x_mm") == -123.5);
}

}  // namespace plumbline::import_table_test
