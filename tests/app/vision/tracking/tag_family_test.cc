// Tag codes against the tags drawn by the AprilTag library and OpenCV.
#include "app/base/target/tag_family.h"

extern "C" {
#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>
}

#include <bit>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <memory>
#include <opencv2/aruco.hpp>
#include <random>

using namespace plumbline;

using namespace plumbline::vision;

namespace {

bool CodeBit(const target::TagFamily& family, int id, int r, int c) {
  const int n = family.data_cells;
  return ((family.codes[id] >> (n * n - 1 - (r * n + c))) & 1) != 0;
}

}  // namespace

TEST_CASE("AprilTag families: every tag matches the AprilTag library") {
  struct Named {
    const char* name;
    apriltag_family_t* (*create)();
    void (*destroy)(apriltag_family_t*);
    int ids, cells;
  };
  const auto named = GENERATE(Named{"36h11", tag36h11_create, tag36h11_destroy, 587, 6},
                              Named{"36h10", tag36h10_create, tag36h10_destroy, 2320, 6},
                              Named{"25h9", tag25h9_create, tag25h9_destroy, 35, 5},
                              Named{"16h5", tag16h5_create, tag16h5_destroy, 30, 4});
  CAPTURE(named.name);
  const auto family = target::TagFamilyOfName(named.name);
  REQUIRE(family.ok());
  CHECK(target::OpenCvTurns(*family));
  const std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)> printed(named.create(),
                                                                                 named.destroy);
  REQUIRE(family->codes.size() == printed->ncodes);
  REQUIRE(static_cast<int>(family->codes.size()) == named.ids);
  REQUIRE(family->data_cells == named.cells);
  int wrong = 0;
  for (int id = 0; id < named.ids; ++id) {
    image_u8_t* const image = apriltag_to_image(printed.get(), id);
    for (int r = 0; r < named.cells; ++r) {
      for (int c = 0; c < named.cells;
           ++c) {  // a white margin and the black border before the data
        wrong += CodeBit(*family, id, r, c) != (image->buf[(r + 2) * image->stride + c + 2] != 0);
      }
    }
    std::free(image->buf);  // Debian's library does not export image_u8_destroy
    std::free(image);
  }
  CHECK(wrong == 0);
}

TEST_CASE("the fewer bits a family has, the fewer are corrected; the smallest ones are strict") {
  const auto corrected = [](const char* name) {
    return target::TagFamilyOfName(name)->correctable_bits;
  };
  CHECK(corrected("36h11") == 2);
  CHECK(corrected("36h10") == 1);
  CHECK(corrected("25h9") == 0);
  CHECK(corrected("16h5") == 0);
  CHECK(corrected("aruco-4x4-50") == 0);
  CHECK_FALSE(target::TagFamilyOfName("36h11")->strict);
  CHECK_FALSE(target::TagFamilyOfName("25h9")->strict);
  CHECK(target::TagFamilyOfName("16h5")->strict);
  CHECK(target::TagFamilyOfName("aruco-4x4-50")->strict);
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
  const auto family = target::TagFamilyOfName(named.name);
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
  for (const char* name : {"36h11", "25h9", "16h5", "aruco-6x6-250", "aruco-4x4-50"}) {
    const auto family = target::TagFamilyOfName(name);
    REQUIRE(family.ok());
    const int bits = family->data_cells * family->data_cells;
    for (int round = 0; round < 200; ++round) {
      const int id = static_cast<int>(random() % family->codes.size());
      const int turns = static_cast<int>(random() % 4);
      std::uint64_t read = family->codes[id];
      for (int k = 0; k < turns; ++k) read = target::RotatedClockwise(read, family->data_cells);
      std::uint64_t spoilt = 0;
      while (std::popcount(spoilt) < family->correctable_bits) spoilt |= 1ULL << (random() % bits);
      const auto found = target::NearestTag(*family, read ^ spoilt);
      REQUIRE(found);
      CHECK(found->id == id);
      CHECK(found->turns == turns);
      CHECK(found->wrong_bits == family->correctable_bits);
    }
  }
}

TEST_CASE("Random cells are rarely decoded as a tag") {
  const auto family = target::TagFamilyOfName("36h11");
  REQUIRE(family.ok());
  CHECK(family->correctable_bits == 2);
  std::mt19937_64 random(2);
  int tags = 0;
  for (int round = 0; round < 20000; ++round)
    tags += target::NearestTag(*family, random() >> 28) ? 1 : 0;
  CHECK(tags <= 3);  // 0.5 expected
}

TEST_CASE("An unknown family is refused with the list of names") {
  const auto family = target::TagFamilyOfName("36h12");
  REQUIRE_FALSE(family.ok());
  CHECK(family.error().find("\"36h12\"") != std::string::npos);
  CHECK(family.error().find("aruco-4x4-50") != std::string::npos);
}
