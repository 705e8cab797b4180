#include <catch2/catch.hpp>
#include <random>
#include <vector>

#include "drivers/gauge/gauge_codec.h"

namespace plumbline::report_text_test {

using namespace plumbline::gauge;

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint8_t kEnter = 0x28, kShift = 0x02;

Bytes KeysDown(std::vector<std::uint8_t> keys, std::uint8_t modifiers = 0) {
  keys.resize(6);
  Bytes report = {modifiers, 0};
  report.insert(report.end(), keys.begin(), keys.end());
  return report;
}

/// What a device types that presses one key after the other.
std::string Typed(const std::vector<std::uint8_t>& keys, std::uint8_t modifiers = 0) {
  KeyReports reports;
  std::string text;
  for (const std::uint8_t key : keys) {
    reports.Push(KeysDown({key}, modifiers), text);
    reports.Push(KeysDown({}), text);
  }
  return text;
}

std::string TextOf(const Bytes& report) {
  std::string text;
  AppendReportText(report, text);
  return text;
}

}  // namespace

TEST_CASE("typed keys become text: digits, sign, point, units and the end of the line") {
  // "-12.345" and Enter, on the row of digits and on the numeric keypad.
  CHECK(Typed({0x2D, 0x1E, 0x1F, 0x37, 0x20, 0x21, 0x22, kEnter}) == "-12.345\r");
  CHECK(Typed({0x56, 0x59, 0x5A, 0x63, 0x5B, 0x5C, 0x5D, 0x58}) == "-12.345\r");
  CHECK(Typed({0x38, 0x27, 0x36, 0x26, 0x2B}) == "-0.9\r");  // German layout, comma, Tab
  CHECK(Typed({0x2E, 0x04}, kShift) == "+A");
  CHECK(Typed({0x62, 0x2C, 0x10, 0x10}) == "0 mm");
}

TEST_CASE("a key that is held, or goes down beside others, counts once") {
  KeyReports reports;
  std::string text;
  reports.Push(KeysDown({0x1E}), text);
  reports.Push(KeysDown({0x1E}), text);
  reports.Push(KeysDown({0x1E, 0x1F}), text);
  reports.Push(KeysDown({0x1F, 0x20}), text);
  reports.Push(KeysDown({}), text);
  reports.Push(KeysDown({0x20}), text);
  CHECK(text == "1233");
  Bytes numbered = KeysDown({0x21});
  numbered.insert(numbered.begin(), 0x01);  // report id
  reports.Push(numbered, text);
  CHECK(text == "12334");
}

TEST_CASE("keys of another layout or with a modifier make the line unreadable, never wrong") {
  CHECK(Typed({0x1E}, kShift) == std::string(1, kSubstitute));  // a digit of the French layout
  CHECK(Typed({0x1E}, 0x01) == std::string(1, kSubstitute));    // Ctrl
  CHECK(Typed({0x3A, 0x01}) == std::string(2, kSubstitute));    // F1, too many keys
  KeyReports reports;
  std::string text;
  reports.Push(Bytes{0, 0, 0x1E}, text);
  CHECK(text == std::string(1, kSubstitute));
}

TEST_CASE("vendor reports: text after id and length, padded or continued") {
  Bytes padded = {0x01, 13};
  for (const char c : std::string("01A+0000.123\r")) {
    padded.push_back(static_cast<std::uint8_t>(c));
  }
  padded.resize(64);
  CHECK(TextOf(padded) == "01A+0000.123\r\r");
  CHECK(TextOf({0x01, '+', '1', '2'}) == "+12");  // continued by the next report
  CHECK(TextOf({'+', '1', 0, 0}) == "+1\r");
  CHECK(TextOf({0x01, 0, 0, 0}).empty());
  CHECK(TextOf({}).empty());
  CHECK(TextOf({'+', '1', '.', '2', 0, '3', '4', '5', 0}) == "+1.2\r");  // left from a longer text
  CHECK(TextOf({'\r', '\n', 0, 0}) == "\r");  // the end of a line in a report of its own
  CHECK(TextOf({0x01, '\r', 0, 0}) == "\r");
  CHECK(TextOf({0xFF, 0xFE, 0xFD, '1', 0}) == std::string(1, kSubstitute) + "1\r");
}

TEST_CASE("any report of any length appends text without zeros, and few characters") {
  std::mt19937 random(5);
  KeyReports keys;
  for (int run = 0; run < 20000; ++run) {
    Bytes report(random() % 70);
    for (std::uint8_t& byte : report) {
      byte = static_cast<std::uint8_t>(random() % 4 == 0 ? 0 : random());
    }
    std::string typed, sent;
    keys.Push(report, typed);
    AppendReportText(report, sent);
    REQUIRE(typed.size() <= 6);
    REQUIRE(sent.size() <= report.size() + 1);
    for (const char c : typed + sent) {
      REQUIRE(((c >= ' ' && c <= '~') || c == '\r' || c == '\n' || c == kSubstitute));
    }
  }
}

}  // namespace plumbline::report_text_test
