#include "app/config/required_file.h"

#include "drivers/files/open_failure.h"
#include "drivers/files/text_file.h"

namespace plumbline::config {

std::optional<std::string> ReadRequiredFile(const std::string& path, FaultList& faults) {
  Result<std::string> text = files::ReadTextFile(path);
  if (text) return std::move(text).value();
  faults.Add({Fault::Severity::kFault, path, 0, "", files::ReadErrorText(path, text.error())});
  return std::nullopt;
}

}  // namespace plumbline::config
