// Programs of one package lie in one folder, wherever that is.
#pragma once

#include <string>

namespace plumbline {

/// The folder in which the program that runs here lies; /usr/bin where that cannot be found out.
std::string OwnFolder();

/// A program of the same package, as "plumbline-mesh".
inline std::string ProgramBeside(const std::string& name) {
  return OwnFolder() + "/" + name;
}

}  // namespace plumbline
