// plumbline print: options, refusals, and what is written and printed.
#include <catch2/catch.hpp>
#include <filesystem>

#include "app/base/config/camera_config.h"
#include "app/base/config/named_files.h"
#include "app/cli/commands.h"
#include "drivers/files/text_file.h"
#include "tests/app/cli/run_command.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::print_command_test {

using plumbline::cli::AddPrintCommand;
using plumbline::test::Answer;
using plumbline::test::RunCommand;
using plumbline::test::TemporaryFolder;

TEST_CASE("print tag writes a PDF and prints the lines for bodies.toml") {
  const TemporaryFolder folder;
  const std::string out = folder.path() + "/tags.pdf";
  const Answer answer =
      RunCommand(AddPrintCommand, "print tag --id 3-5 9 --size-mm 40 --out " + out);
  INFO(answer.err);
  REQUIRE(answer.exit_code == 0);
  CHECK_THAT(answer.out, Catch::StartsWith(out + ": 1 sheet, A4 portrait. Print at 100 %") &&
                             Catch::Contains("both rulers must then measure 100.0 mm") &&
                             Catch::Contains("[[tag]]\nid = 3\nsize_mm = 40.0\n") &&
                             Catch::Contains("[[tag]]\nid = 9\nsize_mm = 40.0\n") &&
                             !Catch::Contains("family"));
  CHECK_THAT(files::ReadTextFile(out).value(), Catch::StartsWith("%PDF-"));
}

TEST_CASE("print tag with another family prints the key of [tags]; SVG by the ending of the name") {
  const TemporaryFolder folder;
  const std::string out = folder.path() + "/tag.svg";
  const Answer answer =
      RunCommand(AddPrintCommand,
                 "print tag --family aruco-4x4-50 --id 7 --size-mm 120 --page letter --out " + out);
  REQUIRE(answer.exit_code == 0);
  CHECK_THAT(answer.out, Catch::Contains("letter portrait") &&
                             Catch::Contains("[tags] of plumbline.toml:\n\nfamily = "
                                             "\"aruco-4x4-50\"\n"));
  CHECK_THAT(files::ReadTextFile(out).value(),
             Catch::Contains("width=\"215.9mm\" height=\"279.4mm\" viewBox=\"0 0 215.9 279.4\""));
}

TEST_CASE("print board prints the table [board]") {
  const TemporaryFolder folder;
  const Answer chessboard =
      RunCommand(AddPrintCommand, "print board --out " + folder.path() + "/board.pdf");
  REQUIRE(chessboard.exit_code == 0);
  CHECK_THAT(chessboard.out,
             Catch::Contains("1 sheet, A4 landscape") &&
                 Catch::Contains("[board]\nkind = \"chessboard\"\ncolumns = 17\nrows = 11\n"
                                 "square_mm = 10.0\n"));
  const Answer charuco = RunCommand(
      AddPrintCommand,
      "print board --board-kind charuco --board 9x6 --square-mm 20 --mark-mm 15 --family "
      "aruco-5x5-100 --out " +
          folder.path() + "/charuco.svg");
  REQUIRE(charuco.exit_code == 0);
  CHECK_THAT(charuco.out, Catch::Contains("mark_mm = 15.0\nfamily = \"aruco-5x5-100\"\n"));

  // Pasted into plumbline.toml, it declares the same board.
  const std::string table = charuco.out.substr(charuco.out.find("[board]"));
  config::FaultList faults;
  config::TomlDocument document(
      "[camera]\ndevice = \"cam\"\n[tags]\nfile = \"bodies.toml\"\n" + table, "plumbline.toml",
      faults);
  const config::FileSource files = [](const std::string&) {
    return Result<std::string>(
        "schema = 1\n[[body]]\nname = \"cell\"\nsize_mm = 60.0\n"
        "[[body.tag]]\nid = 1\nxyz_mm = [0, 0, 0]\n[[body.tag]]\nid = 2\nxyz_mm = [500, 0, 0]\n");
  };
  const config::VisionConfig vision = config::VisionFromToml(
      document.Root(), config::NamedFiles("plumbline.toml", files, ""), faults);
  INFO(config::FaultsText(faults));
  CHECK_FALSE(faults.HasFaults());
  CHECK(WordsOf(vision.board.board) == "charuco 9x6, 20 mm, mark 15 mm, aruco-5x5-100");
}

TEST_CASE("wrong options of print are refused, and nothing is written") {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& line, const std::string& message) {
    CAPTURE(line);
    const Answer answer = RunCommand(AddPrintCommand, "print " + line);
    CHECK(answer.exit_code == 2);
    CHECK_THAT(answer.err + answer.out, Catch::Contains(message));
    CHECK(std::filesystem::is_empty(folder.path()));
  };
  const std::string pdf = " --out " + folder.path() + "/a.pdf",
                    svg = " --out " + folder.path() + "/a.svg";
  refused("tag --id 7 --size-mm 80 --out a.png", "a.png must end in .pdf or .svg");
  refused("tag --id 7 --size-mm 80", "--output is required");
  refused("tag --id seven --size-mm 80" + pdf, "seven is neither an id, such as 7, nor a range");
  refused("tag --id 8-3 --size-mm 80" + pdf, "8-3 is neither an id");
  refused("tag --id 7 --size-mm 4" + pdf, "4 is not a number from 5 to 2000");
  refused("tag --id 7 --size-mm 80 --page A5" + pdf, "A5");
  refused("tag --id 587 --size-mm 80" + pdf,
          "plumbline print tag: --id: 36h11 has no tag 587, only 0..586; see plumbline print tag "
          "--help");
  refused("tag --id 3-5 4 --size-mm 80" + pdf, "--id: 4 is given twice");
  refused("tag --family 12h3 --id 7 --size-mm 80" + pdf, "--family: \"12h3\" is not a tag family");
  refused("tag --id 7 --size-mm 200" + pdf,
          "--size-mm: a tag of 200 mm takes 250.0 mm with its white border and does not fit on A4, "
          "which takes tags of up to 147.2 mm");
  refused("tag --id 0-7 --size-mm 100" + svg, "an SVG file holds one sheet, but 4 are needed");
  refused("tag --id 7 --size-mm 80 --out " + folder.path() + "/none/a.pdf", "cannot be written");
  refused("board --board 9x6 --square-mm 30" + pdf,
          "--square-mm: this board takes 314 x 224 mm with its white border and does not fit");
  refused("board --board-kind charuco" + pdf, "plumbline print board: --mark-mm: a ChArUco board");
}

}  // namespace plumbline::print_command_test
