// Output files of the commands, with the error message for a file that cannot be written.
#pragma once

#include <string>
#include <string_view>

namespace plumbline::cli {

/// "model.toml: cannot be written: Permission denied; choose another --output".
/// @param option  that names the file, or "file"
std::string UnwritableText(const std::string& path, const std::string& why,
                           std::string_view option);

/// Checks that the file could be written now; prints the reason if not.
bool CanWriteOutput(const std::string& path, std::string_view option);

/// Writes the file; prints the reason on failure.
bool WriteOutput(const std::string& path, std::string_view text, std::string_view option);

/// The same, but "-" is standard output.
bool PrintOrWriteOutput(const std::string& path, std::string_view text, std::string_view option);

}  // namespace plumbline::cli
