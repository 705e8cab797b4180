// plumbline print: tags and calibration boards to scale, as PDF or SVG.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/cli/board_option.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/cli/number_option.h"
#include "app/cli/output_file.h"
#include "app/vision/print/board_sheet.h"
#include "app/vision/print/sheet_writer.h"
#include "app/vision/print/tag_sheets.h"
#include "drivers/files/package_paths.h"

namespace plumbline::cli {
namespace {

constexpr int kMaxTagId = 99999;
constexpr double kMinTagSize_mm = 5, kMaxTagSize_mm = 2000;

struct SheetOptions {
  std::string out, page = "A4";
};

struct PrintTagOptions {
  SheetOptions sheet;
  std::string family = "36h11";
  std::vector<std::string> ids;
  double size_mm = 0;
};

struct PrintBoardOptions {
  SheetOptions sheet;
  BoardOptions board;
};

/// First and last id of "7" or "3-8", or nullopt.
std::optional<std::pair<int, int>> IdRangeFromText(std::string_view text) {
  const auto id_from = [](std::string_view digits) -> std::optional<int> {
    int id = 0;
    const char* const end = digits.data() + digits.size();
    const auto [read, error] = std::from_chars(digits.data(), end, id);
    if (error != std::errc() || read != end || id < 0 || id > kMaxTagId) return std::nullopt;
    return id;
  };
  const std::size_t dash = text.find('-');
  const auto first = id_from(text.substr(0, dash));
  const auto last = dash == std::string_view::npos ? first : id_from(text.substr(dash + 1));
  if (!first || !last || *last < *first) return std::nullopt;
  return std::pair(*first, *last);
}

/// The ids given by --id, or what is wrong with them.
Result<std::vector<int>> IdsOf(const PrintTagOptions& options, const target::TagFamily& family) {
  const int count = static_cast<int>(family.codes.size());
  std::vector<int> ids;
  for (const std::string& text : options.ids) {
    const auto [first, last] = *IdRangeFromText(text);
    if (last >= count) {
      return Error{fmt::format("{} has no tag {}, only 0..{}", family.name, last, count - 1)};
    }
    for (int id = first; id <= last; ++id) {
      if (std::find(ids.begin(), ids.end(), id) != ids.end()) {
        return Error{fmt::format("{} is given twice; two tags of a cell need two ids", id)};
      }
      ids.push_back(id);
    }
  }
  return ids;
}

int UsageFault(const std::string& command, const std::string& option, const std::string& fault) {
  return Fail(
      fmt::format("plumbline {}: {}: {}; see plumbline {} --help", command, option, fault, command),
      kExitUsage);
}

/// Writes the file and prints how to print it.
int WriteSheets(const vision::Document& document, const SheetOptions& options,
                const std::string& command) {
  const bool svg = options.out.ends_with(".svg");
  const std::size_t count = document.sheets.size();
  if (svg && count > 1) {
    return UsageFault(command, "--output",
                      fmt::format("an SVG file holds one sheet, but {} are needed; choose a name "
                                  "that ends in .pdf, or fewer tags",
                                  count));
  }
  if (!CanWriteOutput(options.out, "--output")) return kExitUsage;
  const auto file =
      vision::FileOfSheets(document, svg ? vision::SheetFormat::kSvg : vision::SheetFormat::kPdf,
                           files::SiblingModule(vision::kSheetModuleFile));
  if (!file) return Fail(file.error(), kExitUsage);
  if (!WriteOutput(options.out, *file, "--output")) return kExitUsage;
  std::cout << fmt::format(
      "{}: {} sheet{}, {} {}. Print at 100 % (actual size), not fitted to the page; both rulers "
      "must then measure 100.0 mm.\n",
      options.out, count, count == 1 ? "" : "s", options.page,
      document.size.x() > document.size.y() ? "landscape" : "portrait");
  return kExitOk;
}

int PrintTags(const PrintTagOptions& options) {
  const std::string command = "print tag";
  const auto family = target::TagFamilyOfName(options.family);
  if (!family) return UsageFault(command, "--family", family.error());
  const auto ids = IdsOf(options, *family);
  if (!ids) return UsageFault(command, "--id", ids.error());
  const auto document =
      vision::TagSheets(*family, *ids, options.size_mm, *vision::PaperOfName(options.sheet.page));
  if (!document) return UsageFault(command, "--size-mm", document.error());
  if (const int code = WriteSheets(*document, options.sheet, command); code != kExitOk) return code;
  std::cout
      << "\nLines for bodies.toml; a tag on a body is a [[body.tag]] there, with its place:\n";
  for (const int id : *ids) {
    std::cout << '\n';
    for (const std::string& line : vision::TagLines(id, options.size_mm)) std::cout << line << '\n';
    if (const auto drawn_by = vision::DrawnByLine(*family)) std::cout << *drawn_by << '\n';
  }
  if (options.family != PrintTagOptions().family) {
    std::cout << fmt::format("\nIn [tags] of plumbline.toml:\n\nfamily = \"{}\"\n", options.family);
  }
  return kExitOk;
}

int PrintBoard(const PrintBoardOptions& options) {
  const std::string command = "print board";
  const target::Board board = BoardOf(options.board);
  if (const std::string problem = BoardOptionProblem(board); !problem.empty()) {
    return Fail(fmt::format("plumbline {}: {}; see plumbline {} --help", command, problem, command),
                kExitUsage);
  }
  const auto document = vision::BoardSheet(board, *vision::PaperOfName(options.sheet.page));
  if (!document) return UsageFault(command, "--square-mm", document.error());
  if (const int code = WriteSheets(*document, options.sheet, command); code != kExitOk) return code;
  std::cout << "\nLines for plumbline.toml:\n\n";
  for (const std::string& line : vision::BoardLines(board)) std::cout << line << '\n';
  return kExitOk;
}

void AddSheetOptions(CLI::App& command, SheetOptions& options) {
  command.add_option("--output,--out", options.out, "File to write; its name ends in .pdf or .svg")
      ->required()
      ->check([](const std::string& name) {
        return name.ends_with(".pdf") || name.ends_with(".svg")
                   ? ""
                   : name + " must end in .pdf or .svg";
      });
  command.add_option("--page", options.page, "Paper; portrait or landscape, as it fits")
      ->capture_default_str()
      ->check(CLI::IsMember({"A4", "A3", "letter"}));
}

void AddPrintTagCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<PrintTagOptions>();
  CLI::App* command = app.add_subcommand("tag", "Tags, as many on a sheet as fit");
  command->add_option("--family", options->family, "Tag family, one of " + target::TagFamilyNames())
      ->capture_default_str();
  command->add_option("--id", options->ids, "Ids: 7, or several: 3 4 5, or a range: 3-8")
      ->required()
      ->check(CLI::Validator(
          [](const std::string& text) {
            return IdRangeFromText(text) ? std::string()
                                         : text +
                                               " is neither an id, such as 7, nor a range, "
                                               "such as 3-8";
          },
          ""));
  command
      ->add_option("--size-mm", options->size_mm,
                   "Side of the black square, from outer edge to outer edge")
      ->required()
      ->check(NumberWithin(kMinTagSize_mm, kMaxTagSize_mm));
  AddSheetOptions(*command, options->sheet);
  command->footer(
      "Draws the tags upright, AprilTag families as their library does, with their white border, "
      "two\n"
      "rulers of 100 mm to check the scale of the printer, and the lines for bodies.toml, which "
      "are\n"
      "printed here as well. An SVG file holds one sheet, a PDF file any number.\n\n"
      "Examples:\n"
      "  plumbline print tag --id 7 --size-mm 80 --output tag7.pdf\n"
      "  plumbline print tag --id 0-3 10 11 --size-mm 60 --page A3 --output tags.pdf\n"
      "  plumbline print tag --family aruco-4x4-50 --id 7 --size-mm 120 \\\n"
      "      --output tag7.svg\n\n"
      "Exit codes: 0 the file was written, 2 wrong arguments, or the file cannot be written.");
  command->callback([options, &exit_code] { exit_code = PrintTags(*options); });
}

void AddPrintBoardCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<PrintBoardOptions>();
  CLI::App* command = app.add_subcommand("board", "A calibration board for calibrate-lens");
  AddBoardOptions(*command, options->board);
  AddSheetOptions(*command, options->sheet);
  command->footer(
      "Draws the board with two rulers of 100 mm to check the scale of the printer, and the table\n"
      "[board] for plumbline.toml, which is printed here as well. Glue the sheet onto a stiff, "
      "flat\n"
      "plate, measure the length below the pattern, and correct --square-mm by it.\n\n"
      "Examples:\n"
      "  plumbline print board --output board.pdf\n"
      "  plumbline print board --board 9x6 --square-mm 30 --page A3 --output board.pdf\n"
      "  plumbline print board --board-kind charuco --board 9x6 --square-mm 20 \\\n"
      "    --mark-mm 15 --family aruco-5x5-100 --output charuco.pdf\n"
      "  plumbline print board --board-kind acircles --board 4x11 --square-mm 15 \\\n"
      "    --mark-mm 11 --output circles.svg\n\n"
      "Exit codes: 0 the file was written, 2 wrong arguments, or the file cannot be written.");
  command->callback([options, &exit_code] { exit_code = PrintBoard(*options); });
}

}  // namespace

void AddPrintCommand(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("print", "Tags and calibration boards to scale, as PDF or SVG");
  command->require_subcommand(1);
  AddPrintTagCommand(*command, exit_code);
  AddPrintBoardCommand(*command, exit_code);
}

}  // namespace plumbline::cli
