// Output files of the commands, with the error message for a file that cannot be written.
#pragma once

#include <iosfwd>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace plumbline::cli {

// Comparison of paths, to keep an output from overwriting an input.

/// True if both paths refer to the same file, whether it exists or not.
bool SameFile(const std::string& one, const std::string& other);

/// Options that name a file to be written, and their paths; empty or "-": no file.
using OutputPaths = std::vector<std::pair<const char*, std::string>>;

/// Prints every output that would overwrite an input or another output; devices such as /dev/null
/// may be given several times.
/// @return  true if there is one
bool OverwritesFile(const char* command, const OutputPaths& outputs,
                    std::vector<std::string> inputs, std::ostream& err);

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
