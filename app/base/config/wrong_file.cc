#include "app/base/config/wrong_file.h"

#include <fmt/format.h>

#include <algorithm>

namespace plumbline::config {
namespace {

using recognition::Content;

bool Wants(const Wanted& wanted, Content content) {
  return std::ranges::find(wanted.contents, content) != wanted.contents.end();
}

/// What to do with a file of another kind. A configuration and a cell name each other.
std::string RemedyOf(const recognition::Recognition& found, const Wanted& wanted) {
  if (found.content == Content::kConfiguration && Wants(wanted, Content::kCell)) {
    return "Give the cell that it names.";
  }
  if (found.content == Content::kCell && Wants(wanted, Content::kConfiguration)) {
    return "Give the plumbline.toml that names it.";
  }
  if (!found.conversion.empty()) return found.conversion;
  return found.command.empty() ? "Give another file." : "Use `" + found.command + "`";
}

}  // namespace

bool RefuseWrongFile(std::string_view bytes, const std::string& file, const Wanted& wanted,
                     FaultList& faults) {
  const recognition::Recognition found =
      recognition::Recognise(bytes.substr(0, kRecognisedBytes), file);
  const bool other = found.certainty == recognition::Certainty::kShown &&
                     found.content != Content::kUnknown && !Wants(wanted, found.content);
  const auto misnamed = std::ranges::find(found.contradictions, "name", &recognition::Fact::what);
  if (!other && misnamed != found.contradictions.end()) {
    faults.Add({Fault::Severity::kFault, file, 0, "",
                fmt::format("is recognised as {}, but its name {}", found.name, misnamed->value)});
    return true;
  }
  if (!other) return false;
  const std::string shown = found.evidence.value.empty() ? "" : " (" + found.evidence.value + ")";
  const std::string what = found.content == Content::kEmpty
                               ? "is empty"
                               : fmt::format("is recognised as {}{}", found.name, shown);
  faults.Add(
      {Fault::Severity::kFault, file, found.evidence.line, "",
       fmt::format("{}, but {} is read here. {}", what, wanted.words, RemedyOf(found, wanted))});
  return true;
}

}  // namespace plumbline::config
