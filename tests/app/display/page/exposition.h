// Strict parser of the Prometheus text format 0.0.4, which reports the first fault.
// [prometheus.io/docs/instrumenting/exposition_formats]
#pragma once

#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>

namespace plumbline::test {

struct Exposition {
  std::map<std::string, std::string> types;    ///< by metric
  std::map<std::string, std::string> samples;  ///< value by name with labels
  std::string problem;                         ///< empty: none

  explicit Exposition(const std::string& text) {
    static const std::regex help("# HELP ([a-zA-Z_:][a-zA-Z0-9_:]*) (([^\\\\]|\\\\\\\\|\\\\n)+)");
    static const std::regex type("# TYPE ([a-zA-Z_:][a-zA-Z0-9_:]*) (counter|gauge|histogram)");
    static const std::regex sample(
        "([a-zA-Z_:][a-zA-Z0-9_:]*)"
        "(\\{[a-zA-Z_][a-zA-Z0-9_]*=\"([^\"\\\\]|\\\\\\\\|\\\\\"|\\\\n)*\""
        "(,[a-zA-Z_][a-zA-Z0-9_]*=\"([^\"\\\\]|\\\\\\\\|\\\\\"|\\\\n)*\")*\\})?"
        " (\\+Inf|-Inf|NaN|-?[0-9]+(\\.[0-9]+)?(e[+-]?[0-9]+)?)");
    if (text.empty() || text.back() != '\n') problem = "the last line does not end";
    std::istringstream lines(text);
    std::string line, current, helped;
    std::smatch found;
    while (std::getline(lines, line) && problem.empty()) {
      if (std::regex_match(line, found, help)) {
        helped = found[1];
        if (types.contains(helped)) problem = "twice: " + line;
      } else if (std::regex_match(line, found, type)) {
        current = found[1];
        if (current != helped) problem = "TYPE without its HELP: " + line;
        types[current] = found[2];
        const bool total = current.ends_with("_total");
        if ((found[2] == "counter") != total) problem = "_total belongs to counters: " + line;
      } else if (std::regex_match(line, found, sample)) {
        std::string name = found[1];
        if (types[current] == "histogram" && name.starts_with(current)) {
          const std::string suffix = name.substr(current.size());
          if (suffix == "_bucket" || suffix == "_sum" || suffix == "_count") name = current;
        }
        if (name != current) problem = "a sample outside its group: " + line;
        if (!samples.emplace(std::string(found[1]) + std::string(found[2]), found[6]).second) {
          problem = "a sample twice: " + line;
        }
      } else {
        problem = "no line of the format: " + line;
      }
    }
  }
  double Value(const std::string& sample) const {
    const auto found = samples.find(sample);
    return found == samples.end() ? std::stod("nan") : std::stod(found->second);
  }
};

}  // namespace plumbline::test
