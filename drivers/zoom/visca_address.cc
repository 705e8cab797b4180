#include "drivers/zoom/visca_address.h"

#include <charconv>

#include "drivers/zoom/visca_codec.h"

namespace plumbline::visca {
namespace {

constexpr std::string_view kUdpScheme = "udp://", kTcpScheme = "tcp://";
constexpr int kMaxPort = 65535;

/// Takes `prefix` off the text if it starts with it.
bool Take(std::string_view& text, std::string_view prefix) {
  if (!text.starts_with(prefix)) return false;
  text.remove_prefix(prefix.size());
  return true;
}

/// 0 if it is not a port.
int PortFrom(std::string_view text) {
  int port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  return whole && port >= 1 && port <= kMaxPort ? port : 0;
}

bool IsHostCharacter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
         c == '-' || c == '_' || c == ':' || c == '%';
}

/// Digits and dots only, which no name of a host is, but not four numbers up to 255.
bool IsWrongIpv4(std::string_view host) {
  if (host.find_first_not_of("0123456789.") != host.npos) return false;
  for (int left = 3; left >= 0; --left) {
    const std::string_view number = host.substr(0, host.find('.'));
    int value = 0;
    std::from_chars(number.data(), number.data() + number.size(), value);
    if (number.empty() || number.size() > 3 || value > 255) return true;
    host.remove_prefix(number.size());
    if (left > 0 && !Take(host, ".")) return true;
  }
  return !host.empty();
}

/// Splits "host", "host:port", "[v6]", "[v6]:port" or a bare IPv6 address.
/// @param port  unchanged if none is given; 0 if it is not a port
bool SplitHost(std::string_view text, std::string& host, int& port) {
  std::string_view rest;
  if (Take(text, "[")) {
    const std::size_t end = text.find(']');
    if (end == std::string_view::npos) return false;
    host = text.substr(0, end);
    rest = text.substr(end + 1);
  } else {
    const std::size_t colon = text.find(':');
    const bool is_v6 = colon != std::string_view::npos && text.find(':', colon + 1) != text.npos;
    host = is_v6 ? text : text.substr(0, colon);
    if (!is_v6 && colon != std::string_view::npos) rest = text.substr(colon);
  }
  if (Take(rest, ":")) {
    port = PortFrom(rest);
  } else if (!rest.empty()) {
    return false;
  }
  for (const char c : host) {
    if (!IsHostCharacter(c)) return false;
  }
  return !host.empty();
}

}  // namespace

std::string Address::Text() const {
  if (transport == Transport::kSerial) return host;
  const bool is_v6 = host.find(':') != std::string::npos;
  return std::string(transport == Transport::kTcp ? kTcpScheme : kUdpScheme) +
         (is_v6 ? "[" + host + "]" : host) + ":" + std::to_string(port);
}

Result<Address> AddressFrom(std::string_view device, std::string_view transport) {
  Address address;
  std::string_view rest = device;
  const bool by_udp = Take(rest, kUdpScheme), by_tcp = !by_udp && Take(rest, kTcpScheme);
  if (rest.find("://") != std::string_view::npos) {
    return Error{"starts with a scheme that VISCA does not use; write udp://HOST or tcp://HOST"};
  }
  const bool is_path = !by_udp && !by_tcp && rest.find('/') != std::string_view::npos;
  if (!transport.empty() && transport != "serial" && transport != "udp" && transport != "tcp") {
    return Error{"needs transport \"serial\", \"udp\" or \"tcp\""};
  }
  if (is_path) {
    if (transport == "udp" || transport == "tcp") {
      return Error{
          "is a serial line, but transport is \"udp\" or \"tcp\", which need a network "
          "address; remove transport, or give the camera's address"};
    }
    address.host = device;
    return address;
  }
  if (transport == "serial") {
    return Error{
        "is a network address, but transport is \"serial\"; give the path of the serial "
        "line, for example /dev/serial/by-id/..., or remove transport"};
  }
  if ((by_udp && transport == "tcp") || (by_tcp && transport == "udp")) {
    return Error{"contradicts transport; remove one of the two"};
  }
  if (device.starts_with("tty")) {
    return Error{"is the name of a serial line; write it with its folder, /dev/tty..."};
  }
  address.transport = by_tcp || transport == "tcp" ? Transport::kTcp : Transport::kUdp;
  address.port = address.transport == Transport::kTcp ? kTcpPort : kUdpPort;
  if (!SplitHost(rest, address.host, address.port)) {
    return Error{
        "is neither a path nor a network address; write /dev/..., 192.168.1.9, "
        "HOST:PORT or [IPv6]:PORT"};
  }
  if (IsWrongIpv4(address.host)) {
    return Error{
        "is no network address; write four numbers from 0 to 255, such as 192.168.1.9, or a name"};
  }
  if (address.port == 0) return Error{"has a port outside 1..65535"};
  return address;
}

}  // namespace plumbline::visca
