#include "drivers/robot/host_name.h"

#include <netdb.h>
#include <sys/socket.h>

namespace plumbline {

const char* WhyUnresolved(const std::string& host) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int error = getaddrinfo(host.c_str(), nullptr, &hints, &found);
  if (error != 0) return gai_strerror(error);
  freeaddrinfo(found);
  return nullptr;
}

}  // namespace plumbline
