#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "app/base/config/toml_reader.h"
#include "app/base/text/json_text.h"
#include "app/base/text/text.h"

namespace plumbline::nesting_test {

using namespace plumbline::text;

namespace {

constexpr int kFarTooMany = 100'000;

std::string Times(int count, std::string_view piece) {
  std::string text;
  for (int k = 0; k < count; ++k) text += piece;
  return text;
}

/// "a.a.a", of that many parts.
std::string DottedKey(int parts) {
  return Times(parts - 1, "a.") + "a";
}

std::string FaultsOfToml(const std::string& text) {
  config::FaultList faults;
  const config::TomlDocument document(text, "cell.toml", faults);
  CHECK(document.parsed() == !faults.HasFaults());
  return config::FaultsText(faults);
}

TEST_CASE("A TOML text nested too deeply is a fault with its line, and is never parsed") {
  const std::string text = GENERATE(
      "[" + DottedKey(kFarTooMany) + "]\n", "[[" + DottedKey(kFarTooMany) + "]]\n",
      "[" + Times(kFarTooMany, "a . \"b.c\" . ") + "a]\n", DottedKey(kFarTooMany) + " = 1\n",
      "a = " + Times(kFarTooMany, "[") + Times(kFarTooMany, "]") + "\n",
      "a = " + Times(kFarTooMany, "["), "a = [[1, 2],\n# c\n" + Times(kFarTooMany, "[{a = ["),
      "a = " + Times(kFarTooMany, "{ a = ") + "1" + Times(kFarTooMany, " }") + "\n",
      "a = { b = 1, " + DottedKey(kFarTooMany) + " = 1 }\n");
  const int line = text.starts_with("a = [[1, 2]") ? 5 : 3;
  CHECK(FaultsOfToml("schema = 1\n\n" + text) ==
        fmt::format("cell.toml:{}: {}\n", line, NestedTooDeepText()));
}

TEST_CASE("A text nested as deeply as allowed is read") {
  const int depth = kMaxNestingDepth;
  const std::string deepest = GENERATE_COPY(
      "[" + DottedKey(depth) + "]\n", DottedKey(depth) + " = 1\n",
      "a = " + Times(depth - 1, "[") + Times(depth - 1, "]") + "\n",
      "[a.b]\nc.d = { e.f = " + Times(depth - 7, "[") + Times(depth - 7, "]") + ", g.h = [] }\n");
  CHECK(FaultsOfToml(deepest).empty());
  CHECK_FALSE(LineNestedTooDeepInToml(deepest));
}

TEST_CASE("Levels of header, key and brackets add up") {
  const int depth = kMaxNestingDepth;
  CHECK(LineNestedTooDeepInToml("[" + DottedKey(depth) + "]\na = 1\n") == 2);
  CHECK(LineNestedTooDeepInToml("[a.b]\n" + DottedKey(depth - 1) + " = 1\n") == 2);
  CHECK(LineNestedTooDeepInToml("a = { " + DottedKey(depth - 1) + " = 1 }\n") == 1);
  CHECK_FALSE(LineNestedTooDeepInToml("a = { " + DottedKey(depth - 2) + " = 1 }\n"));
}

TEST_CASE("Brackets and dots in strings and comments, and long lists, do not count as nesting") {
  const std::string dots = Times(200, ".") + Times(200, "[{");
  const std::string text =
      GENERATE_COPY("# " + dots + "\na = 1\n", "a = \"" + dots + "\"\n", "a = '" + dots + "'\n",
                    "a = \"\\\"" + dots + "\\\\\"\n", "a = '\\' # " + dots + "\n",
                    "a = \"\"\"\n\"\" " + dots + " \\\"\"\"\"\"\"\n",
                    "a = '''\n'' \\" + dots + "'''''\n", "a = \"\" # " + dots + "\n",
                    "\"" + Times(200, ".") + "\".b = 1\n", "a = [" + Times(200, "1.5, ") + "2]\n",
                    "a = [ # " + dots + "\n 1, [2.0], [3.0] ]\n", "[a] # " + dots + "\nb = 1\n",
                    "\xEF\xBB\xBF# " + dots + "\n", "[[a.b]]\n" + Times(200, "[[a.b]]\nc = 1\n"));
  CHECK(FaultsOfToml(text).empty());
  CHECK_FALSE(LineNestedTooDeepInToml(text));
}

TEST_CASE("JSON nested too deeply is refused with its line before it is parsed") {
  for (const std::string_view piece : {"[", "{\"a\":", "[{\"a\":"}) {
    const auto json = JsonFromText("[1,\n" + Times(kFarTooMany, piece));
    REQUIRE_FALSE(json);
    CHECK(json.error() == "line 2: " + NestedTooDeepText());
  }
  const std::string deepest = Times(kMaxNestingDepth, "[") + Times(kMaxNestingDepth, "]");
  CHECK(JsonFromText(deepest).ok());
  CHECK_FALSE(JsonFromText("[" + deepest + "]").ok());
  CHECK(JsonFromText(R"({"a": "\"[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[["})").ok());
  CHECK(JsonFromText("{").error() == "is not JSON");
  CHECK(JsonOrNull("{").is_null());
}

}  // namespace
}  // namespace plumbline::nesting_test
