#include "drivers/os/host_addresses.h"

#include <netdb.h>

#include <array>
#include <cstring>

namespace plumbline::os {

std::string HostAddress::Text() const {
  std::array<char, NI_MAXHOST> text{};
  if (getnameinfo(get(), size, text.data(), text.size(), nullptr, 0, NI_NUMERICHOST) != 0) {
    return "";
  }
  const std::string whole = text.data();
  return whole.substr(0, whole.find('%'));
}

HostAddresses FindHost(const std::string& host, int port, HostForm form) {
  addrinfo hints{};
  hints.ai_flags = AI_NUMERICSERV | (form == HostForm::kNumeric ? AI_NUMERICHOST : 0);
  hints.ai_socktype = SOCK_STREAM;  // one row for each address; the type is not used
  addrinfo* rows = nullptr;
  HostAddresses found;
  found.error = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &rows);
  if (found.error != 0) return found;
  for (const addrinfo* row = rows; row != nullptr; row = row->ai_next) {
    HostAddress& address = found.list.emplace_back();
    address.size = row->ai_addrlen;
    std::memcpy(&address.storage, row->ai_addr, row->ai_addrlen);
  }
  freeaddrinfo(rows);
  return found;
}

}  // namespace plumbline::os
