// The parsed text and its unknown keys; the tables' getters stand in toml_reader.cc.
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "app/config/toml_reader.h"

namespace plumbline {
namespace {

/// Levenshtein distance: single-character edits from a to b.
std::size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

/// The known key that is most likely meant; empty where none is near.
std::string Nearest(std::string_view key, const std::vector<std::string>& known) {
  std::string nearest;
  std::size_t best = std::max<std::size_t>(2, key.size() / 2) + 1;
  if (key.size() > 64) return nearest;
  for (const std::string& candidate : known) {
    // A forgotten unit ("sigma" for "sigma_mm") is near, however long the unit.
    const bool begins = key.size() >= 3 && candidate.compare(0, key.size(), key) == 0;
    const std::size_t distance = begins ? 1 : EditDistance(key, candidate);
    if (distance < best && distance < candidate.size()) {
      best = distance;
      nearest = candidate;
    }
  }
  return nearest;
}

}  // namespace

TomlDocument::TomlDocument(std::string_view text, std::string file, FaultList& faults)
    : file_(std::move(file)), faults_(faults) {
  try {
    root_ = toml::parse(text, file_);
    parsed_ = true;
  } catch (const toml::parse_error& error) {
    faults_.Add({Fault::Severity::kFault, file_, static_cast<int>(error.source().begin.line), "",
                 fmt::format("not TOML: {}", error.description())});
  }
}

TomlTable TomlDocument::Root() {
  return {*this, root_, ""};
}

void TomlDocument::ReportUnknownKeys() {
  for (const auto& [table, asked] : asked_) {
    for (const auto& [key, node] : *table) {
      if (std::find(asked.keys.begin(), asked.keys.end(), key.str()) != asked.keys.end()) continue;
      const std::string path =
          asked.path.empty() ? std::string(key.str()) : fmt::format("{}.{}", asked.path, key.str());
      const std::string nearest = Nearest(key.str(), asked.keys);
      const std::string hint =
          nearest.empty() ? "" : fmt::format("; did you mean \"{}\"?", nearest);
      faults_.Add({Fault::Severity::kFault, file_, static_cast<int>(node.source().begin.line), path,
                   "unknown key" + hint});
    }
  }
}

}  // namespace plumbline
