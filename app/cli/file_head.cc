#include "app/cli/file_head.h"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>

namespace plumbline::cli {

std::optional<std::string> WrongFileText(const std::string& path, const config::Wanted& wanted) {
  std::error_code unknown;
  if (!std::filesystem::is_regular_file(path, unknown)) return std::nullopt;
  std::string bytes(config::kRecognisedBytes, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  config::FaultList faults;
  if (bytes.empty() || !config::RefuseWrongFile(bytes, path, wanted, faults)) return std::nullopt;
  const config::Fault& fault = faults.All().front();
  return fault.line > 0 ? fmt::format("line {}: {}", fault.line, fault.what) : fault.what;
}

}  // namespace plumbline::cli
