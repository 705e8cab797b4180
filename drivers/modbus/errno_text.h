// Text of the current errno.
#pragma once

#include <cerrno>
#include <string>
#include <system_error>

namespace plumbline::modbus {

inline std::string ErrnoText() {
  return std::generic_category().message(errno);
}

}  // namespace plumbline::modbus
