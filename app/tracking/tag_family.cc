#include "app/tracking/tag_family.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <opencv2/aruco.hpp>

namespace plumbline {
namespace {

// Chance that a square of random cells is taken for some tag of the family; more bits are not
// corrected than keep it below this.
constexpr double kMostFalseTags = 3e-5;
constexpr int kCorrectable36h11 = 5;  // its codes differ by 11 bits at least

struct NamedDictionary {
  std::string_view name;
  cv::aruco::PREDEFINED_DICTIONARY_NAME dictionary;
};

constexpr NamedDictionary kDictionaries[] = {
    {"36h11", cv::aruco::DICT_APRILTAG_36h11},
    {"aruco-4x4-50", cv::aruco::DICT_4X4_50},
    {"aruco-4x4-100", cv::aruco::DICT_4X4_100},
    {"aruco-4x4-250", cv::aruco::DICT_4X4_250},
    {"aruco-4x4-1000", cv::aruco::DICT_4X4_1000},
    {"aruco-5x5-50", cv::aruco::DICT_5X5_50},
    {"aruco-5x5-100", cv::aruco::DICT_5X5_100},
    {"aruco-5x5-250", cv::aruco::DICT_5X5_250},
    {"aruco-5x5-1000", cv::aruco::DICT_5X5_1000},
    {"aruco-6x6-50", cv::aruco::DICT_6X6_50},
    {"aruco-6x6-100", cv::aruco::DICT_6X6_100},
    {"aruco-6x6-250", cv::aruco::DICT_6X6_250},
    {"aruco-6x6-1000", cv::aruco::DICT_6X6_1000},
    {"aruco-7x7-50", cv::aruco::DICT_7X7_50},
    {"aruco-7x7-100", cv::aruco::DICT_7X7_100},
    {"aruco-7x7-250", cv::aruco::DICT_7X7_250},
    {"aruco-7x7-1000", cv::aruco::DICT_7X7_1000},
    {"aruco-original", cv::aruco::DICT_ARUCO_ORIGINAL},
};

/// The largest h <= most with 4 N sum_{k <= h} C(n, k) / 2^n below kMostFalseTags; 0 at least.
int CorrectableBits(std::size_t codes, int bits, int most) {
  double ways = 1, sum = 1;
  int correctable = 0;
  for (int k = 1; k <= most; ++k) {
    ways *= static_cast<double>(bits - k + 1) / k;
    sum += ways;
    if (4 * static_cast<double>(codes) * sum / std::exp2(bits) > kMostFalseTags) break;
    correctable = k;
  }
  return correctable;
}

}  // namespace

std::uint64_t TurnedClockwise(std::uint64_t code, int n) {
  std::uint64_t turned = 0;
  for (int r = 0; r < n; ++r) {
    for (int c = 0; c < n; ++c) {
      const int from = (n - 1 - c) * n + r;  // row n-1-c, column r
      turned = (turned << 1) | ((code >> (n * n - 1 - from)) & 1);
    }
  }
  return turned;
}

Result<TagFamily> TagFamilyOfName(std::string_view name) {
  const auto* const named = std::find_if(std::begin(kDictionaries), std::end(kDictionaries),
                                         [&](const auto& d) { return d.name == name; });
  if (named == std::end(kDictionaries)) {
    return Error{fmt::format("\"{}\" is no tag family; one of {}", name, TagFamilyNames())};
  }
  const auto dictionary = cv::aruco::getPredefinedDictionary(named->dictionary);
  const bool apriltag = named->dictionary == cv::aruco::DICT_APRILTAG_36h11;
  TagFamily family;
  family.name = name;
  family.data_cells = dictionary->markerSize;
  const int bits = family.data_cells * family.data_cells;
  for (int id = 0; id < dictionary->bytesList.rows; ++id) {
    const cv::Mat cells = cv::aruco::Dictionary::getBitsFromByteList(
        dictionary->bytesList.rowRange(id, id + 1), family.data_cells);
    std::uint64_t code = 0;
    for (int k = 0; k < bits; ++k) code = (code << 1) | (cells.ptr()[k] != 0 ? 1 : 0);
    if (apriltag) {
      code = TurnedClockwise(TurnedClockwise(code, family.data_cells), family.data_cells);
    }
    family.codes.push_back(code);
  }
  family.correctable_bits =
      CorrectableBits(family.codes.size(), bits,
                      apriltag ? kCorrectable36h11 : std::max(0, dictionary->maxCorrectionBits));
  return family;
}

std::string TagFamilyNames() {
  std::string names;
  for (const NamedDictionary& named : kDictionaries) {
    if (!names.empty()) names += ", ";
    names += named.name;
  }
  return names;
}

std::optional<TagCode> NearestTag(const TagFamily& family, std::uint64_t read) {
  TagCode best{0, family.correctable_bits + 1, 0};
  // A tag turned clockwise by k quarters is upright after 4 - k more.
  for (int turns = 4; turns >= 1; --turns) {
    for (std::size_t id = 0; id < family.codes.size(); ++id) {
      const int wrong = std::popcount(family.codes[id] ^ read);
      if (wrong < best.wrong_bits) best = {static_cast<int>(id), wrong, turns % 4};
    }
    read = TurnedClockwise(read, family.data_cells);
  }
  if (best.wrong_bits > family.correctable_bits) return std::nullopt;
  return best;
}

}  // namespace plumbline
