#include "tests/virtual_cell/modbus_server.h"

#include <arpa/inet.h>
#include <fmt/core.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace virtual_cell {
namespace {

/// First and last register that a request writes; first > last if it writes none.
struct Range {
  int first, last;
};

Range WrittenBy(const std::vector<std::uint8_t>& query) {
  const auto word = [&query](std::size_t at) {
    return at + 1 < query.size() ? (query[at] << 8) + query[at + 1] : 0;
  };
  switch (query[7]) {  // after the MBAP header
    case MODBUS_FC_WRITE_SINGLE_REGISTER:
    case MODBUS_FC_MASK_WRITE_REGISTER:
      return {word(8), word(8)};
    case MODBUS_FC_WRITE_MULTIPLE_REGISTERS:
      return {word(8), word(8) + word(10) - 1};
    case MODBUS_FC_WRITE_AND_READ_REGISTERS:
      return {word(12), word(12) + word(14) - 1};
    default:
      return {1, 0};
  }
}

}  // namespace

ModbusServer::ModbusServer(const std::string& address, int port, RegisterBank& bank, int first_open,
                           int last_open)
    : bits_(16), first_open_(first_open), last_open_(last_open) {
  mapping_.nb_registers = mapping_.nb_input_registers = bank.size();
  mapping_.tab_registers = mapping_.tab_input_registers = bank.data();
  mapping_.nb_bits = mapping_.nb_input_bits = static_cast<int>(bits_.size());
  mapping_.tab_bits = mapping_.tab_input_bits = bits_.data();

  listening_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int yes = 1;
  ::setsockopt(listening_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in where = {};
  where.sin_family = AF_INET;
  where.sin_port = htons(static_cast<std::uint16_t>(port));
  socklen_t length = sizeof where;
  if (::inet_pton(AF_INET, address.c_str(), &where.sin_addr) != 1 ||
      ::bind(listening_, reinterpret_cast<sockaddr*>(&where), length) != 0 ||
      ::listen(listening_, 16) != 0) {
    const std::string reason = std::strerror(errno);
    ::close(listening_);
    throw std::runtime_error(fmt::format("cannot listen on {}:{}: {}", address, port, reason));
  }
  ::getsockname(listening_, reinterpret_cast<sockaddr*>(&where), &length);
  port_ = ntohs(where.sin_port);
  context_ = modbus_new_tcp(address.c_str(), port_);
}

ModbusServer::~ModbusServer() {
  for (const Client& client : clients_) ::close(client.socket);
  ::close(listening_);
  modbus_free(context_);
}

void ModbusServer::Watch(fd_set& readable, int& highest, double now_s,
                         const LinkFaults& faults) const {
  if (now_s < faults.stalled_until_s) return;
  FD_SET(listening_, &readable);
  highest = std::max(highest, listening_);
  for (const Client& client : clients_) {
    FD_SET(client.socket, &readable);
    highest = std::max(highest, client.socket);
  }
}

void ModbusServer::Serve(const fd_set& readable, double now_s, LinkFaults& faults) {
  if (faults.reset_now) {
    const linger at_once{1, 0};  // close sends RST
    while (!clients_.empty()) {
      ::setsockopt(clients_.back().socket, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
      Close(clients_.back().socket);
    }
    faults.reset_now = false;
  }
  if (faults.half_close_now) {
    for (Client& client : clients_) {
      ::shutdown(client.socket, SHUT_WR);
      client.half_closed = true;
    }
    faults.half_close_now = false;
  }
  if (now_s < faults.stalled_until_s) return;

  const std::vector<Client> known = clients_;
  for (const Client& client : known) {
    if (FD_ISSET(client.socket, &readable) && !Take(client, now_s, faults)) Close(client.socket);
  }
  if (FD_ISSET(listening_, &readable)) Accept();
  while (!pending_.empty() && pending_.front().due_s <= now_s) {
    const Pending next = pending_.front();
    pending_.pop_front();
    Answer(next, faults);
  }
}

void ModbusServer::Accept() {
  const int socket = ::accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC);
  if (socket < 0) return;
  if (socket >= FD_SETSIZE) {
    ::close(socket);
    return;
  }
  const int yes = 1;
  ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  clients_.push_back({socket, false});
}

/// @return false if the connection has ended
bool ModbusServer::Take(const Client& client, double now_s, const LinkFaults& faults) {
  std::vector<std::uint8_t> query(MODBUS_TCP_MAX_ADU_LENGTH);
  modbus_set_socket(context_, client.socket);
  const int length = modbus_receive(context_, query.data());
  if (length <= 0) return length == 0;
  query.resize(static_cast<std::size_t>(length));
  if (!client.half_closed) pending_.push_back({client.socket, now_s + faults.delay_s, query});
  return true;
}

void ModbusServer::Answer(const Pending& pending, const LinkFaults& faults) {
  modbus_set_socket(context_, pending.socket);
  const int length = static_cast<int>(pending.query.size());
  int sent = 0;
  if (faults.exception) {
    sent = modbus_reply_exception(context_, pending.query.data(),
                                  MODBUS_EXCEPTION_SLAVE_OR_SERVER_BUSY);
  } else if (!MayWrite(pending.query)) {
    sent = modbus_reply_exception(context_, pending.query.data(),
                                  MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS);
  } else {
    sent = modbus_reply(context_, pending.query.data(), length, &mapping_);
  }
  if (sent < 0 && errno != EMBXILFUN && errno != EMBXILADD && errno != EMBXILVAL) {
    Close(pending.socket);
  }
}

void ModbusServer::Close(int socket) {
  ::close(socket);
  std::erase_if(clients_, [socket](const Client& client) { return client.socket == socket; });
  std::erase_if(pending_, [socket](const Pending& p) { return p.socket == socket; });
}

bool ModbusServer::MayWrite(const std::vector<std::uint8_t>& query) const {
  const Range written = WrittenBy(query);
  return written.first > written.last ||
         (written.first >= first_open_ && written.last <= last_open_);
}

}  // namespace virtual_cell
