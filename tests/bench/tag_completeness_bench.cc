// Benchmark of the tags found under difficulties and in photographs, against AprilTag (without
// decimation and with 2) and OpenCV's ArUco on the same images in the same run.
//   tag_completeness_bench [--seed N] [--photographs FOLDER]
// N: of the first generated scene. FOLDER: photographs NAME.jpg with their tags in NAME.txt, as in
// test/data of github.com/AprilRobotics/apriltag; also taken from $PLUMBLINE_TAG_PHOTOGRAPHS.
#include <fmt/core.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "tests/app/vision/tracking/hard_scenes.h"
#include "tests/bench/bench_timing.h"
#include "tests/bench/rows.h"
#include "tests/bench/tag_peers.h"

using namespace plumbline;
using bench::Peers, bench::Seen;

namespace {

/// A tag that an image shows.
struct Truth {
  int id = 0;
  vision::Corners corners;
};

lens::Vec2 Middle(const vision::Corners& corners) {
  return 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
}

double LargestSide(const vision::Corners& corners) {
  double largest = 0;
  for (int k = 0; k < 4; ++k)
    largest = std::max(largest, (corners[(k + 1) % 4] - corners[k]).norm());
  return largest;
}

struct Score {
  int tags = 0, found = 0;
  int others = 0;  ///< detections that are not among the truths, but have the number of one
  int wrong = 0;   ///< all other detections
  double squares = 0;

  void Add(const std::vector<Truth>& truths, const Seen& seen) {
    tags += static_cast<int>(truths.size());
    std::vector<bool> matched(seen.size(), false);
    for (const Truth& truth : truths) {
      for (std::size_t k = 0; k < seen.size(); ++k) {
        const double reach_px = 0.2 * LargestSide(truth.corners);
        if (matched[k] || seen[k].first != truth.id ||
            (Middle(seen[k].second) - Middle(truth.corners)).norm() > reach_px)
          continue;
        matched[k] = true;
        ++found;
        for (int c = 0; c < 4; ++c) squares += (seen[k].second[c] - truth.corners[c]).squaredNorm();
        break;
      }
    }
    for (std::size_t k = 0; k < seen.size(); ++k) {
      if (matched[k]) continue;
      const bool other = std::ranges::any_of(
          truths, [&](const Truth& truth) { return truth.id == seen[k].first; });
      ++(other ? others : wrong);
    }
  }
  double rmse() const { return std::sqrt(squares / std::max(1, 8 * found)); }
};

Seen SeenBy(vision::TagDetector& detector, const renderer::Image& image) {
  vision::SeenTags found;
  detector.Detect({image.grey.data(), image.width, image.height, image.width}, nullptr, found);
  Seen seen;
  for (const vision::SeenTag& tag : found.tags) seen.emplace_back(tag.id, tag.corners_px);
  return seen;
}

/// All detectors on the same images.
struct Comparison {
  static const target::TagFamily& Family() {
    static const target::TagFamily family = *target::TagFamilyOfName("36h11");
    return family;
  }
  vision::TagDetector detector{Family(), {.strict = true}};
  Peers whole{1}, half{2};
  Score ours, april, april_half, aruco;

  void Add(const std::vector<Truth>& truths, renderer::Image& image) {
    ours.Add(truths, SeenBy(detector, image));
    april.Add(truths, whole.April(image));
    april_half.Add(truths, half.April(image));
    aruco.Add(truths, whole.Aruco(image));
  }
  void Print(const std::string& what) const {
    const auto print = [&](const char* who, const Score& score) {
      fmt::print("| {} | {} | {} of {} | {} | {} | {:.3f} |\n", what, who, score.found, score.tags,
                 score.others, score.wrong, score.rmse());
    };
    print("Plumbline", ours);
    print("AprilTag, no decimation", april);
    print("AprilTag, decimate 2", april_half);
    print("OpenCV ArUco", aruco);
    bench::Report({.what = fmt::format("{}: tags found of {}", what, ours.tags),
                   .ours = static_cast<double>(ours.found),
                   .goal = bench::RatioAtLeast(1),
                   .peer = "AprilTag, the better of no decimation and 2",
                   .peers = static_cast<double>(std::max(april.found, april_half.found)),
                   .timed = false});
  }
};

void HardScenes(int scenes, std::uint64_t first_seed) {
  for (const test::NamedDifficulty& difficulty : test::kDifficulties) {
    Comparison comparison;
    for (int k = 0; k < scenes; ++k) {
      test::HardScene scene =
          test::MakeHardScene(Comparison::Family(), difficulty.kind, first_seed + k);
      comparison.Add({{scene.id, scene.corners}}, scene.image);
    }
    comparison.Print(difficulty.name);
  }
}

std::vector<Truth> ReadTruths(const std::filesystem::path& file) {
  std::vector<Truth> truths;
  std::ifstream lines(file);
  for (std::string line; std::getline(lines, line);) {
    Truth truth;
    double p[8];
    if (std::sscanf(line.c_str(), "%d, (%lf %lf), (%lf %lf), (%lf %lf), (%lf %lf)", &truth.id,
                    &p[0], &p[1], &p[2], &p[3], &p[4], &p[5], &p[6], &p[7]) != 9)
      continue;
    // See Peers::April.
    for (int c = 0; c < 4; ++c)
      truth.corners[c] = lens::Vec2(p[2 * (3 - c)] - 0.5, p[2 * (3 - c) + 1] - 0.5);
    truths.push_back(truth);
  }
  return truths;
}

void Photographs(const std::string& folder) {
  const char* const what = "photographs";
  if (folder.empty() || !std::filesystem::is_directory(folder)) {
    bench::ReportSkipped(what, folder.empty() ? "no folder given with --photographs"
                                              : fmt::format("no folder {}", folder));
    return;
  }
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".jpg") files.push_back(entry.path());
  }
  std::ranges::sort(files);
  Comparison comparison;
  for (std::filesystem::path file : files) {
    const cv::Mat read = cv::imread(file.string(), cv::IMREAD_GRAYSCALE);
    const auto truths = ReadTruths(file.replace_extension(".txt"));
    if (read.empty() || truths.empty()) continue;
    renderer::Image image{
        read.cols, read.rows, {read.begin<std::uint8_t>(), read.end<std::uint8_t>()}};
    comparison.Add(truths, image);
  }
  comparison.Print(what);
}

/// The value that follows `name` among the arguments, or `otherwise`.
std::string Argument(int argc, char** argv, std::string_view name, const char* otherwise) {
  for (int k = 1; k + 1 < argc; ++k) {
    if (argv[k] == name) return argv[k + 1];
  }
  return otherwise != nullptr ? otherwise : "";
}

}  // namespace

int main(int argc, char** argv) {
  const bench::Effort effort = bench::EffortFrom(argc, argv);
  fmt::print(
      "Others: not listed, but with the number of a listed tag, as all tags of a kind have in the\n"
      "photographs; their lists are detections of an AprilTag version and not complete.\n\n"
      "| scene | detector | found | others | wrong | corner RMSE px "
      "|\n|---|---|---|---|---|---|\n");
  const std::string seed = Argument(argc, argv, "--seed", "1");
  HardScenes(bench::Choose(effort, 2, 60, 200), std::strtoull(seed.c_str(), nullptr, 10));
  Photographs(Argument(argc, argv, "--photographs", std::getenv("PLUMBLINE_TAG_PHOTOGRAPHS")));
}
