// Prints app/base/target/tag_codes.inc, the codes of all tag families, from OpenCV.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <opencv2/aruco.hpp>

namespace {

struct NamedDictionary {
  const char* name;
  cv::aruco::PREDEFINED_DICTIONARY_NAME dictionary;
  /// Of an AprilTag family, which OpenCV draws rotated by half a turn: the wrong bits that the
  /// distance of its codes allows to correct, (distance - 1) / 2. -1: an ArUco dictionary.
  int apriltag_bits = -1;
};

constexpr NamedDictionary kDictionaries[] = {
    {"36h11", cv::aruco::DICT_APRILTAG_36h11, 5},
    {"36h10", cv::aruco::DICT_APRILTAG_36h10, 4},
    {"25h9", cv::aruco::DICT_APRILTAG_25h9, 4},
    {"16h5", cv::aruco::DICT_APRILTAG_16h5, 2},
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

/// The data cells row by row from the top left, most significant bit first, 1 is white.
/// @param turned  rotate by half a turn
std::uint64_t CodeOf(const cv::aruco::Dictionary& dictionary, int id, bool turned) {
  const int bits = dictionary.markerSize * dictionary.markerSize;
  const cv::Mat cells = cv::aruco::Dictionary::getBitsFromByteList(
      dictionary.bytesList.rowRange(id, id + 1), dictionary.markerSize);
  std::uint64_t code = 0;
  for (int k = 0; k < bits; ++k) {
    code = (code << 1) | (cells.ptr()[turned ? bits - 1 - k : k] != 0 ? 1 : 0);
  }
  return code;
}

}  // namespace

int main() {
  std::puts(
      "// Written by tests/app/base/target/write_tag_codes.cc.\n#pragma once\n\n#include "
      "<cstdint>");
  std::puts("#include <span>\n#include <string_view>\n\nnamespace plumbline::tag_codes {\n");
  std::puts("struct Dictionary {\n  std::string_view name;\n  int data_cells;");
  std::puts("  int most_correctable_bits;\n  std::span<const std::uint64_t> codes;\n};\n");
  int number = 0;
  for (const auto& [name, key, apriltag_bits] : kDictionaries) {
    const auto dictionary = cv::aruco::getPredefinedDictionary(key);
    std::printf("inline constexpr std::uint64_t kCodes%d[] = {", number++);
    for (int id = 0; id < dictionary->bytesList.rows; ++id) {
      const std::uint64_t code = CodeOf(*dictionary, id, apriltag_bits >= 0);
      std::printf("%s0x%llx", id == 0 ? "" : ",", static_cast<unsigned long long>(code));
    }
    std::puts("};");
  }
  std::puts("\ninline constexpr Dictionary kDictionaries[] = {");
  number = 0;
  for (const auto& [name, key, apriltag_bits] : kDictionaries) {
    const auto dictionary = cv::aruco::getPredefinedDictionary(key);
    std::printf("    {\"%s\", %d, %d, kCodes%d},\n", name, dictionary->markerSize,
                apriltag_bits >= 0 ? apriltag_bits : std::max(0, dictionary->maxCorrectionBits),
                number++);
  }
  std::puts("};\n\n}  // namespace plumbline::tag_codes");
  return std::ferror(stdout) != 0 ? 1 : 0;
}
