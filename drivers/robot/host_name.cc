#include "drivers/robot/host_name.h"

#include <netdb.h>

#include "drivers/os/host_addresses.h"

namespace plumbline::robot {

const char* ResolveFailure(const std::string& host) {
  const int error = os::FindHost(host, 0, os::HostForm::kAny).error;
  return error == 0 ? nullptr : gai_strerror(error);
}

bool IsAddress(const std::string& host) {
  return os::FindHost(host, 0, os::HostForm::kNumeric).error == 0;
}

}  // namespace plumbline::robot
