// TomlDocument: parsing and unknown keys. The getters of TomlTable are in toml_reader.cc.
#include <fmt/format.h>

#include <algorithm>

#include "app/config/toml_reader.h"
#include "app/text/nearest_word.h"
#include "app/text/nesting.h"

namespace plumbline::config {

TomlDocument::TomlDocument(std::string_view text, std::string file, FaultList& faults)
    : file_(std::move(file)), faults_(faults) {
  if (const auto line = text::LineNestedTooDeepInToml(text)) {
    faults_.Add({Fault::Severity::kFault, file_, *line, "", text::NestedTooDeepText()});
    return;
  }
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
  for (const auto& [table, known] : known_keys_) {
    for (const auto& [key, node] : *table) {
      if (std::find(known.keys.begin(), known.keys.end(), key.str()) != known.keys.end()) continue;
      const std::string path =
          known.path.empty() ? std::string(key.str()) : fmt::format("{}.{}", known.path, key.str());
      const std::string nearest = text::NearestWord(key.str(), known.keys, 0.5);
      const std::string hint =
          nearest.empty() ? "" : fmt::format("; did you mean \"{}\"?", nearest);
      faults_.Add({Fault::Severity::kFault, file_, static_cast<int>(node.source().begin.line), path,
                   "unknown key" + hint});
    }
  }
}

}  // namespace plumbline::config
