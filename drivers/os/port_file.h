// File with the ports that a program listens on, for the program that started it.
#pragma once

#include <string>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline::os {

/// One listening TCP server of a program.
struct NamedPort {
  std::string name;  ///< "plc", "page"
  int port = 0;
};

/// Writes one line "NAME PORT" for each server and replaces the file at once, so that a reader that
/// polls for it never sees a part of it.
/// @return  why it cannot be written, with a remedy
Result<void> WritePortFile(const std::string& path, const std::vector<NamedPort>& ports);

}  // namespace plumbline::os
