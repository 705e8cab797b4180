#include "app/base/config/toml_error.h"

#include <catch2/catch.hpp>

#include "app/base/config/cell_reader.h"
#include "app/base/config/daemon_config_reader.h"
#include "app/base/config/header_lines.h"
#include "app/base/config/toml_reader.h"
#include "drivers/files/text_file.h"

namespace plumbline::toml_error_test {

using namespace plumbline::config;

namespace {

/// "2:8: what", of the one fault that a text has.
std::string FaultOf(const std::string& text) {
  FaultList faults;
  const TomlDocument document(text, "f", faults);
  REQUIRE(faults.All().size() == 1);
  return FaultText(faults.All()[0]);
}

std::string Shipped() {
  return files::ReadTextFile("config/plumbline.toml").value();
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

/// Faults and warnings of a plumbline.toml.
std::string FaultsOf(const std::string& text) {
  FaultList faults;
  DaemonConfigFromText(text, "config/plumbline.toml", files::ReadTextFile, "/nonexistent", faults);
  return FaultsText(faults);
}

}  // namespace

TEST_CASE("A syntax error names line, column, the mistake and what to write") {
  struct Case {
    std::string text, fault;
  };
  const Case cases[] = {
      {"[robot]\nhost = \"192.168.0.2\nport = 502\n",
       "f:2:20: the closing quote is missing; write: host = \"192.168.0.2\""},
      {"host = \"192.168.0.2  # the robot\n",
       "f:1:20: the closing quote is missing; write: host = \"192.168.0.2\""},
      {"host = 192.168.0.2\"\n",
       "f:1:8: the opening quote is missing; write: host = \"192.168.0.2\""},
      {"a = 1\nhost = 192.168.0.2  # robot\n",
       "f:2:8: a text is in quotes; write: host = \"192.168.0.2\""},
      {"host = robot\n", "f:1:8: a text is in quotes; write: host = \"robot\""},
      {"name = \"a'\n",
       "f:1:10: a text ends with the quote that it starts with; write: name = \"a\""},
      {"name = \u201Carm\u201D\n",
       "f:1:8: typographic quotes are not allowed; write: name = \"arm\""},
      {"device = \"C:\\data\"\n",
       "f:1:10: \\ in double quotes has a special meaning; use single quotes; write: device = "
       "'C:\\data'"},
      {"mass_kg = 2,5\n",
       "f:1:12: the decimal separator is a point, not a comma; write: mass_kg = 2.5"},
      {"mass_kg = .5\n", "f:1:11: a digit is missing in front of the point; write: mass_kg = 0.5"},
      {"mass_kg = 5.\n", "f:1:13: a digit is missing after the point; write: mass_kg = 5.0"},
      {"port = 0502\n", "f:1:8: a number has no leading zeros; write: port = 502"},
      {"mass = 5 kg\n",
       "f:1:9: a number has no unit behind it: the unit belongs to the key; write: mass = 5"},
      {"enabled = True\n",
       "f:1:11: yes or no is written true or false, in lower case; write: enabled = true"},
      {"enabled = off\n",
       "f:1:11: yes or no is written true or false, in lower case; write: enabled = false"},
      {"[page\nport = 1\n",
       "f:1:6: the header of a table has as many closing brackets as opening ones; write: [page]"},
      {"[[point]\nid = 1\n",
       "f:1:9: the header of a table has as many closing brackets as opening ones; write: "
       "[[point]]"},
      {"xyz_mm = [1, 2, 3\nid = 5\n",
       "f:1:18: the closing bracket is missing; write: xyz_mm = [1, 2, 3]"},
      {"xyz_mm = [1 2 -3]\n",
       "f:1:12: commas separate the elements of a list; write: xyz_mm = [1, 2, -3]"},
      {"xyz_mm = (1, 2)\n", "f:1:10: a list is in square brackets; write: xyz_mm = [1, 2]"},
      {"port = 1]\n", "f:1:9: the closing bracket has no opening one; write: port = 1"},
      {"port = 1;\n", "f:1:9: nothing follows the value, not even a comma or ;; write: port = 1"},
      {"// note\n", "f:1:1: a comment starts with #; write: # note"},
      {"port = 1 // note\n", "f:1:10: a comment starts with #; write: port = 1"},
      {"port: 1\n", "f:1:5: a key is followed by =, not by a colon; write: port = 1"},
      {"host: robot\n",
       "f:1:5: a key is followed by =, not by a colon, and a text is in quotes; write: host = "
       "\"robot\""},
      {"port 502\n", "f:1:6: = is missing after the key; write: port = 502"},
      {"port =\n", "f:1:7: the value is missing; write it after the =, or remove the line"},
      {"[plc]\nport = 1\nlisten = \"a\"\nport = 2\n",
       "f:4:1: \"port\" is given twice, first in line 2; keep one of them"},
      {"[plc]\nport = 1\n# [page]\nport = 2\n",
       "f:4:1: \"port\" is given twice, first in line 2; keep one of them; if this line belongs to "
       "[page], remove the # before [page] in line 3"},
      {"[a]\nx = 1\n[b]\n[a]\n",
       "f:4:1: [a] is given twice, first in line 1; write all its keys below one of the headers "
       "and remove the other"},
      {"[camera]\n\n[[camera]]\n",
       "f:3:1: [[camera]] is given as [camera] in line 1; write [[camera]] both times, or keep "
       "one"},
      {"a = \"\"\"x\nb = 1\n",
       "f:1:5: the text that starts with \"\"\" is not closed; write \"\"\" at its end"},
      {std::string("\xFF\xFE"
                   "a\0",
                   4),
       "f:1:1: the file is not UTF-8 but UTF-16; save it as UTF-8"},
      {"a = 1\n# \xB0\n",
       "f:2:2: a character is not UTF-8, for instance an umlaut or a degree sign in a comment; "
       "save "
       "the file as UTF-8"},
      {"port = 1\r\nhost = robot\r\n", "f:2:8: a text is in quotes; write: host = \"robot\""},
      {"a = 1 = 2\n",
       "f:1:7: not TOML: Error while parsing key-value pair: expected a comment or whitespace, saw "
       "'=': a = 1 = 2; correct this line"}};
  for (const Case& one : cases) {
    CAPTURE(one.text);
    CHECK(FaultOf(one.text) == one.fault);
  }
}

TEST_CASE("A syntax error repeats neither a token nor control characters") {
  CHECK(FaultOf("token = 0123abcd\n") == "f:1:9: a text is in quotes; write: token = \"...\"");
  for (const char* line : {"token\"9f86d081\"", "token\t'9f86d081'", "token'9f86d081'",
                           "\"token\"\"9f86d081\"", "  token\"9f86d081"}) {
    CAPTURE(line);
    const std::string fault = FaultOf(std::string(line) + "\n");
    CAPTURE(fault);
    CHECK(fault.find("9f86") == std::string::npos);
    CHECK(fault.find("token") != std::string::npos);
  }
  CHECK(FaultOf("host = a\x1B[2Jb\n").find('\x1B') == std::string::npos);
}

TEST_CASE("A key below a commented-out header belongs to that table, also where it is legal") {
  // As in files of the previous version, where [plc] was the last header above [page].
  std::string old = Shipped();
  const std::vector<HeaderLine> headers = HeaderLines(old);
  bool past_plc = false;
  for (auto header = headers.rbegin(); header != headers.rend(); ++header) {
    past_plc = past_plc || header->header == "[plc]";
    if (!past_plc && !header->header.starts_with("[[frame") && header->header != "[[point]]") {
      old.insert(header->begin, "# ");
    }
  }
  FaultList faults;
  DaemonConfigFromText(old, "config/plumbline.toml", files::ReadTextFile, "/nonexistent", faults);
  CAPTURE(FaultsText(faults));
  CHECK_FALSE(faults.HasFaults());
  const std::string port = FaultsOf(Replaced(old, "# port = 8080", "port = 8080"));
  CAPTURE(port);
  CHECK(port.find("port: this key belongs to [page], whose header in line") != std::string::npos);
  CHECK(port.find("remove the # before [page], or move this line above it") != std::string::npos);
  // `listen` is given in [plc] already: a syntax error that names the same remedy.
  const std::string listen =
      FaultsOf(Replaced(old, "# listen = \"127.0.0.1\"", "listen = \"127.0.0.1\""));
  CHECK(listen.find("if this line belongs to [page], remove the # before [page]") !=
        std::string::npos);
  // Unknown in [plc]: one fault, not two.
  const std::string exposure = FaultsOf(Replaced(old, "# exposure_ms", "exposure_ms"));
  CAPTURE(exposure);
  CHECK(exposure.find("exposure_ms: this key belongs to [camera]") != std::string::npos);
  CHECK(exposure.find("unknown key") == std::string::npos);
  // A key that the commented-out table does not have stays where it is.
  for (const char* header : {"# [page]", "# [mm]", "# [a, b]"}) {
    const std::string text =
        Replaced(old, "# [plc.rtu]", std::string(header) + "\nmax_clients = 7\n# [plc.rtu]");
    CHECK(FaultsOf(text).find("max_clients") == std::string::npos);
  }
  // The comment of [camera] in the supplied file mentions [camera.zoom], which has a `kind`, too.
  const std::string kind = FaultsOf(Replaced(Shipped(), "# kind = \"v4l2\"", "kind = \"v4l2\""));
  CAPTURE(kind);
  CHECK(kind.find("belongs") == std::string::npos);
  // The remedy works.
  std::string remedied = Replaced(old, "# port = 8080", "port = 8080");
  CHECK(FaultsOf(Replaced(remedied, "# [page] ", "[page]")).find("belongs") == std::string::npos);
}

TEST_CASE("Cells and profiles find misplaced keys, too") {
  const std::string cell = files::ReadTextFile("config/cells/ur10.toml").value();
  FaultList faults;
  CHECK_FALSE(CellFromText(cell + "# [measurement]\nsigma_mm = 0.05\n", "cell.toml", faults));
  CAPTURE(FaultsText(faults));
  CHECK(FaultsText(faults).find("sigma_mm: this key belongs to [measurement]") !=
        std::string::npos);
}

TEST_CASE("An unknown key of another table names that table") {
  const std::string faults =
      FaultsOf(Replaced(Shipped(), "[payload]", "exposure_ms = 8.0\n[payload]"));
  CHECK(faults.find("exposure_ms: unknown key here; it belongs to [camera]: write it below the "
                    "header [camera]") != std::string::npos);
}

TEST_CASE("An empty table counts as absent") {
  FaultList faults;
  TomlDocument document("[a]\n[[b]]\n[[b]]\n[c.d]\n[e]\nx = []\n[[f]]\n[[f]]\ny = 1\n", "f",
                        faults);
  const TomlTable root = document.Root();
  for (const char* empty : {"a", "c"}) {
    CHECK_FALSE(root.Has(empty));
    CHECK_FALSE(root.Table(empty));
    CHECK(root.TableOrTables(empty).empty());
  }
  CHECK(root.Tables("b").empty());
  CHECK(root.Table("e"));
  CHECK(root.Tables("f").size() == 2);
  CHECK(root.RequiredTable("a"));
  CHECK_FALSE(faults.HasFaults());
  CHECK_FALSE(root.RequiredTable("b"));
  CHECK(FaultsText(faults) == "f:2 b: [a table, a table] is not a table; write [b]\n");
}

}  // namespace plumbline::toml_error_test
