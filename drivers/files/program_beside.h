// Programs of one package lie in one folder, wherever that is, their modules in lib beside it.
#pragma once

#include <string>

namespace plumbline {

/// The folder in which the program that runs here lies; /usr/bin where that cannot be found out.
std::string OwnFolder();

/// A program of the same package, as "plumbline-mesh".
inline std::string ProgramBeside(const std::string& name) {
  return OwnFolder() + "/" + name;
}

/// A module of the same package, as "plumbline-image-codecs.so": in ../lib/plumbline of
/// OwnFolder(), both where the package is installed and in a build folder.
std::string ModuleBeside(const std::string& name);

/// What to do where a program of the same package cannot be started.
inline constexpr const char* kRestoreProgram =
    "it belongs beside this program: `sudo apt install --reinstall plumbline` restores it, in a "
    "checkout ./dev build makes it";

}  // namespace plumbline
