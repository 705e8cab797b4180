#include "app/programs/brands/source_cursor.h"

#include <catch2/catch.hpp>

namespace plumbline::source_cursor_test {

using namespace plumbline::programs;

TEST_CASE("LF, CRLF and CR end a line, also mixed") {
  const std::string text = "a\nbc\r\n\rd";
  const LineIndex lines(text);
  REQUIRE(lines.count() == 4);
  CHECK(lines.Text(1) == "a");
  CHECK(lines.Text(2) == "bc");
  CHECK(lines.Text(3).empty());
  CHECK(lines.Text(4) == "d");
  CHECK(lines.LineEnd(1) == "\n");
  CHECK(lines.LineEnd(2) == "\r\n");
  CHECK(lines.LineEnd(3) == "\r");
  CHECK(lines.LineEnd(4).empty());
  CHECK(lines.UsualLineEnd() == "\n");
  const std::vector<int> line_of_byte = {1, 1, 2, 2, 2, 2, 3, 4};
  for (std::size_t at = 0; at < text.size(); ++at) {
    CAPTURE(at);
    CHECK(lines.LineAt(at) == line_of_byte[at]);
  }
  CHECK(lines.LineAt(text.size() + 5) == 4);
}

TEST_CASE("a text without line ends has one line, and an inserted line would end with LF") {
  CHECK(LineIndex("").count() == 1);
  CHECK(LineIndex("").LineAt(0) == 1);
  CHECK(LineIndex("x").UsualLineEnd() == "\n");
  CHECK(LineIndex("x\r\ny").UsualLineEnd() == "\r\n");
}

TEST_CASE("words are compared without regard to case, bytes above 127 by value") {
  CHECK(SameWord("Ptp_Rel", "PTP_REL"));
  CHECK_FALSE(SameWord("PTP", "PTP_REL"));
  CHECK_FALSE(SameWord("\xC4", "\xE4"));
  CHECK(StartsWithWord("Defdat x", "DEFDAT"));
  CHECK_FALSE(StartsWithWord("DEF", "DEFDAT"));
  CHECK(Lowered("STool_2\xC4") == "stool_2\xC4");
  CHECK(TrimBlanks(" \ta b\t ") == "a b");
}

TEST_CASE("numbers are found with their span") {
  for (const auto& [text, value, length] : {std::tuple{"60,", 60.0, 2},
                                            {"-.968 mm", -0.968, 5},
                                            {"+9E+09]", 9e9, 6},
                                            {"1.16530820E-14}", 1.1653082e-14, 14},
                                            {"5.]", 5.0, 2},
                                            {"0", 0.0, 1}}) {
    CAPTURE(text);
    SourceCursor cursor(text, 3);
    const auto number = cursor.TakeNumber();
    REQUIRE(number);
    CHECK(number->value == value);
    CHECK(number->span.file == 3);
    CHECK(number->span.begin == 0);
    CHECK(number->span.end == static_cast<std::size_t>(length));
    CHECK(cursor.at() == number->span.end);
  }
}

TEST_CASE("what is no number, or no finite one, leaves the cursor where it is") {
  for (const char* text :
       {"", "-", ".", "x1", "********", "1e999", "2x", "12_", "e5", "1Ex", "--1", "nan", "inf"}) {
    CAPTURE(text);
    SourceCursor cursor(text, 0);
    CHECK_FALSE(cursor.TakeNumber());
    CHECK(cursor.at() == 0);
  }
}

TEST_CASE("a cursor does not leave its range") {
  SourceCursor cursor("ab 12345", 0, 1, 5);
  CHECK(cursor.TakeWord() == "b");
  cursor.SkipBlanks();
  CHECK(cursor.TakeNumber()->value == 12);
  CHECK(cursor.AtEnd());
  CHECK(cursor.Peek() == '\0');
  CHECK(cursor.TakeWord().empty());
  cursor.Skip(99);
  CHECK(cursor.at() == 5);
}

TEST_CASE("keywords are whole words") {
  SourceCursor cursor("lin_rel {", 0);
  CHECK_FALSE(cursor.TakeKeyword("LIN"));
  CHECK(cursor.TakeKeyword("LIN_REL"));
  CHECK_FALSE(cursor.Take('{'));
  cursor.SkipSpace();
  CHECK(cursor.Take('{'));
  CHECK(SourceCursor("$TOOL=", 0).TakeWord("$") == "$TOOL");
  CHECK(SourceCursor("1a", 0).TakeWord().empty());
}

TEST_CASE("nesting levels end with their scope") {
  int depth = kMaxNesting - 1;
  {
    const NestingLevel inner(depth);
    CHECK_FALSE(inner.too_deep());
    const NestingLevel innermost(depth);
    CHECK(innermost.too_deep());
  }
  CHECK(depth == kMaxNesting - 1);
}

}  // namespace plumbline::source_cursor_test
