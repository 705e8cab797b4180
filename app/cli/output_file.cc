#include "app/cli/output_file.h"

#include <fmt/format.h>

#include <iostream>

#include "app/base/terminal/terminal_output.h"
#include "drivers/files/text_file.h"

namespace plumbline::cli {

std::string UnwritableText(const std::string& path, const std::string& why,
                           std::string_view option) {
  return fmt::format("{}: cannot be written: {}; choose another {}\n", path, why, option);
}

bool CanWriteOutput(const std::string& path, std::string_view option) {
  const Result<void> writable = files::CheckWritable(path);
  if (!writable) std::cerr << UnwritableText(path, writable.error(), option);
  return writable.ok();
}

bool WriteOutput(const std::string& path, std::string_view text, std::string_view option) {
  const Result<void> written = files::WriteTextFile(path, text);
  if (!written) std::cerr << UnwritableText(path, written.error(), option);
  return written.ok();
}

bool PrintOrWriteOutput(const std::string& path, std::string_view text, std::string_view option) {
  if (path != "-") return WriteOutput(path, text, option);
  terminal::PrintExactly(std::cout, text);
  return true;
}

}  // namespace plumbline::cli
