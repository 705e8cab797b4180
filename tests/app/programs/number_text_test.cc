// Texts of numbers that replace others.
#include "app/programs/correction/number_text.h"

#include <catch2/catch.hpp>

namespace plumbline::number_text_test {

using namespace plumbline::programs;

namespace {

std::string Written(const std::string& old, double old_value, double value,
                    const NumberStyle& style = {}, double turn = 0) {
  return FormattedLike(old, old_value, value, style, turn).value_or("none");
}

}  // namespace

TEST_CASE("decimals stay as many, and get at least as many as the style") {
  CHECK(Written("1234.56789", 1234.56789, 1235.123456789) == "1235.12346");
  CHECK(Written("60", 60, 60.12345678) == "60.1235");
  CHECK(Written("1500", 1500, 1500.98765) == "1500.988");
  CHECK(Written("-0.5", -0.5, -0.4321987) == "-0.43220");
}

TEST_CASE("digits that do not change stay as they are written") {
  CHECK(Written("60", 60, 60.00004) == "60");
  CHECK(Written("1.500000", 1.5, 1.5) == "1.500000");
  CHECK(Written("1.16530820E-14", 1.16530820e-14, 1.16530820e-14) == "1.16530820E-14");
  CHECK(Written("-0.000", -0.0, 0) == "-0.000");
}

TEST_CASE("the leading zero and the plus sign stay as they are") {
  CHECK(Written(".350518879840", .35051887984, .351518879840) == ".351518879840");
  CHECK(Written("-.5", -.5, -.25) == "-.25000");
  CHECK(Written("0.25", .25, .5) == "0.50000");
  CHECK(Written(".5", .5, 1.5) == "1.50000");
  CHECK(Written("+12.345", 12.345, 12.5) == "+12.5000");
  CHECK(Written("+12.345", 12.345, -12.5) == "-12.5000");
}

TEST_CASE("an exponent stays where plain digits would hide the value") {
  CHECK(Written("1.2975335506409602E-10", 1.2975335506409602e-10, 2.5e-6) ==
        "2.5000000000000002E-06");
  CHECK(Written("1.1E-14", 1.1e-14, 0.0123456789) == "0.01235");
  CHECK(Written("1.5e+3", 1500, 2.5e7) == "2.50000e+7");
  CHECK(Written("1.5e3", 1500, 1234.5678) == "1234.568");
}

TEST_CASE("without significant digits in the style, only decimals count") {
  const NumberStyle decimals{.least_significant = 0, .least_decimals = 3};
  CHECK(Written("500.000", 500, 500.37581, decimals) == "500.376");
  CHECK(Written("500.000", 500, 99.37581, decimals) == "99.376");
  CHECK(Written("0.0", 0, -4.155999, decimals) == "-4.156");
  CHECK(Written("1.12345", 1.12345, 1.5, decimals) == "1.50000");
}

TEST_CASE("fixed numbers keep their decimals and the style of small ones") {
  const NumberStyle fixed{.least_significant = 1, .least_decimals = 3, .fixed = true};
  CHECK(Written(".968", .968, .9691, fixed) == ".969");
  CHECK(Written("0.000", 0, .1234, fixed) == "0.123");
  CHECK(Written("-.011", -.011, -.0001, fixed) == ".000");
  CHECK(Written("10.000", 10, .5, fixed) == ".500");
}

TEST_CASE("an angle keeps its text if only whole turns at its digits are between") {
  const NumberStyle fixed{.least_significant = 1, .least_decimals = 3, .fixed = true};
  CHECK(Written("-180.000", -180, 179.9998, fixed, 360) == "-180.000");
  CHECK(Written("-180.000", -180, -179.9998, fixed, 360) == "-180.000");
  CHECK(Written("190.000", 190, -169.9999, fixed, 360) == "190.000");
  CHECK(Written("-3.141593", -3.141593, 3.14159264, {}, 6.283185307179586) == "-3.141593");
  CHECK(Written("170", 170, -170, {}, 0) == "-170.000");  // a joint has no turns
}

TEST_CASE("a rounded angle stays within half a turn, and beyond it where the old one is") {
  CHECK(Written("179.99950", 179.9995, 180.00689, {}, 360) == "-179.99311");
  CHECK(Written("-179.999", -179.999, -180.0007, {}, 360) == "179.999");
  CHECK(Written("-179.5000", -179.5, 179.99999, {}, 360) == "-180.0000");
  CHECK(Written("190.000", 190, -168.5, {}, 360) == "191.500");
  CHECK(Written("-3.1400", -3.14, 3.141592, {}, 6.283185307179586) == "-3.14159");
}

TEST_CASE("fixed numbers stay right-aligned") {
  const NumberStyle fixed{.least_significant = 1, .least_decimals = 3, .fixed = true};
  const std::string bytes = "X =     9.876  mm";
  const Number number{{0, 8, 13}, 9.876};
  const auto longer = NumberEdit(bytes, number, 1234.5, fixed);
  REQUIRE(longer);
  CHECK(longer->text == "1234.500");
  CHECK(longer->begin == 5);
  const auto shorter = NumberEdit(bytes, number, .5, fixed);
  REQUIRE(shorter);
  CHECK(shorter->text == " .500");
  CHECK(shorter->begin == 8);
}

TEST_CASE("pulses are whole numbers") {
  CHECK(Written("-12345", -12345, -12345.6, {.integers = true}) == "-12346");
  CHECK(Written("7", 7, 7.4, {.integers = true}) == "7");
}

TEST_CASE("what is no number of that value is not replaced") {
  CHECK(Written("********", 0, 1) == "none");
  CHECK(Written("12", 13, 14) == "none");
  CHECK(Written("12", 12, 1e300) == "none");
}

}  // namespace plumbline::number_text_test
