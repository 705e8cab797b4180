#include "firmware-like/result.h"

#include <catch2/catch.hpp>
#include <memory>
#include <string>

namespace plumbline::result_test {

using plumbline::Error;
using plumbline::Result;

namespace {

Result<int> Half(int number) {
  if (number % 2 != 0) return Error{std::to_string(number) + " is odd"};
  return number / 2;
}

Result<void> Positive(int number) {
  if (number <= 0) return Error{"not positive"};
  return {};
}

}  // namespace

TEST_CASE("a result has a value or an error", "[result]") {
  const Result<int> half = Half(6), none = Half(3);
  REQUIRE(half);
  CHECK(*half == 3);
  REQUIRE_FALSE(none);
  CHECK(none.error() == "3 is odd");
  CHECK(none.failure().message == none.error());
}

TEST_CASE("a void result reports success or the reason for failure", "[result]") {
  CHECK(Positive(1));
  const Result<void> no = Positive(-1);
  REQUIRE_FALSE(no);
  CHECK(no.error() == "not positive");
}

TEST_CASE("chained steps stop at the first failure", "[result]") {
  CHECK(Half(12).and_then(Half).value() == 3);
  CHECK(Half(6).and_then(Half).error() == "3 is odd");
  CHECK(Half(5).and_then(Half).error() == "5 is odd");
  CHECK(Half(8).transform([](int n) { return std::to_string(n); }).value() == "4");
  CHECK(Half(7).transform([](int n) { return std::to_string(n); }).error() == "7 is odd");
  CHECK(Half(8).and_then(Positive));
  CHECK(Half(-8).and_then(Positive).error() == "not positive");
  CHECK(Positive(4).and_then([] { return Half(4); }).value() == 2);
  CHECK(Positive(0).and_then([] { return Half(4); }).error() == "not positive");
  CHECK(Positive(4).transform([] { return 7; }).value() == 7);
  int seen = 0;
  CHECK(Half(8).transform([&seen](int n) { seen = n; }));
  CHECK(seen == 4);
  CHECK_FALSE(Positive(0).transform([&seen] { seen = 0; }));
  CHECK(seen == 4);
}

TEST_CASE("transform_error adds context to an error and leaves a value unchanged", "[result]") {
  const auto in_file = [](const std::string& why) { return "cell.toml: " + why; };
  CHECK(Half(3).transform_error(in_file).error() == "cell.toml: 3 is odd");
  CHECK(Half(4).transform_error(in_file).value() == 2);
  CHECK(Positive(0).transform_error(in_file).error() == "cell.toml: not positive");
  CHECK(Positive(1).transform_error(in_file));
}

TEST_CASE("move-only values are moved through", "[result]") {
  const auto made = [](int n) -> Result<std::unique_ptr<int>> { return std::make_unique<int>(n); };
  auto result = made(5).transform([](std::unique_ptr<int> p) {
    ++*p;
    return p;
  });
  REQUIRE(result);
  CHECK(*result.value() == 6);
}

}  // namespace plumbline::result_test
