#include "app/base/config/fault.h"

#include <fmt/format.h>

#include <algorithm>

namespace plumbline::config {

std::string FaultText(const Fault& fault) {
  std::string place = fault.file;
  if (fault.line > 0) place += fmt::format(":{}", fault.line);
  if (fault.column > 0) place += fmt::format(":{}", fault.column);
  if (!fault.key.empty()) place += " " + fault.key;
  const char* label = fault.severity == Fault::Severity::kWarning ? "warning: " : "";
  return fmt::format("{}: {}{}", place, label, fault.what);
}

void FaultList::Append(const FaultList& other) {
  all_.insert(all_.end(), other.all_.begin(), other.all_.end());
}

void FaultList::RemoveLine(const std::string& file, int line) {
  std::erase_if(all_, [&](const Fault& fault) { return fault.file == file && fault.line == line; });
}

bool FaultList::HasFaults() const {
  return std::any_of(all_.begin(), all_.end(),
                     [](const Fault& fault) { return fault.severity == Fault::Severity::kFault; });
}

void FaultList::SortByLine() {
  std::vector<std::string> files;
  for (const Fault& fault : all_) {
    if (std::find(files.begin(), files.end(), fault.file) == files.end()) {
      files.push_back(fault.file);
    }
  }
  auto rank = [&files](const Fault& fault) {
    return std::find(files.begin(), files.end(), fault.file) - files.begin();
  };
  std::stable_sort(all_.begin(), all_.end(), [&rank](const Fault& a, const Fault& b) {
    return std::pair(rank(a), a.line) < std::pair(rank(b), b.line);
  });
}

std::string FaultsText(const FaultList& faults) {
  std::string text;
  for (const Fault& fault : faults.All()) text += FaultText(fault) + "\n";
  return text;
}

}  // namespace plumbline::config
