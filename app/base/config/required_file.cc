#include "app/base/config/required_file.h"

#include "drivers/files/open_failure.h"

namespace plumbline::config {

std::optional<std::string> ReadRequiredFile(const std::string& path, FaultList& faults,
                                            const files::SizeLimit& limit) {
  Result<std::string> text = files::ReadFileUpTo(limit, path);
  if (text) return std::move(text).value();
  faults.Add({Fault::Severity::kFault, path, 0, "", files::ReadErrorText(path, text.error())});
  return std::nullopt;
}

}  // namespace plumbline::config
