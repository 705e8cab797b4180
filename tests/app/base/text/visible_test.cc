#include <catch2/catch.hpp>

#include "app/base/text/text.h"

namespace plumbline::visible_test {

using text::Visible;

TEST_CASE("ordinary text, tabs, line feeds and UTF-8 stay as they are") {
  const std::string text =
      "a\tb\n\xC2\xB1"
      "1 mm, \xE6\xB8\xAC\xE5\xAE\x9A, \xF0\x9F\xA6\xBE";
  CHECK(Visible(text) == text);
  CHECK(Visible("").empty());
}

TEST_CASE("what a terminal executes or reorders becomes visible") {
  CHECK(Visible("\033[2J") == "\\u001b[2J");
  CHECK(Visible("\a\b\r\x7F") == "\\u0007\\u0008\\u000d\\u007f");
  CHECK(Visible(std::string("a\0b", 3)) == "a\\u0000b");
  CHECK(Visible("\xC2\x9B"
                "31m") == "\\u009b31m");  // C1: CSI as one character
  CHECK(Visible("\xE2\x80\xAE"
                "gpj.exe") == "\\u202egpj.exe");  // right-to-left override
  CHECK(Visible("\xE2\x81\xA6") == "\\u2066");
  CHECK(Visible("\xE2\x80\xA8") == "\\u2028");
}

TEST_CASE("bytes that are not UTF-8 become visible one by one") {
  CHECK(Visible("\x9B"
                "2J") == "\\x9b2J");
  CHECK(Visible("\xC3") == "\\xc3");
  CHECK(Visible("\xC0\x9B") == "\\xc0\\x9b");           // overlong
  CHECK(Visible("\xE0\x82\x9B") == "\\xe0\\x82\\x9b");  // overlong C1
  CHECK(Visible("\xED\xA0\x80") == "\\xed\\xa0\\x80");  // surrogate
  CHECK(Visible("\xF4\x90\x80\x80") == "\\xf4\\x90\\x80\\x80");
  CHECK(Visible("\xE2\x80\xC3\xA9") == "\\xe2\\x80\xC3\xA9");
}

}  // namespace plumbline::visible_test
