// plumbline calibrate-lens: lens calibration from images of a board.
#include <fmt/format.h>
#include <fnmatch.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/base/terminal/terminal_output.h"
#include "app/base/text/text.h"
#include "app/cli/board_option.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/cli/file_head.h"
#include "app/cli/number_option.h"
#include "app/cli/output_file.h"
#include "app/cli/progress.h"
#include "app/vision/lens/board_detection.h"
#include "app/vision/lens/board_view.h"
#include "app/vision/lens/calibration.h"
#include "app/vision/lens/chessboard_detection.h"
#include "app/vision/lens/lens_json.h"
#include "app/vision/lens_files/artoolkit_file.h"
#include "app/vision/lens_files/opencv_file.h"
#include "drivers/camera/image_file.h"
#include "drivers/files/open_failure.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::cli {
namespace {

// Detection of the calibration board in the images of a folder.

struct BoardFrames {
  std::vector<vision::BoardView> views;
  std::vector<vision::RefusedFrame> refused;
  image::ImageSize size;
  std::string size_conflict;  ///< no size is the most frequent one; empty: none
};

/// Detects the board in every image. Images whose size differs from the most frequent one are
/// refused.
/// @param names  of the images in the folder
BoardFrames DetectBoards(const std::string& folder, const std::vector<std::string>& names,
                         const target::Board& board, Progress& progress) {
  struct Found {
    vision::BoardView view;
    image::ImageSize size;
  };
  std::vector<Found> found;
  BoardFrames frames;
  std::map<std::pair<int, int>, int> sizes;
  for (std::size_t k = 0; k < names.size() && !Interruption::Requested(); ++k) {
    progress.ShowCount(k, names.size(), "images");
    const Result<camera::GreyImage> image =
        camera::ReadImage((std::filesystem::path(folder) / names[k]).string());
    if (!image) {
      frames.refused.push_back({names[k], image.error()});
      continue;
    }
    ++sizes[{image->width, image->height}];
    const Result<vision::BoardView> view = vision::DetectBoard(image->View(), board);
    if (!view) {
      frames.refused.push_back({names[k], view.error()});
      continue;
    }
    found.push_back({*view, {image->width, image->height}});
    found.back().view.name = names[k];
    found.back().view.time_s = static_cast<double>(k);
  }
  int most = 0;
  for (const auto& [size, count] : sizes) {
    if (count <= most) continue;
    most = count;
    frames.size = {size.first, size.second};
  }
  std::string tied;
  for (const auto& [size, count] : sizes) {
    if (count == most)
      tied += fmt::format("{}{} images are {} x {} px", tied.empty() ? "" : " and ", count,
                          size.first, size.second);
  }
  if (tied.find(" and ") != std::string::npos)
    frames.size_conflict = tied + ", but a lens belongs to one size; give images of one size";
  for (Found& one : found) {
    if (one.size == frames.size) {
      frames.views.push_back(std::move(one.view));
    } else {
      frames.refused.push_back(
          {one.view.name,
           fmt::format("{} x {} px, but the lens is calibrated for {} x {}", one.size.width,
                       one.size.height, frames.size.width, frames.size.height)});
    }
  }
  return frames;
}

/// Notes that the images after the last one used say nothing of the lens: a zoom there would not
/// show.
void NoteUnseenEnd(const std::vector<std::string>& names, const BoardFrames& frames,
                   vision::LensCalibration& calibration) {
  const auto last = std::ranges::find_if(names.rbegin(), names.rend(), [&](const auto& name) {
    return std::ranges::any_of(frames.views,
                               [&](const vision::BoardView& view) { return view.name == name; });
  });
  const auto unseen = last - names.rbegin();
  if (unseen == 0 || last == names.rend()) return;
  calibration.notes.push_back(fmt::format(
      "the last {} (from {}) {} no whole board: this is the lens at {}, and a zoom after "
      "that would not show",
      unseen == 1 ? "image" : fmt::format("{} images", unseen), *(last - 1),
      unseen == 1 ? "shows" : "show", *last));
}

/// Hint if most images show a complete chessboard of another size than requested; else empty.
std::string OtherBoardHint(const std::string& folder, const std::vector<std::string>& names,
                           const target::Board& board) {
  if (board.kind != target::BoardKind::kChessboard) return "";
  std::map<std::pair<int, int>, std::size_t> seen;
  std::size_t readable = 0;
  for (const std::string& name : names) {
    const auto image = camera::ReadImage((std::filesystem::path(folder) / name).string());
    if (!image || Interruption::Requested()) continue;
    ++readable;
    if (const auto size = vision::WholeChessboardIn(image->View())) ++seen[*size];
  }
  for (const auto& [size, count] : seen) {
    if (2 * count <= readable) continue;
    return fmt::format(
        "no image shows {} x {} inner corners, but {} of {} show {} x {}; try --board {}x{}",
        board.columns, board.rows, count, readable, size.first, size.second, size.first,
        size.second);
  }
  return "";
}

struct CalibrateLensOptions {
  std::string images, match = "*", json, yaml, xml, dat;
  BoardOptions board;
  std::optional<double> acceptable_px;
  double distance_mm = 0;
  target::DeclaredFacts declared;
  bool quiet = false;

  /// Options that name an output and their files, which may be empty.
  std::vector<std::pair<std::string, std::string>> Outputs() const {
    return {{"--json", json}, {"--yaml", yaml}, {"--xml", xml}, {"--dat", dat}};
  }
};

/// "k1 -0.1, k2 0.02, ..", with the kind of lens if it is not the usual one.
std::string DistortionText(const lens::Lens& lens) {
  const lens::LensModel model = ModelOf(lens);
  const lens::LensVector values = lens::VectorOfLens(lens);
  std::string text;
  for (Eigen::Index k = 4; k < lens::kLensParameters; ++k) {
    if (values[k] == 0 && (model != lens::LensModel::kUsual || k >= lens::kUsualParameters))
      continue;
    text += fmt::format("{}{} {:.5g}", text.empty() ? "" : ", ", lens::kLensParameterNames[k],
                        values[k]);
  }
  return model == lens::LensModel::kUsual ? text : fmt::format("{} ({})", text, ModelName(model));
}

std::string Summary(const vision::LensCalibration& c, std::size_t images) {
  std::string text = c.accepted ? "accepted\n" : "refused\n";
  for (const auto* lines : {&c.reasons, &c.notes}) {
    for (const std::string& line : *lines) text += "  " + line + "\n";
  }
  if (c.lens.fx > 0) {
    const auto sd = [&](int k) { return std::sqrt(c.covariance(k, k)); };
    const int f = text::DecimalsFor({sd(vision::kFx), sd(vision::kFy)}, 2),
              centre = text::DecimalsFor({sd(vision::kCx), sd(vision::kCy)}, 2);
    text += fmt::format(
        "  f        {:.{}f} x {:.{}f} px  (+- {:.{}f}, {:.{}f})\n"
        "  centre   {:.{}f}, {:.{}f} px  (+- {:.{}f}, {:.{}f})\n"
        "  distortion {}\n"
        "  standard deviation of the projection at most {:.3g} px over {} ({})\n"
        "  RMS residual {:.3f} px per point; board bow {:.2f} mm; corners cover {:.0f} % of the "
        "image\n",
        c.lens.fx, f, c.lens.fy, f, sd(vision::kFx), f, sd(vision::kFy), f, c.lens.cx, centre,
        c.lens.cy, centre, sd(vision::kCx), centre, sd(vision::kCy), centre, DistortionText(c.lens),
        c.uncertainty.max_px, UsableEverywhere(c) ? "the image" : "the usable region",
        c.uncertainty.distance_m ? fmt::format("at {:g} mm", 1e3 * *c.uncertainty.distance_m)
                                 : std::string("at infinity"),
        c.rms_px, 1e3 * c.board_bow_m, 100 * c.coverage);
  }
  const std::size_t used = c.frames_used.size(), refused = c.frames_refused.size();
  text += fmt::format("  {} images: {} used, {} refused{}\n", images, used, refused,
                      images > used + refused
                          ? fmt::format(", {} valid but not used", images - used - refused)
                          : "");
  for (const vision::RefusedFrame& frame : c.frames_refused)
    text += fmt::format("    {}: {}\n", frame.name, frame.reason);
  return text;
}

vision::LensEntry EntryOf(const vision::LensCalibration& calibration) {
  vision::LensEntry entry;
  static_cast<lens::KnownLens&>(entry) = calibration;
  entry.rms_px = calibration.rms_px;
  return entry;
}

/// "--" must not occur in a comment of XML; options are then written as "- -no-window".
std::string WithoutDashes(std::string text) {
  for (std::size_t at = 0; (at = text.find("--", at)) != std::string::npos;)
    text.insert(at + 1, " ");
  return text;
}

/// Text of a file of cv::FileStorage with the verdict and, as comments, its reasons above the
/// numbers, where a person who opens the file sees them.
/// @param begin    after this the keys start
/// @param verdict  the verdict's line, `{}` being 0 or 1
/// @param comment  a comment's line, `{}` being its text
std::string WithVerdict(std::string text, std::string_view begin, const char* verdict,
                        const char* comment, const vision::LensCalibration& calibration) {
  std::string mark = fmt::format(fmt::runtime(verdict), calibration.accepted ? 1 : 0);
  for (const std::string& reason : calibration.reasons) {
    const std::string words =
        fmt::format("{}: {}", calibration.accepted ? "note" : "refused", reason);
    mark += fmt::format(fmt::runtime(comment), WithoutDashes(words));
  }
  for (const std::string& words : calibration.notes)
    mark += fmt::format(fmt::runtime(comment), WithoutDashes("note: " + words));
  text.insert(text.find(begin) + begin.size(), mark);
  return text;
}

std::string Yaml(const vision::LensCalibration& calibration) {
  return WithVerdict(vision::OpenCvYaml(EntryOf(calibration)), "---\n", "accepted: {}\n", "# {}\n",
                     calibration);
}

std::string Xml(const vision::LensCalibration& calibration) {
  return WithVerdict(vision::OpenCvXml(EntryOf(calibration)), "<opencv_storage>\n",
                     "<accepted>{}</accepted>\n", "<!-- {} -->\n", calibration);
}

bool Write(const std::string& option, const std::string& path, const std::string& text) {
  if (path.empty() || path == "-") return true;
  return WriteOutput(path, text, option);
}

int Run(const CalibrateLensOptions& options) {
  const target::Board board = BoardOf(options.board);
  if (const std::string problem = BoardOptionProblem(board); !problem.empty()) {
    std::cerr << "plumbline calibrate-lens: " << problem << '\n';
    return kExitUsage;
  }
  const auto outputs = options.Outputs();
  for (const auto& [option, path] : outputs) {
    if (path.empty() || path == "-") continue;
    if (!CanWriteOutput(path, option)) return kExitUsage;
  }
  for (const auto& [option, path] : outputs) {
    for (const auto& [other, other_path] : outputs) {
      if (path.empty() || path == "-" || other <= option || !SameFile(path, other_path)) continue;
      std::cerr << fmt::format(
          "plumbline calibrate-lens: {} and {} are the same file; choose another\n", other, option);
      return kExitUsage;
    }
  }
  if (const auto wrong = WrongFileText(options.images, config::kWantedImageFolder)) {
    return Fail(fmt::format("{}: {}", options.images, *wrong));
  }
  Result<std::vector<std::string>> names = camera::ListImageNames(options.images);
  if (!names) {
    std::cerr << fmt::format("{}: {}\n", options.images,
                             files::ReadErrorText(options.images, names.error()));
    return kExitFault;
  }
  std::erase_if(names.value(), [&](const std::string& name) {
    return fnmatch(options.match.c_str(), name.c_str(), 0) != 0;
  });
  if (names->empty()) {
    std::cerr << fmt::format("{}: contains no image (png, jpg, bmp, tif, pgm) named {}\n",
                             options.images, options.match);
    return kExitFault;
  }
  for (const std::string& name : *names) {
    const std::string image = (std::filesystem::path(options.images) / name).string();
    for (const auto& [option, path] : outputs) {
      if (path.empty() || path == "-" || !SameFile(path, image)) continue;
      std::cerr << fmt::format(
          "plumbline calibrate-lens: {} would overwrite the input {}; choose another file\n",
          option, image);
      return kExitUsage;
    }
  }
  Interruption interruption;
  Progress progress(std::cerr, options.quiet);
  BoardFrames frames = DetectBoards(options.images, *names, board, progress);
  progress.Clear();
  if (Interruption::Requested()) return Interrupted();
  if (const Result<void> codecs = camera::CheckImageCodecs(); !codecs) return Fail(codecs.error());
  vision::CalibrationOptions criteria;
  if (options.acceptable_px) criteria.acceptable_px = *options.acceptable_px;
  criteria.accept_least = !options.acceptable_px;
  criteria.declared = options.declared;
  if (options.distance_mm > 0) criteria.distance_m = 1e-3 * options.distance_mm;
  vision::LensCalibration calibration =
      vision::CalibrateLens(board, frames.views, frames.size, criteria);
  if (!frames.size_conflict.empty()) {
    calibration.accepted = false;
    calibration.reasons = {frames.size_conflict};
  }
  if (frames.views.empty()) {
    const std::string hint = OtherBoardHint(options.images, *names, board);
    if (!hint.empty()) calibration.reasons.insert(calibration.reasons.begin(), hint);
  }
  if (calibration.accepted) NoteUnseenEnd(*names, frames, calibration);
  calibration.frames_refused.insert(calibration.frames_refused.begin(), frames.refused.begin(),
                                    frames.refused.end());
  if (!interruption.Disarm()) return Interrupted();
  if (!Write("--json", options.json, vision::LensJson(calibration)) ||
      !Write("--yaml", options.yaml, Yaml(calibration)) ||
      !Write("--xml", options.xml, Xml(calibration)))
    return kExitUsage;
  if (calibration.accepted) {
    const Result<std::string> dat = vision::ArToolKitBytes(calibration);
    if (!options.dat.empty() && !dat) {
      std::cerr << fmt::format("{}: not written: {}\n", options.dat, dat.error());
    } else if (dat && !Write("--dat", options.dat, *dat)) {
      return kExitUsage;
    }
  } else if (!options.dat.empty()) {
    std::cerr << fmt::format(
        "{}: not written: the calibration was refused, which this format cannot state\n",
        options.dat);
  }
  if (options.json == "-") std::cout << vision::LensJson(calibration);
  if (!options.quiet)
    (options.json == "-" ? std::cerr : std::cout)
        << terminal::ForReading << Summary(calibration, names->size());
  return kExitOk;
}

}  // namespace

void AddCalibrateLensCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<CalibrateLensOptions>();
  CLI::App* command =
      app.add_subcommand("calibrate-lens", "Calibrate a lens from images of a board");
  command->add_option("--images", options->images, "Folder of images, named in order of time")
      ->required();
  command->add_option("--match", options->match, "Use only images whose name matches, e.g. 'left*'")
      ->capture_default_str();
  AddBoardOptions(*command, options->board);
  command->add_option("--json", options->json, "Write the result as JSON; - is standard output");
  command->add_option("--yaml", options->yaml,
                      "Write the lens in OpenCV's format; \"accepted: 0\" marks a refused one");
  command->add_option("--xml", options->xml, "The same as XML");
  command->add_option("--dat", options->dat,
                      "Write an accepted lens as ARToolKit's camera_para.dat (without covariance)");
  command
      ->add_option("--acceptable-px", options->acceptable_px,
                   "Largest accepted standard deviation of the projection; if not given, 0.5 px if "
                   "the images can prove it, else what they prove, with a note")
      ->check(NumberWithin(0.001, 100));
  command
      ->add_option("--distance-mm", options->distance_mm,
                   "Evaluate the projection at this distance instead of at infinity")
      ->check(NumberWithin(1, 1e6));
  AddDeclarationOptions(*command, options->declared);
  command->add_flag("--quiet", options->quiet, "Print no summary");
  command->footer(
      "Take about 20 images at the same zoom and focus. They must show the whole board (part of "
      "it\n"
      "suffices for ChArUco), tilted by 20 to 40 degrees in all directions, also near the corners "
      "of\n"
      "the image. Circles are dark on white; acircles are counted as in OpenCV, 4x11 means rows of "
      "4.\n"
      "A refused calibration also has exit code 0, with \"accepted\": false and the remedy.\n\n"
      "Examples:\n"
      "  plumbline calibrate-lens --images frames --board 17x11 --square-mm 10 \\\n"
      "    --json lens.json\n"
      "  plumbline calibrate-lens --images frames --board 9x6 --square-mm 25 \\\n"
      "    --json - --quiet\n"
      "  plumbline calibrate-lens --images frames --board-kind charuco --board 4x6 \\\n"
      "    --square-mm 36.2 --mark-mm 18.3 --family aruco-6x6-250 --json lens.json\n"
      "  plumbline calibrate-lens --images frames --board-kind acircles --board 4x11 \\\n"
      "    --square-mm 20 --mark-mm 15 --json lens.json");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace plumbline::cli
