#include <catch2/catch.hpp>

#include "app/base/text/text.h"
#include "app/vision/hand_eye/hand_eye_json.h"

namespace plumbline::hand_eye_text_test {

using namespace plumbline::vision;

TEST_CASE("a standard deviation is printed with at least two significant digits") {
  CHECK(text::DecimalsFor({1.234}, 2) == 2);
  CHECK(text::DecimalsFor({0.12}, 2) == 2);
  CHECK(text::DecimalsFor({0.099}, 2) == 3);
  CHECK(text::DecimalsFor({0.0042}, 2) == 4);
  CHECK(text::DecimalsFor({12.0, 0.0042, 0.3}, 2) == 4);
  CHECK(text::DecimalsFor({1e-30}, 2) == 9);
  CHECK(text::DecimalsFor({0.0}, 2) == 2);  // nothing was estimated
}

TEST_CASE("micrometre uncertainties are not printed as zero") {
  HandEye result;
  result.accepted = true;
  result.camera.X.p = Vec3(1.2345678, -0.5, 0.25);
  Vec6 sd;
  sd << 4.2e-6, 3.1e-6, 11e-6, 2e-6, 2e-6, 1e-6;
  result.camera.covariance = sd.cwiseAbs2().asDiagonal();
  result.target = result.camera;
  result.point_sd_m = 2.5e-7;
  result.size_ratio_sd = 3e-6;
  const std::string text = HandEyeText(result, {});
  INFO(text);
  CHECK(text.find("1234.5678, -500.0000, 250.0000 mm (+- 0.0042, 0.0031, 0.0110)") !=
        std::string::npos);
  CHECK(text.find("0.00000 deg (+- 0.00017)") != std::string::npos);
  CHECK(text.find("standard deviation of a point that the camera sees: 0.00025 mm") !=
        std::string::npos);
  CHECK(text.find("target size 1.0000000 +- 0.0000030 times the declared one") !=
        std::string::npos);
}

}  // namespace plumbline::hand_eye_text_test
