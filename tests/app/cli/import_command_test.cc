// plumbline import, export-urdf and plan: what is written, and what is refused.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "app/cli/commands.h"
#include "app/measure/table/csv.h"
#include "drivers/files/text_file.h"
#include "firmware-like/geometry/units.h"
#include "tests/app/cli/run_command.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::import_command_test {

using Catch::Contains;
using plumbline::test::Answer;
using plumbline::test::RunCommand;
using plumbline::test::TemporaryFolder;

namespace {

/// A folder with files, and `import` run on them.
class ImportFolder {
 public:
  std::string Write(const std::string& name, const std::string& text) const {
    REQUIRE(files::WriteTextFile(At(name), text));
    return At(name);
  }
  std::string At(const std::string& name) const { return folder_.path() + "/" + name; }
  std::string TextOf(const std::string& name) const {
    return files::ReadTextFile(At(name)).value();
  }
  static Answer Import(const std::string& arguments) {
    return RunCommand(cli::AddImportCommand, "import " + arguments);
  }

 private:
  TemporaryFolder folder_;
};

}  // namespace

TEST_CASE("import refuses a table without measurements and names the ignored columns") {
  const ImportFolder folder;
  const std::string table = folder.Write("t.csv", "q1_deg,Height,Width\n1,2,3\n2,3,4\n");
  const Answer answer = ImportFolder::Import(table + " --output " + folder.At("m.csv"));
  CHECK(answer.exit_code == 1);
  CHECK_THAT(answer.err, Contains("no row with a usable measurement") &&
                             Contains("ignored columns: \"Height\", \"Width\""));
  CHECK_FALSE(files::ReadTextFile(folder.At("m.csv")));
}

TEST_CASE("a missing unit is reported once, and a column without a name as such") {
  const ImportFolder folder;
  const std::string out = " --output " + folder.At("m.csv");
  const std::string bare = folder.Write("b.csv", "q1,X,Y,Z\n1,10,20,30\n2,20,30,41\n3,20,31,42\n");
  const Answer refused = ImportFolder::Import(bare + out);
  CHECK(refused.exit_code == 1);
  CHECK_THAT(refused.err,
             Contains("columns \"X\", \"Y\", \"Z\": state no unit") && !Contains("rejected"));
  const std::string nameless = folder.Write("n.csv", "q1_deg,,range_mm\n1,a,2\n2,b,3\n");
  CHECK_THAT(ImportFolder::Import(nameless + out).err,
             Contains("ignored columns: column 2 (without a name); map"));
}

TEST_CASE("a preview without the unit gives that reason first and rejects no line for another") {
  const ImportFolder folder;
  const std::string table = folder.Write("t.csv", "x_mm;y_mm;z_mm\n1,5;2,5;3,5\n4,5;5,5;6,5\n");
  const std::string joints = folder.Write("j.csv", "q1;q2\n2,1033183;0,5\n1,5;0,25\n");
  const Answer answer = ImportFolder::Import(table + " --joints " + joints + " --preview");
  CHECK(answer.exit_code == 1);
  CHECK_THAT(answer.err,
             Contains("j.csv:1 columns \"q1\", \"q2\": state no unit") && !Contains("rejected"));
  CHECK_THAT(answer.out, Contains("rows not read") && !Contains("not a number"));
}

TEST_CASE("import checks the joint limits of --cell and suggests the unit") {
  const ImportFolder folder;
  const std::string table =
      folder.Write("t.csv", "q1,q2,range_mm\n100,-20,1\n" + std::string("-80.5,10,2\n"));
  const std::string cell = folder.Write(
      "cell.toml",
      "schema = 1\n[robot]\nname = \"two axes\"\nconvention = \"dh\"\n"
      "[[robot.joint]]\na_mm = 500\nalpha_deg = 0\nd_mm = 0\nmin_deg = -170\nmax_deg = 170\n"
      "[[robot.joint]]\na_mm = 400\nalpha_deg = 0\nd_mm = 0\nmin_deg = -60\nmax_deg = 60\n"
      "[tool]\nmodel = \"rigid\"\ntcp_mm = [0, 0, 100]\n"
      "[measurement]\nkind = \"position\"\nsigma_mm = 0.05\n");
  const std::string rest = " --cell " + cell + " --output " + folder.At("m.csv");
  const Answer wrong = ImportFolder::Import(table + rest + " --angle-unit rad");
  INFO(wrong.err);
  CHECK(wrong.exit_code == 1);
  CHECK_THAT(wrong.err, Contains("m.csv:2 q1_deg: 5729.58 is outside the joint limits -170 to 170 "
                                 "of the cell, as in 2 of 2 rows; no file is written; all rows fit "
                                 "if the angles are in degrees: give --angle-unit deg"));
  CHECK_FALSE(files::ReadTextFile(folder.At("m.csv")));
  CHECK(ImportFolder::Import(table + rest + " --angle-unit deg").exit_code == 0);

  // What is changed or matched is shown before anything is written, too.
  const std::string turned = folder.Write("p.csv", "range_mm\n1\n2\n");
  const std::string joints = folder.Write("j.csv", "q1_deg,q2_deg\n350,5\n10,6\n");
  const Answer preview =
      ImportFolder::Import(turned + " --joints " + joints + " --cell " + cell + " --preview");
  INFO(preview.out << preview.err);
  CHECK(preview.exit_code == 0);
  CHECK_THAT(preview.out, Contains("joints matched by row") && Contains("360 subtracted in 1 of"));

  const std::string beyond = folder.Write("b.csv", "q1_deg,q2_deg,range_mm\n171,5,1\n1,62,2\n");
  const Answer one = ImportFolder::Import(beyond + rest);
  CHECK(one.exit_code == 1);
  CHECK_THAT(one.err, Contains("m.csv:3 q2_deg: 62 is outside the joint limits -60 to 60") &&
                          Contains("1 of 2 rows") && Contains("the order of the joints"));
}

TEST_CASE("import with --cell finds measurements in another order than the joints") {
  const ImportFolder folder;
  // Two joints in a plane and a lift, with the tip at (x, y, z) by their closed form.
  const std::string cell =
      folder.Write("cell.toml",
                   "schema = 1\n[robot]\nname = \"scara\"\nconvention = \"dh\"\n"
                   "[[robot.joint]]\na_mm = 500\nalpha_deg = 0\nd_mm = 0\n"
                   "[[robot.joint]]\na_mm = 400\nalpha_deg = 0\nd_mm = 0\n"
                   "[[robot.joint]]\ntype = \"prismatic\"\na_mm = 0\nalpha_deg = "
                   "0\ntheta_offset_deg = 0\nd_mm = 0\n"
                   "[tool]\nmodel = \"rigid\"\ntcp_mm = [0, 0, 100]\n"
                   "[measurement]\nkind = \"position\"\nframe = \"unaligned\"\nsigma_mm = 0.05\n");
  std::vector<std::string> points;
  std::string joints = "q1_deg,q2_deg,q3_mm\n";
  for (int k = 0; k < 24; ++k) {
    const double q1_deg = (37 * k) % 140 - 70, q2_deg = (53 * k) % 110 + 10, lift = (29 * k) % 180;
    joints += fmt::format("{},{},{}\n", q1_deg, q2_deg, lift);
    const double q1 = q1_deg * kRadPerDeg, q12 = (q1_deg + q2_deg) * kRadPerDeg;
    // The instrument stands elsewhere, turned by 90 degrees.
    points.push_back(fmt::format("{:.4f},{:.4f},{:.4f}\n",
                                 1000 - 500 * std::sin(q1) - 400 * std::sin(q12),
                                 500 * std::cos(q1) + 400 * std::cos(q12), lift + 100));
  }
  const auto import = [&](const std::string& name) {
    std::string text = "x_mm,y_mm,z_mm\n";
    for (const std::string& point : points) text += point;
    return ImportFolder::Import(folder.Write(name, text) + " --joints " +
                                folder.Write("j.csv", joints) + " --cell " + cell + " --output " +
                                folder.At("m.csv"));
  };
  const Answer in_order = import("in_order.csv");
  INFO(in_order.err);
  CHECK(in_order.exit_code == 0);
  // Five rows in another order are outliers of a fit that otherwise holds.
  const std::vector<std::string> right = points;
  std::rotate(points.begin() + 3, points.begin() + 4, points.begin() + 8);
  const Answer five = import("five.csv");
  INFO(five.err);
  CHECK(five.exit_code == 1);
  CHECK_THAT(five.err, Contains("5 of the 24 points belong to the joint readings of other rows"));
  points = right;
  std::mt19937_64 generator(5);
  std::shuffle(points.begin(), points.end(), generator);
  const Answer shuffled = import("shuffled.csv");
  CHECK(shuffled.exit_code == 1);
  CHECK_THAT(shuffled.err, Contains("in different orders") && Contains("no file is written"));
}

TEST_CASE("import says which columns it ignores and refuses two of one meaning") {
  const ImportFolder folder;
  const std::string out = " --output " + folder.At("m.csv");
  const std::string table = folder.Write("t.csv", "q1_deg,range_mm,Height\n1,2,3\n2,3,4\n");
  const Answer ignored = ImportFolder::Import(table + out);
  CHECK(ignored.exit_code == 0);
  CHECK_THAT(ignored.err, Contains("t.csv: ignored columns: \"Height\"; map"));

  const std::string twice = folder.Write("d.csv", "q1_deg,range_mm,range_mm\n1,2,2\n2,3,4\n");
  for (const std::string& how : {out, std::string(" --preview")}) {
    const Answer refused = ImportFolder::Import(twice + how);
    CHECK(refused.exit_code == 1);
    CHECK_THAT(refused.err,
               Contains("d.csv:1 column 3 \"range_mm\": has the same meaning as column 2 "
                        "\"range_mm\" (range_mm) and other values") &&
                   Contains("to = \"ignore\""));
  }
  const std::string map = folder.Write("map.toml",
                                       "schema = 1\n[[column]]\nnumber = 3\nto = \"range_mm\"\n"
                                       "[[column]]\nnumber = 2\nto = \"ignore\"\n");
  CHECK(ImportFolder::Import(twice + out + " --mapping " + map).exit_code == 0);
  CHECK(folder.TextOf("m.csv") == "q1_deg,range_mm\n1,2\n2,4\n");
  // Equal columns leave nothing to decide.
  const std::string equal = folder.Write("e.csv", "q1_deg,range_mm,range_mm\n1,2,2\n2,3,3\n");
  CHECK(ImportFolder::Import(equal + out).exit_code == 0);
}

TEST_CASE("import refuses a permissible error that applies to nothing") {
  const ImportFolder folder;
  const std::string table = folder.Write("t.csv", "q1_deg,artefact\n1,ball\n2,ball\n");
  const std::string arguments = table + " --output " + folder.At("m.csv");
  CHECK_THAT(ImportFolder::Import(arguments + " --permissible-error-um 15+6").err,
             Contains("to which --permissible-error-um applies"));
  const Answer touches = ImportFolder::Import(arguments);
  CHECK(touches.exit_code == 0);
  CHECK_THAT(touches.err, Contains("2 rows, 2 with a measurement; 0 lines rejected"));
}

TEST_CASE("import accepts a file of which half is matched") {
  const ImportFolder folder;
  const std::string table =
      folder.Write("t.csv", "no,x_mm,y_mm,z_mm\n1,1,2,3\n2,4,5,6\n8,1,2,3\n9,1,2,3\n");
  const std::string joints = folder.Write("j.csv", "no,q1_deg\n1,10\n2,20\n");
  const Answer answer =
      ImportFolder::Import(table + " --joints " + joints + " --output " + folder.At("m.csv"));
  INFO(answer.err);
  CHECK(answer.exit_code == 0);
  CHECK_THAT(answer.err, Contains("t.csv:4: rejected: number 8 is not in the file of the joints") &&
                             Contains("2 rows, 2 with a measurement; 2 lines rejected"));
}

TEST_CASE("import names every row that is left out for its joints") {
  const ImportFolder folder;
  const std::string table = folder.Write("t.csv", "x_mm,y_mm,z_mm\n1,2,3\n4,5,6\n7,8,9\n");
  const std::string joints = folder.Write("j.csv", "q1_deg,q2_deg\n1,10\n2,broken\n,\n");
  const Answer answer =
      ImportFolder::Import(table + " --joints " + joints + " --output " + folder.At("m.csv"));
  INFO(answer.err);
  CHECK(answer.exit_code == 0);
  CHECK_THAT(answer.err, Contains("j.csv:3: rejected: q2_deg is \"broken\"") &&
                             Contains("t.csv:3: rejected: has no value of q2_deg") &&
                             Contains("t.csv:4: rejected: has no joints") &&
                             Contains("1 row, 1 with a measurement; 3 lines rejected"));
  CHECK(folder.TextOf("m.csv") == "q1_deg,q2_deg,x_mm,y_mm,z_mm\n1,10,1,2,3\n");
}

TEST_CASE("a damaged line does not switch the matching of joints from names to rows") {
  const ImportFolder folder;
  const std::string joints =
      folder.Write("j.csv", "Name,q1_deg\nC,3\nB,2\nA,1\n");  // in reverse order
  const std::string broken =
      folder.Write("t.csv", "Name,x_mm,y_mm,z_mm\nA,100,0,0\nB,200,0,0,9\nC,300,0,0\n");
  const std::string out = " --joints " + joints + " --output " + folder.At("m.csv");
  const Answer answer = ImportFolder::Import(broken + out);
  CHECK(answer.exit_code == 0);
  CHECK_THAT(answer.err, Contains("joints matched by name"));
  config::FaultList faults;
  const auto table =
      measure::TableFromCsv(folder.TextOf("m.csv"), "m.csv", std::vector<model::Joint>(1), faults);
  REQUIRE(table);
  REQUIRE(table->rows.size() == 2);
  for (const measure::MeasuredRow& row : table->rows) {
    CHECK(row.measured_W.value().x() == Approx(0.1 * row.q[0] / kRadPerDeg));
  }
}

TEST_CASE("joints with names are matched by a column of text, wherever it is") {
  const ImportFolder folder;
  const std::string joints = folder.Write("j.csv", "Name,q1_deg\nB,2\nA,1\n");
  for (const char* table : {"Punkt,x_mm,y_mm,z_mm\nA,100,0,0\nB,200,0,0\n",
                            "x_mm,y_mm,z_mm,Punkt\n100,0,0,A\n200,0,0,B\n"}) {
    CAPTURE(table);
    const Answer answer = ImportFolder::Import(folder.Write("t.csv", table) + " --joints " +
                                               joints + " --output " + folder.At("m.csv"));
    CHECK(answer.exit_code == 0);
    CHECK_THAT(answer.err, Contains("joints matched by name"));
    config::FaultList faults;
    const auto rows = measure::TableFromCsv(folder.TextOf("m.csv"), "m.csv",
                                            std::vector<model::Joint>(1), faults);
    REQUIRE(rows);
    REQUIRE(rows->rows.size() == 2);
    for (const measure::MeasuredRow& row : rows->rows)
      CHECK(row.measured_W.value().x() == Approx(0.1 * row.q[0] / kRadPerDeg));
  }
}

TEST_CASE("joints with names are not matched by row with measurements whose names are unknown") {
  const ImportFolder folder;
  const std::string joints = folder.Write("j.csv", "Name,q1_deg\nB,2\nA,1\n");
  const std::string table = folder.Write("t.csv", "x_mm,y_mm,z_mm\n100,0,0\n200,0,0\n");
  const Answer answer =
      ImportFolder::Import(table + " --joints " + joints + " --output " + folder.At("m.csv"));
  CHECK(answer.exit_code == 1);
  CHECK_THAT(answer.err, Contains("no column of the measurements is known to hold these names"));
}

TEST_CASE("import overwrites none of its inputs") {
  const ImportFolder folder;
  const std::string table = folder.Write("t.csv", "q1_deg,x_mm,y_mm,z_mm\n1,1,2,3\n");
  const std::string joints = folder.Write("j.csv", "q1_deg\n1\n");
  const std::string mapping = folder.Write("m.toml", "schema = 1\n");
  const std::string joints_mapping = folder.Write("n.toml", "schema = 1\n");
  const std::string inputs = table + " --joints " + joints + " --mapping " + mapping +
                             " --joints-mapping " + joints_mapping + " --output ";
  for (const std::string& input : {table, joints, mapping, joints_mapping}) {
    const std::string before = files::ReadTextFile(input).value();
    const Answer answer = ImportFolder::Import(inputs + input);
    CHECK(answer.exit_code == 2);
    CHECK_THAT(answer.err, Contains("--output would overwrite " + input));
    CHECK(files::ReadTextFile(input).value() == before);
  }
  const std::string new_file = folder.At("new");
  const Answer answer =
      ImportFolder::Import(table + " --mapping " + new_file + " --output " + folder.At("./new"));
  CHECK(answer.exit_code == 2);
  CHECK_THAT(answer.err, Contains("--output would overwrite " + new_file));
  CHECK_FALSE(files::ReadTextFile(new_file));
}

TEST_CASE("export-urdf and plan overwrite none of their files") {
  const ImportFolder folder;
  const std::string cell = folder.Write("cell.toml", "a cell\n");
  const std::string file = folder.Write("r.urdf", "a robot\n");
  for (const std::string& out : {cell, file}) {
    const Answer answer =
        RunCommand(cli::AddExportUrdfCommand, "export-urdf " + cell + " " + file + " --out " + out);
    CHECK(answer.exit_code == 2);
    CHECK_THAT(answer.err, Contains("--output would overwrite " + out));
  }
  for (const char* option : {"--output", "--svg", "--urscript", "--points"}) {
    const Answer answer =
        RunCommand(cli::AddPlanCommand, "plan " + cell + " " + option + " " + cell);
    CHECK(answer.exit_code == 2);
    CHECK_THAT(answer.err, Contains(std::string(option) + " would overwrite " + cell));
  }
  const std::string both = folder.At("both");
  const Answer answer =
      RunCommand(cli::AddPlanCommand, "plan " + cell + " --svg " + both + " --points " + both);
  CHECK(answer.exit_code == 2);
  CHECK_THAT(answer.err, Contains("--points would overwrite " + both));
  CHECK(folder.TextOf("cell.toml") == "a cell\n");
}

TEST_CASE("import with --output says that a calibration holds no measurements") {
  const ImportFolder folder;
  const std::string yaml = folder.Write("calibration.yaml", "shoulder_pan_joint: 0.0123\n");
  const Answer answer = ImportFolder::Import(yaml + " --output " + folder.At("m.csv"));
  CHECK(answer.exit_code == 1);
  CHECK_THAT(answer.err, Contains("holds results, not measurements; no file was written; use "
                                  "import-urdf --apply-rising"));
  CHECK_FALSE(files::ReadTextFile(folder.At("m.csv")));
}

}  // namespace plumbline::import_command_test
