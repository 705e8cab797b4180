// Helper for reader tests: replaces one line of a valid text and expects one fault.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "app/base/config/fault.h"

namespace plumbline::config {

/// A line of a valid text (its whole content, without indentation), its replacement, and the
/// expected fault: key and text, without file and line.
struct WrongLine {
  const char* good;
  const char* wrong;
  const char* fault;
};

/// `text` with the only occurrence of `good` replaced; `line` becomes its line number.
inline std::string WithLine(const std::string& text, const std::string& good,
                            const std::string& wrong, int& line) {
  const std::size_t at = text.find("\n" + good + "\n");
  INFO("line of the good text: " << good);
  REQUIRE(at != std::string::npos);
  REQUIRE(text.find("\n" + good + "\n", at + 1) == std::string::npos);
  line = static_cast<int>(std::count(text.begin(), text.begin() + static_cast<long>(at), '\n')) + 2;
  return text.substr(0, at + 1) + wrong + text.substr(at + 1 + good.size());
}

inline std::vector<std::string> Texts(const FaultList& faults, Fault::Severity severity) {
  std::vector<std::string> texts;
  for (const Fault& fault : faults.All()) {
    if (fault.severity == severity) texts.push_back(FaultText(fault));
  }
  return texts;
}

/// Reads each faulty text and expects exactly one fault, at the replaced line. A fault at another
/// line is written as `@12 key: what`.
template <typename Reader>
void ExpectOneFaultEach(const std::string& good_text, const std::string& file,
                        const std::vector<WrongLine>& cases, Reader read) {
  for (const WrongLine& wrong : cases) {
    int line = 0;
    const std::string text = WithLine(good_text, wrong.good, wrong.wrong, line);
    FaultList faults;
    const bool good = read(text, faults);
    const std::string expected = wrong.fault[0] == '@'
                                     ? fmt::format("{}:{}", file, wrong.fault + 1)
                                     : fmt::format("{}:{} {}", file, line, wrong.fault);
    CAPTURE(wrong.wrong);
    CHECK_FALSE(good);
    CHECK(Texts(faults, Fault::Severity::kFault) == std::vector<std::string>{expected});
  }
}

}  // namespace plumbline::config
