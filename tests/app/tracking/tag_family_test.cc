// Tag codes against the tags drawn by the AprilTag library and OpenCV.
#include "app/tracking/tag_family.h"

extern "C" {
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
}

#include <bit>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <memory>
#include <opencv2/aruco.hpp>
#include <random>

using namespace plumbline;

using namespace plumbline::tracking;

namespace {

bool CodeBit(const TagFamily& family, int id, int r, int c) {
  const int n = family.data_cells;
  return ((family.codes[id] >> (n * n - 1 - (r * n + c))) & 1) != 0;
}

}  // namespace

TEST_CASE("36h11: every tag matches the AprilTag library") {
  const auto family = TagFamilyOfName("36h11");
  REQUIRE(family.ok());
  const std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)> printed(tag36h11_create(),
                                                                                 tag36h11_destroy);
  REQUIRE(family->codes.size() == printed->ncodes);
  CHECK(family->codes.size() == 587);
  CHECK(family->data_cells == 6);
  for (int id = 0; id < 587; ++id) {
    image_u8_t* const image = apriltag_to_image(printed.get(), id);
    int wrong = 0;
    for (int r = 0; r < 6; ++r) {
      for (int c = 0; c < 6; ++c) {  // a white margin and the black border before the data
        wrong += CodeBit(*family, id, r, c) != (image->buf[(r + 2) * image->stride + c + 2] != 0);
      }
    }
    std::free(image->buf);  // Debian's library does not export image_u8_destroy
    std::free(image);
    CHECK(wrong == 0);
  }
}

TEST_CASE("ArUco: every tag matches OpenCV's drawing") {
  struct Named {
    const char* name;
    cv::aruco::PREDEFINED_DICTIONARY_NAME dictionary;
    int ids, cells;
  };
  const auto named = GENERATE(Named{"aruco-4x4-50", cv::aruco::DICT_4X4_50, 50, 4},
                              Named{"aruco-5x5-250", cv::aruco::DICT_5X5_250, 250, 5},
                              Named{"aruco-6x6-1000", cv::aruco::DICT_6X6_1000, 1000, 6},
                              Named{"aruco-7x7-100", cv::aruco::DICT_7X7_100, 100, 7},
                              Named{"aruco-original", cv::aruco::DICT_ARUCO_ORIGINAL, 1024, 5});
  CAPTURE(named.name);
  const auto dictionary = cv::aruco::getPredefinedDictionary(named.dictionary);
  const auto family = TagFamilyOfName(named.name);
  REQUIRE(family.ok());
  REQUIRE(static_cast<int>(family->codes.size()) == named.ids);
  REQUIRE(family->data_cells == named.cells);
  for (int id = 0; id < named.ids; ++id) {
    cv::Mat drawn;
    cv::aruco::drawMarker(dictionary, id, named.cells + 2, drawn, 1);
    int wrong = 0;
    for (int r = 0; r < named.cells; ++r) {
      for (int c = 0; c < named.cells; ++c) {
        wrong += CodeBit(*family, id, r, c) != (drawn.at<std::uint8_t>(r + 1, c + 1) != 0);
      }
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE(
    "A tag is decoded in every orientation, with up to the correctable number of wrong cells") {
  std::mt19937_64 random(1);
  for (const char* name : {"36h11", "aruco-6x6-250", "aruco-4x4-50"}) {
    const auto family = TagFamilyOfName(name);
    REQUIRE(family.ok());
    const int bits = family->data_cells * family->data_cells;
    for (int round = 0; round < 200; ++round) {
      const int id = static_cast<int>(random() % family->codes.size());
      const int turns = static_cast<int>(random() % 4);
      std::uint64_t read = family->codes[id];
      for (int k = 0; k < turns; ++k) read = RotatedClockwise(read, family->data_cells);
      std::uint64_t spoilt = 0;
      while (std::popcount(spoilt) < family->correctable_bits) spoilt |= 1ULL << (random() % bits);
      const auto found = NearestTag(*family, read ^ spoilt);
      REQUIRE(found);
      CHECK(found->id == id);
      CHECK(found->turns == turns);
      CHECK(found->wrong_bits == family->correctable_bits);
    }
  }
}

TEST_CASE("Random cells are rarely decoded as a tag") {
  const auto family = TagFamilyOfName("36h11");
  REQUIRE(family.ok());
  CHECK(family->correctable_bits == 2);
  std::mt19937_64 random(2);
  int tags = 0;
  for (int round = 0; round < 20000; ++round) tags += NearestTag(*family, random() >> 28) ? 1 : 0;
  CHECK(tags <= 3);  // 0.5 expected
}

TEST_CASE("An unknown family is refused with the list of names") {
  const auto family = TagFamilyOfName("36h12");
  REQUIRE_FALSE(family.ok());
  CHECK(family.error().find("\"36h12\"") != std::string::npos);
  CHECK(family.error().find("aruco-4x4-50") != std::string::npos);
}
