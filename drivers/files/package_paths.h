// Paths of the programs and modules that belong to the same package as the running program.
#pragma once

#include <string>

namespace plumbline::files {

/// The folder of the running program; /usr/bin if it cannot be determined.
std::string ProgramFolder();

/// Path of a program of the same package, such as "plumbline-mesh".
inline std::string SiblingProgram(const std::string& name) {
  return ProgramFolder() + "/" + name;
}

/// Path of the program `plumbline` of the same package, or the value of the environment variable
/// PLUMBLINE_PROGRAM.
std::string PlumblineProgram();

/// Path of a module of the same package, such as "plumbline-image-codecs.so": in ../lib/plumbline
/// of the program folder, both in an installed package and in a build folder.
std::string SiblingModule(const std::string& name);

/// Remedy if a program of the same package cannot be started.
inline constexpr const char* kRestoreProgram =
    "it belongs beside this program: `sudo apt install --reinstall plumbline` restores it; in a "
    "checkout, ./dev build creates it";

}  // namespace plumbline::files
