#include <catch2/catch.hpp>

#include "app/hand_eye/hand_eye_json.h"
#include "app/printed_digits.h"

using namespace plumbline;

TEST_CASE("a deviation is printed with two significant digits at least") {
  CHECK(DecimalsFor({1.234}, 2) == 2);
  CHECK(DecimalsFor({0.12}, 2) == 2);
  CHECK(DecimalsFor({0.099}, 2) == 3);
  CHECK(DecimalsFor({0.0042}, 2) == 4);
  CHECK(DecimalsFor({12.0, 0.0042, 0.3}, 2) == 4);
  CHECK(DecimalsFor({1e-30}, 2) == 9);
  CHECK(DecimalsFor({0.0}, 2) == 2);  // nothing was estimated
}

TEST_CASE("a camera that is known to micrometres does not read as known exactly") {
  HandEye answer;
  answer.accepted = true;
  answer.camera.X.p = Vec3(1.2345678, -0.5, 0.25);
  Vec6 sd;
  sd << 4.2e-6, 3.1e-6, 11e-6, 2e-6, 2e-6, 1e-6;
  answer.camera.covariance = sd.cwiseAbs2().asDiagonal();
  answer.target = answer.camera;
  answer.point_sd_m = 2.5e-7;
  answer.size_ratio_sd = 3e-6;
  const std::string text = HandEyeText(answer, {});
  INFO(text);
  CHECK(text.find("1234.5678, -500.0000, 250.0000 mm (+- 0.0042, 0.0031, 0.0110)") !=
        std::string::npos);
  CHECK(text.find("0.00000 deg (+- 0.00017)") != std::string::npos);
  CHECK(text.find("known to 0.00025 mm (one deviation)") != std::string::npos);
  CHECK(text.find("the target is 1.0000000 +- 0.0000030 of its told size") != std::string::npos);
}
