#include "app/base/config/toml_reader.h"

#include <catch2/catch.hpp>

#include "tests/app/base/config/wrong_line.h"

namespace plumbline::toml_reader_test {

using namespace plumbline::config;

namespace {

enum class Colour { kRed, kBlue };

struct Read {
  std::optional<double> mass, angle;
  std::optional<int> count;
  std::optional<bool> on;
  std::optional<std::string> name;
  std::optional<Colour> colour;
  std::optional<Vec3> at;
  std::optional<std::vector<std::string>> words;
  std::optional<Eigen::MatrixXd> matrix;
  std::vector<double> parts;
};

Read ReadThing(const std::string& text, FaultList& faults) {
  Read read;
  TomlDocument document(text, "thing.toml", faults);
  if (!document.parsed()) return read;
  const TomlTable root = document.Root();
  if (const auto thing = root.RequiredTable("thing")) {
    read.mass = thing->RequiredNumber("mass_kg", {0, 300});
    read.angle = thing->Number("angle_deg", {-360, 360, kRadPerDeg});
    read.count = thing->Integer("count", 1, 5);
    read.on = thing->Bool("on");
    read.name = thing->RequiredString("name");
    read.colour = thing->OneOf<Colour>("colour", {{"red", Colour::kRed}, {"blue", Colour::kBlue}});
    read.at = thing->Vector3("at_mm", {-1000, 1000, kMetrePerMm});
    read.words = thing->Strings("words");
    read.matrix = thing->Matrix("matrix", {-1, 1}, 2, 2);
  }
  for (const TomlTable& part : root.Tables("part")) {
    read.parts.push_back(part.RequiredNumber("a_mm", {0, 10, kMetrePerMm}).value_or(-1));
  }
  document.ReportUnknownKeys();
  faults.SortByLine();
  return read;
}

const std::string kGood = R"(
[thing]
mass_kg = 12
angle_deg = 90.0
count = 3
on = true
name = "cube"
colour = "blue"
at_mm = [1, 2.5, -3]
words = ["a", "b"]
matrix = [[1, 0.5], [0.5, 1]]
[[part]]
a_mm = 1.5
[[part]]
a_mm = 2
)";

TEST_CASE("A good text is read in SI") {
  FaultList faults;
  const Read read = ReadThing(kGood, faults);
  CHECK(FaultsText(faults).empty());
  CHECK(read.mass == 12.0);
  CHECK(*read.angle == Approx(1.5707963267948966).epsilon(1e-15));
  CHECK(read.count == 3);
  CHECK(read.on == true);
  CHECK(read.name == "cube");
  CHECK(read.colour == Colour::kBlue);
  CHECK(*read.at == Vec3(0.001, 0.0025, -0.003));
  CHECK(*read.words == std::vector<std::string>{"a", "b"});
  CHECK((*read.matrix)(0, 1) == 0.5);
  CHECK(read.parts == std::vector<double>{0.0015, 0.002});
}

TEST_CASE("Each kind of fault has its message, with file, line, key and value") {
  const std::vector<WrongLine> cases = {
      {"mass_kg = 12", "mass_kg = 900", "thing.mass_kg: 900 is outside 0..300"},
      {"mass_kg = 12", "mass_kg = -0.5", "thing.mass_kg: -0.5 is outside 0..300"},
      {"mass_kg = 12", "mass_kg = nan", "thing.mass_kg: nan is not a finite number"},
      {"mass_kg = 12", "mass_kg = -inf", "thing.mass_kg: -inf is not a finite number"},
      {"mass_kg = 12", "mass_kg = \"12\"", "thing.mass_kg: \"12\" is not a number"},
      {"mass_kg = 12", "mass_kg = true", "thing.mass_kg: true is not a number"},
      {"mass_kg = 12", "mass_kg = 2026-01-02", "thing.mass_kg: 2026-01-02 is not a number"},
      {"mass_kg = 12", "mass_kg = [1, 2]", "thing.mass_kg: [1, 2] is not a number"},
      {"mass_kg = 12", "", "@2 thing.mass_kg: missing; expected a number, 0..300"},
      {"count = 3", "count = 6", "thing.count: 6 is outside 1..5"},
      {"count = 3", "count = 3.0", "thing.count: 3 is not an integer"},
      {"count = 3", "count = 9223372036854775807",
       "thing.count: 9223372036854775807 is outside 1..5"},
      {"on = true", "on = 1", "thing.on: 1 is not true or false"},
      {"name = \"cube\"", "name = 7", "thing.name: 7 is not a string in quotes"},
      {"name = \"cube\"", "name = \"\"", "thing.name: \"\" is empty"},
      {"name = \"cube\"", "name = \"cube\\n0 faults\"",
       "thing.name: contains a line break; write the text in one line"},
      {"name = \"cube\"", "", "@2 thing.name: missing; expected a string in quotes"},
      {"colour = \"blue\"", "colour = \"green\"",
       "thing.colour: \"green\" is not one of \"red\", \"blue\""},
      {"at_mm = [1, 2.5, -3]", "at_mm = [1, 2]", "thing.at_mm: [1, 2] is not a list of 3 numbers"},
      {"at_mm = [1, 2.5, -3]", "at_mm = 5", "thing.at_mm: 5 is not a list of 3 numbers"},
      {"at_mm = [1, 2.5, -3]", "at_mm = [1, nan, 3]", "thing.at_mm[2]: nan is not a finite number"},
      {"at_mm = [1, 2.5, -3]", "at_mm = [1, 2, 2000]",
       "thing.at_mm[3]: 2000 is outside -1000..1000"},
      {"words = [\"a\", \"b\"]", "words = [\"a\", 3]",
       "thing.words[2]: 3 is not a string in quotes"},
      {"matrix = [[1, 0.5], [0.5, 1]]", "matrix = [[1, 0.5]]",
       "thing.matrix: [[1, 0.5]] is not a list of 2 lists of 2 numbers"},
      {"matrix = [[1, 0.5], [0.5, 1]]", "matrix = [[1, 0.5], [0.5]]",
       "thing.matrix[2]: [0.5] is not a list of 2 numbers"},
      {"matrix = [[1, 0.5], [0.5, 1]]", "matrix = [[1, 3], [0.5, 1]]",
       "thing.matrix[1][2]: 3 is outside -1..1"},
      {"on = true", "on = true\nangel_deg = 3",
       "@7 thing.angel_deg: unknown key; did you mean \"angle_deg\"?"},
      {"on = true", "on = true\nzzzz = 3", "@7 thing.zzzz: unknown key"},
      {"[[part]]\na_mm = 2", "[[part]]\na_mm = 20", "@15 part[2].a_mm: 20 is outside 0..10"},
      {"[[part]]\na_mm = 1.5", "[other]\nx = 1\n[[part]]\na_mm = 1", "@12 other: unknown key"},
  };
  ExpectOneFaultEach(kGood, "thing.toml", cases, [](const std::string& text, FaultList& faults) {
    ReadThing(text, faults);
    return !faults.HasFaults();
  });
}

TEST_CASE("A table of the wrong kind is told how to be written") {
  FaultList faults;
  ReadThing("thing = 3\n[part]\na_mm = 1\n", faults);
  CHECK(FaultsText(faults) ==
        "thing.toml:1 thing: 3 is not a table; write [thing]\n"
        "thing.toml:2 part: a table is not a list of tables; write [[part]]\n");
}

TEST_CASE("All faults of a text are told at once, in the order of its lines") {
  FaultList faults;
  ReadThing(
      "[thing]\nmass_kg = 900\nangle_deg = inf\non = 2\ncolor = \"red\"\n[[part]]\na_mm = 11\n",
      faults);
  CHECK(FaultsText(faults) ==
        "thing.toml:1 thing.name: missing; expected a string in quotes\nthing.toml:2 "
        "thing.mass_kg: 900 is outside 0..300\nthing.toml:3 thing.angle_deg: inf is not a finite "
        "number\nthing.toml:4 thing.on: 2 is not true or false\nthing.toml:5 thing.color: unknown "
        "key; did you mean \"colour\"?\nthing.toml:7 part[1].a_mm: 11 is outside 0..10\n");
}

TEST_CASE("A text that is no TOML is one fault with its line") {
  const std::vector<std::pair<std::string, int>> cases = {
      {"a = 1\nb = [1,\n", 2},    {"a = 1\na = 2\n", 2},
      {"a = 1\n[a]\n", 2},        {"= 3\n", 1},
      {"x = \"open\ny = 1\n", 1}, {std::string("a = \0\n", 6), 1},
      {"a = 1\xFF\n", 1}};
  for (const auto& [text, line] : cases) {
    FaultList faults;
    const TomlDocument document(text, "thing.toml", faults);
    CAPTURE(text, FaultsText(faults));
    CHECK_FALSE(document.parsed());
    REQUIRE(faults.All().size() == 1);
    CHECK_FALSE(faults.All()[0].what.empty());
    CHECK(faults.All()[0].column >= 1);
    CHECK(faults.All()[0].line == line);
  }
}

TEST_CASE("Deep nesting is refused, not followed to the end of the stack") {
  FaultList faults;
  const TomlDocument document("a = " + std::string(100000, '['), "thing.toml", faults);
  CHECK_FALSE(document.parsed());
}

TEST_CASE("A long or unprintable value is told short and on one line") {
  FaultList faults;
  ReadThing("[thing]\nmass_kg = \"" + std::string(5000, 'x') + "\"\nname = \"n\"\n" +
                "colour = \"a\\nb\"\n",
            faults);
  CHECK(FaultsText(faults) == "thing.toml:2 thing.mass_kg: \"" + std::string(60, 'x') +
                                  "...\" is not a number\n"
                                  "thing.toml:4 thing.colour: \"a?b\" is not one of \"red\", "
                                  "\"blue\"\n");
}

}  // namespace
}  // namespace plumbline::toml_reader_test
