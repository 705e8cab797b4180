#include "drivers/camera/pgm_image.h"

#include <catch2/catch.hpp>

namespace plumbline::pgm_image_test {

using namespace plumbline::camera;

TEST_CASE("PGM: pixels, comments and trailing bytes") {
  const auto image = GreyFromPgm("P5 # made by hand\n# 3 x 2\n3\t2\n255\nabcdefMORE");
  REQUIRE(image);
  CHECK(image->width == 3);
  CHECK(image->height == 2);
  CHECK(std::string(image->grey.begin(), image->grey.end()) == "abcdef");
  // One white space ends the header, whatever the first pixel is.
  const auto blank = GreyFromPgm("P5 1 1 255\n\n");
  REQUIRE(blank);
  CHECK(blank->grey.at(0) == '\n');
}

TEST_CASE("PGM: faults are reported") {
  const auto fault = [](std::string_view bytes) { return GreyFromPgm(bytes).error(); };
  CHECK_THAT(fault(""), Catch::Contains("does not start with P5"));
  CHECK_THAT(fault("\x89PNG"), Catch::Contains("Convert the images of the recording"));
  CHECK_THAT(fault("P5 3 2"), Catch::Contains("invalid header"));
  CHECK_THAT(fault("P5 3 2 255"), Catch::Contains("invalid header"));
  CHECK_THAT(fault("P5 0 2 255\n"), Catch::Contains("0 x 2 px"));
  CHECK_THAT(fault("P5 99999 2 255\n"), Catch::Contains("1..16384"));
  CHECK_THAT(fault("P5 99999999999 2 255\n"), Catch::Contains("invalid header"));
  CHECK_THAT(fault("P5 3 2 65535\nabcdef"), Catch::Contains("maximum value 65535"));
  CHECK_THAT(fault("P5 3 2 255\nabcde"), Catch::Contains("5 bytes of pixels, but 3 x 2 px need 6"));
}

}  // namespace plumbline::pgm_image_test
