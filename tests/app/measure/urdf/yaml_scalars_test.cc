#include "app/base/text/yaml_scalars.h"

#include <catch2/catch.hpp>

namespace plumbline::yaml_scalars_test {

TEST_CASE("scalars of a YAML text carry their path and line") {
  const auto scalars = text::ScalarsFromYaml("a:\n  b: 1\n  c: [x, {d: y}]\nempty:\n'k': z\n");
  REQUIRE(scalars);
  REQUIRE(scalars->size() == 4);
  CHECK((*scalars)[0].path == "a.b");
  CHECK((*scalars)[0].line == 2);
  CHECK((*scalars)[1].path == "a.c[1]");
  CHECK((*scalars)[2].path == "a.c[2].d");
  CHECK((*scalars)[2].value == "y");
  CHECK((*scalars)[3].path == "k");
}

TEST_CASE("aliases that expand without bound, deep nesting and bad syntax are refused") {
  std::string bomb = "a0: &a0 [1,1,1,1,1,1,1,1,1,1]\n";
  for (int i = 1; i < 12; ++i) {
    const std::string last = "*a" + std::to_string(i - 1);
    bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [";
    for (int k = 0; k < 10; ++k) bomb += (k > 0 ? "," : "") + last;
    bomb += "]\n";
  }
  CHECK_FALSE(text::ScalarsFromYaml(bomb));
  // Few scalars, but each an alias of a long one.
  std::string long_values = "a: &a " + std::string(1000000, 'x') + "\nb: [";
  for (int i = 0; i < 100; ++i) long_values += i > 0 ? ",*a" : "*a";
  const auto expanded = text::ScalarsFromYaml(long_values + "]\n");
  REQUIRE_FALSE(expanded);
  CHECK_THAT(expanded.error(), Catch::Contains("more than 64 MiB"));
  CHECK_FALSE(text::ScalarsFromYaml(std::string(30, '[') + std::string(30, ']')));
  CHECK_FALSE(text::ScalarsFromYaml(std::string(100000, '[')));
  const auto broken = text::ScalarsFromYaml("a: [1, 2\nb: 3\n");
  REQUIRE_FALSE(broken);
  CHECK_THAT(broken.error(), Catch::Contains("line "));
  CHECK(text::ScalarsFromYaml("")->empty());
}

}  // namespace plumbline::yaml_scalars_test
