#include "tests/virtual_ur/rtde_server.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <ctime>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace virtual_ur {

double MonotonicNow() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct RtdeServer::Client {
  int fd = -1;
  int version = 1;  ///< until another is requested
  bool started = false;
  int output_id = 0;
  Recipe outputs;
  std::map<int, Recipe> inputs;
  std::vector<std::uint8_t> unread, unsent;
  int merged = 0;
  std::vector<std::uint8_t> together;
  std::vector<std::pair<double, std::vector<std::uint8_t>>> late;
  bool dead = false;

  ~Client() {
    if (fd >= 0) close(fd);
  }
};

namespace {

using Buffer = std::vector<std::uint8_t>;

constexpr std::size_t kMostUnsent = 64 * 1024;
constexpr int kSendBuffer = 16 * 1024;

void PutInteger(Buffer& out, std::uint64_t value, int bytes) {
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) {
    out.push_back(static_cast<std::uint8_t>(value >> shift));
  }
}

void PutDouble(Buffer& out, double value) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  PutInteger(out, bits, 8);
}

std::uint64_t TakeInteger(const Buffer& in, std::size_t& at, int bytes) {
  std::uint64_t value = 0;
  for (int k = 0; k < bytes; ++k) value = value << 8 | in[at++];
  return value;
}

double TakeDouble(const Buffer& in, std::size_t& at) {
  const std::uint64_t bits = TakeInteger(in, at, 8);
  double value = 0;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

std::vector<std::string> SplitAtCommas(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, ',');) parts.push_back(part);
  return parts;
}

/// A field of the controller: its RTDE type and where its value is.
struct Cell {
  std::string type;
  double* doubles = nullptr;
  int count = 0;
  std::int32_t* integer = nullptr;
  std::uint32_t* natural = nullptr;
  bool is_input = false, is_output = true;

  std::size_t Bytes() const { return doubles != nullptr ? 8U * static_cast<unsigned>(count) : 4U; }
};

std::optional<int> RegisterNumber(const std::string& name, const std::string& prefix) {
  if (name.rfind(prefix, 0) != 0 || name.size() == prefix.size() || name.size() > prefix.size() + 2)
    return std::nullopt;
  int number = 0;
  for (std::size_t k = prefix.size(); k < name.size(); ++k) {
    if (name[k] < '0' || name[k] > '9') return std::nullopt;
    number = 10 * number + (name[k] - '0');
  }
  return number < 48 ? std::optional(number) : std::nullopt;
}

std::optional<Cell> Find(UrState& s, const std::string& name) {
  const auto doubles = [](double* first, int count) {
    return Cell{count == 1 ? "DOUBLE" : count == 3 ? "VECTOR3D" : "VECTOR6D", first, count};
  };
  const auto integer = [](std::int32_t* value) { return Cell{"INT32", nullptr, 0, value}; };
  const auto natural = [](std::uint32_t* value) {
    return Cell{"UINT32", nullptr, 0, nullptr, value};
  };
  const auto input = [](Cell cell) {
    cell.is_input = true;
    return cell;
  };
  if (name == "timestamp") return doubles(&s.timestamp, 1);
  if (name == "actual_q" || name == "target_q") return doubles(s.actual_q.data(), 6);
  if (name == "actual_TCP_pose") return doubles(s.tcp_pose.data(), 6);
  if (name == "tcp_offset") return doubles(s.tcp_offset.data(), 6);
  if (name == "payload") return doubles(&s.payload, 1);
  if (name == "payload_cog") return doubles(s.payload_cog.data(), 3);
  if (name == "joint_temperatures") return doubles(s.joint_temperatures.data(), 6);
  if (name == "target_speed_fraction") return doubles(&s.speed_slider_fraction, 1);
  if (name == "robot_mode") return integer(&s.robot_mode);
  if (name == "safety_status") return integer(&s.safety_status);
  if (name == "runtime_state") return natural(&s.runtime_state);
  if (name == "speed_slider_mask") return input(natural(&s.speed_slider_mask));
  if (name == "speed_slider_fraction") return input(doubles(&s.speed_slider_fraction, 1));
  if (const auto n = RegisterNumber(name, "output_int_register_"))
    return integer(&s.output_int[static_cast<std::size_t>(*n)]);
  if (const auto n = RegisterNumber(name, "output_double_register_"))
    return doubles(&s.output_double[static_cast<std::size_t>(*n)], 1);
  if (const auto n = RegisterNumber(name, "input_int_register_"))
    return input(integer(&s.input_int[static_cast<std::size_t>(*n)]));
  if (const auto n = RegisterNumber(name, "input_double_register_"))
    return input(doubles(&s.input_double[static_cast<std::size_t>(*n)], 1));
  return std::nullopt;
}

}  // namespace

RtdeServer::RtdeServer(int port, std::string address) {
  listener_ = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const int on = 1;
  setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in place{};
  place.sin_family = AF_INET;
  place.sin_port = htons(static_cast<std::uint16_t>(port));
  if (inet_pton(AF_INET, address.c_str(), &place.sin_addr) != 1 ||
      bind(listener_, reinterpret_cast<sockaddr*>(&place), sizeof place) != 0 ||
      listen(listener_, 4) != 0) {
    const std::string why = std::strerror(errno);
    close(listener_);
    throw std::runtime_error("RTDE port " + std::to_string(port) + ": " + why);
  }
  socklen_t size = sizeof place;
  getsockname(listener_, reinterpret_cast<sockaddr*>(&place), &size);
  port_ = ntohs(place.sin_port);
}

RtdeServer::~RtdeServer() {
  clients_.clear();
  close(listener_);
}

void RtdeServer::CloseAll() {
  clients_.clear();
}

void RtdeServer::Accept() {
  while (true) {
    const int fd = accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0) return;
    const int on = 1;
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof kSendBuffer);
    auto client = std::make_unique<Client>();
    client->fd = fd;
    clients_.push_back(std::move(client));
    ++connections_;
  }
}

void RtdeServer::Serve(double until_s) {
  while (true) {
    std::vector<pollfd> waiting{{listener_, POLLIN, 0}};
    for (const auto& client : clients_) {
      const short events = static_cast<short>(client->unsent.empty() ? POLLIN : POLLIN | POLLOUT);
      waiting.push_back({client->fd, events, 0});
    }
    const double left_s = std::max(0.0, until_s - MonotonicNow());
    timespec left{};
    left.tv_sec = static_cast<time_t>(left_s);
    left.tv_nsec = static_cast<long>(1e9 * (left_s - static_cast<double>(left.tv_sec)));
    const int ready = ppoll(waiting.data(), waiting.size(), &left, nullptr);
    if (ready > 0) {
      for (std::size_t k = 1; k < waiting.size(); ++k) {
        Client& client = *clients_[k - 1];
        if ((waiting[k].revents & POLLOUT) != 0 && !Flush(client)) client.dead = true;
        if ((waiting[k].revents & (POLLIN | POLLHUP | POLLERR)) != 0 && !ReadFrom(client))
          client.dead = true;
      }
      std::erase_if(clients_, [](const auto& client) { return client->dead; });
      if ((waiting[0].revents & POLLIN) != 0) Accept();
    }
    if (MonotonicNow() >= until_s) return;
  }
}

bool RtdeServer::ReadFrom(Client& client) {
  std::array<std::uint8_t, 4096> bytes{};
  while (true) {
    const auto got = recv(client.fd, bytes.data(), bytes.size(), 0);
    if (got == 0) return false;
    if (got < 0) {
      if (errno == EAGAIN) break;
      return false;
    }
    client.unread.insert(client.unread.end(), bytes.begin(), bytes.begin() + got);
  }
  while (client.unread.size() >= 3) {
    const std::size_t size = static_cast<std::size_t>(client.unread[0] << 8 | client.unread[1]);
    if (size < 3) return false;
    if (client.unread.size() < size) break;
    const std::uint8_t type = client.unread[2];
    const Buffer payload(client.unread.begin() + 3,
                         client.unread.begin() + static_cast<long>(size));
    client.unread.erase(client.unread.begin(), client.unread.begin() + static_cast<long>(size));
    if (!Answer(client, type, payload)) return false;
  }
  return true;
}

bool RtdeServer::Answer(Client& client, std::uint8_t type, const Buffer& payload) {
  if (faults_.silent) return true;
  if (type == 'U') return TakeInputs(client, payload);
  if (faults_.garbage) {
    faults_.garbage = false;
    const Buffer http{'H', 'T', 'T', 'P', '/', '1', '.', '1', ' ', '4', '0', '0'};
    return Write(client, http.data(), http.size());
  }
  if (faults_.text_between && !SendText(client, "SafetySetup has not been confirmed yet"))
    return false;
  Buffer reply;
  switch (type) {
    case 'V': {
      if (payload.size() != 2) return false;
      const int wanted = payload[0] << 8 | payload[1];
      const bool accepted = wanted >= 1 && wanted <= faults_.highest_version;
      reply.push_back(accepted ? 1 : 0);
      const bool sent = Send(client, type, reply);
      if (accepted) client.version = wanted;
      return sent;
    }
    case 'v':
      for (const std::uint32_t part : {5U, 11U, 1U, 108318U}) PutInteger(reply, part, 4);
      return Send(client, type, reply);
    case 'O':
    case 'I':
      return SetUp(client, type, payload);
    case 'S': {
      const bool accepted = !faults_.refuse_start && !client.outputs.fields.empty();
      client.started = accepted;
      reply.push_back(accepted ? 1 : 0);
      return Send(client, type, reply);
    }
    case 'P':
      client.started = false;
      reply.push_back(1);
      return Send(client, type, reply);
    default:
      return true;
  }
}

bool RtdeServer::OwnedByOther(const Client& client, const std::string& field) const {
  for (const auto& other : clients_) {
    if (other.get() == &client) continue;
    for (const auto& [id, recipe] : other->inputs) {
      if (std::find(recipe.fields.begin(), recipe.fields.end(), field) != recipe.fields.end())
        return true;
    }
  }
  return false;
}

bool RtdeServer::SetUp(Client& client, std::uint8_t type, const Buffer& payload) {
  const bool outputs = type == 'O';
  const bool has_frequency = outputs && client.version >= 2;
  Recipe recipe;
  std::size_t at = 0;
  if (has_frequency) {
    if (payload.size() < 8) return false;
    recipe.frequency = TakeDouble(payload, at);
  }
  recipe.fields =
      SplitAtCommas(std::string(payload.begin() + static_cast<long>(at), payload.end()));
  bool good = !client.started && !recipe.fields.empty() && payload.size() - at <= 2048 &&
              !faults_.refuse_recipe;
  if (has_frequency) good = good && recipe.frequency > 0 && recipe.frequency <= 500;
  std::string types;
  for (const std::string& field : recipe.fields) {
    const auto cell = Find(state_, field);
    std::string found = "NOT_FOUND";
    if (cell && (outputs ? cell->is_output : cell->is_input) && faults_.missing.count(field) == 0) {
      found = cell->type;
      if (!outputs && (faults_.in_use.count(field) != 0 || OwnedByOther(client, field)))
        found = "IN_USE";
      if (const auto wrong = faults_.wrong_types.find(field); wrong != faults_.wrong_types.end())
        found = wrong->second;
    }
    if (found == "NOT_FOUND" || found == "IN_USE") good = false;
    types += (types.empty() ? "" : ",") + found;
  }
  int id = 0;
  if (good) {
    id = outputs ? 1 : static_cast<int>(client.inputs.size()) + 1;
    if (outputs) {
      client.outputs = recipe;
      client.output_id = id;
    } else {
      client.inputs[id] = recipe;
    }
  }
  Buffer reply;
  if (!outputs || client.version >= 2) reply.push_back(static_cast<std::uint8_t>(id));
  reply.insert(reply.end(), types.begin(), types.end());
  return Send(client, type, reply);
}

bool RtdeServer::TakeInputs(Client& client, const Buffer& payload) {
  if (payload.empty()) return false;
  const auto recipe = client.inputs.find(payload[0]);
  if (recipe == client.inputs.end()) return false;
  std::size_t size = 1;
  for (const std::string& field : recipe->second.fields) size += Find(state_, field)->Bytes();
  if (payload.size() != size) return false;
  std::size_t at = 1;
  for (const std::string& field : recipe->second.fields) {
    const auto cell = Find(state_, field);
    for (int k = 0; k < cell->count; ++k) cell->doubles[k] = TakeDouble(payload, at);
    if (cell->integer != nullptr)
      *cell->integer = static_cast<std::int32_t>(TakeInteger(payload, at, 4));
    if (cell->natural != nullptr)
      *cell->natural = static_cast<std::uint32_t>(TakeInteger(payload, at, 4));
  }
  if (on_inputs) on_inputs();
  return true;
}

void RtdeServer::Advance() {
  state_.timestamp += kCycle_s;
  Cycle();
}

void RtdeServer::Cycle() {
  ++cycle_;
  if (on_outputs) on_outputs();
  const double now_s = MonotonicNow();
  const bool text = faults_.text_every_s > 0 && now_s >= text_due_s_;
  if (text) text_due_s_ = now_s + faults_.text_every_s;
  if (faults_.silent) return;
  for (const auto& client : clients_) {
    bool alive = true;
    if (text) alive = SendText(*client, "the speed was reduced by the safety system");
    auto& late = client->late;
    while (alive && !late.empty() && late.front().first <= now_s) {
      alive = Write(*client, late.front().second.data(), late.front().second.size());
      late.erase(late.begin());
    }
    const double frequency = client->version >= 2 ? client->outputs.frequency : 125;
    const auto every = static_cast<std::uint64_t>(
        std::max(1.0, std::round(1 / (kCycle_s * std::max(1.0, frequency)))));
    const bool dropped = faults_.drop_each > 0 &&
                         (cycle_ / every) % static_cast<std::uint64_t>(faults_.drop_each) == 0;
    if (alive && client->started && cycle_ % every == 0 && !dropped) alive = SendData(*client);
    client->dead = !alive;
  }
  std::erase_if(clients_, [](const auto& client) { return client->dead; });
}

bool RtdeServer::SendData(Client& client) {
  Buffer payload;
  UrState reported = state_;
  if (faults_.emergency) reported.safety_status = 7;
  if (client.version >= 2) {
    payload.push_back(
        static_cast<std::uint8_t>(client.output_id + (faults_.foreign_recipe ? 1 : 0)));
  }
  for (const std::string& field : client.outputs.fields) {
    const auto cell = Find(reported, field);
    for (int k = 0; k < cell->count; ++k) PutDouble(payload, cell->doubles[k]);
    if (cell->integer != nullptr)
      PutInteger(payload, static_cast<std::uint32_t>(*cell->integer), 4);
    if (cell->natural != nullptr) PutInteger(payload, *cell->natural, 4);
  }
  return Send(client, 'U', payload);
}

bool RtdeServer::SendText(Client& client, const std::string& text) {
  Buffer payload;
  const std::string source = "Controller";
  if (client.version >= 2) {
    payload.push_back(static_cast<std::uint8_t>(text.size()));
    payload.insert(payload.end(), text.begin(), text.end());
    payload.push_back(static_cast<std::uint8_t>(source.size()));
    payload.insert(payload.end(), source.begin(), source.end());
    payload.push_back(2);
  } else {
    payload.push_back(0);
    payload.insert(payload.end(), text.begin(), text.end());
  }
  return Send(client, 'M', payload);
}

bool RtdeServer::Send(Client& client, std::uint8_t type, const Buffer& payload) {
  Buffer message;
  PutInteger(message, payload.size() + 3, 2);
  message.push_back(type);
  message.insert(message.end(), payload.begin(), payload.end());
  if (type == 'U' && faults_.merge > 1) {
    client.together.insert(client.together.end(), message.begin(), message.end());
    if (++client.merged < faults_.merge) return true;
    client.merged = 0;
    message.swap(client.together);
    client.together.clear();
  }
  if (type == 'U' && faults_.jitter_s > 0) {
    const double delay_s = std::uniform_real_distribution<double>(0, faults_.jitter_s)(random_);
    double at_s = MonotonicNow() + delay_s;
    if (!client.late.empty()) at_s = std::max(at_s, client.late.back().first);  // stays in order
    client.late.emplace_back(at_s, std::move(message));
    return true;
  }
  if (!faults_.split) return Write(client, message.data(), message.size());
  for (std::size_t at = 0; at < message.size();) {
    const std::size_t piece =
        std::min(message.size() - at, std::uniform_int_distribution<std::size_t>(1, 7)(random_));
    if (!Write(client, message.data() + at, piece)) return false;
    at += piece;
  }
  return true;
}

bool RtdeServer::Write(Client& client, const std::uint8_t* bytes, std::size_t size) {
  client.unsent.insert(client.unsent.end(), bytes, bytes + size);
  return Flush(client);
}

bool RtdeServer::Flush(Client& client) {
  while (!client.unsent.empty()) {
    const auto sent = send(client.fd, client.unsent.data(), client.unsent.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno != EAGAIN) return false;
    if (sent <= 0) break;
    client.unsent.erase(client.unsent.begin(), client.unsent.begin() + sent);
  }
  if (client.unsent.size() <= kMostUnsent) return true;
  ++slow_readers_;
  return false;
}

std::string RtdeServer::SetFault(const std::string& words) {
  std::istringstream in(words);
  std::string verb, what, more;
  in >> verb >> what >> more;
  const bool on = what != "off";
  const double number = std::atof(what.c_str());
  if (verb == "version")
    faults_.highest_version = static_cast<int>(number);
  else if (verb == "missing")
    faults_.missing.insert(what);
  else if (verb == "in-use")
    faults_.in_use.insert(what);
  else if (verb == "free")
    faults_.in_use.erase(what);
  else if (verb == "type")
    faults_.wrong_types[what] = more;
  else if (verb == "refuse-recipe")
    faults_.refuse_recipe = on;
  else if (verb == "refuse-start")
    faults_.refuse_start = on;
  else if (verb == "split")
    faults_.split = on;
  else if (verb == "merge")
    faults_.merge = std::max(1, static_cast<int>(number));
  else if (verb == "text-between")
    faults_.text_between = on;
  else if (verb == "text-every")
    faults_.text_every_s = number;
  else if (verb == "drop")
    faults_.drop_each = static_cast<int>(number);
  else if (verb == "jitter")
    faults_.jitter_s = number;
  else if (verb == "silent")
    faults_.silent = on;
  else if (verb == "garbage")
    faults_.garbage = true;
  else if (verb == "foreign-recipe")
    faults_.foreign_recipe = on;
  else if (verb == "emergency")
    faults_.emergency = on;
  else if (verb == "close")
    CloseAll();
  else if (verb == "clock-back")
    state_.timestamp = 0;
  else if (verb == "restart") {
    CloseAll();
    const UrState before = state_;
    state_ = {};
    state_.actual_q = before.actual_q;
    state_.tcp_pose = before.tcp_pose;
    state_.tcp_offset = before.tcp_offset;
    state_.payload = before.payload;
    state_.payload_cog = before.payload_cog;
    state_.joint_temperatures = before.joint_temperatures;
  } else {
    return "'" + verb + "' is not a fault; tests/virtual_ur/README.md lists them";
  }
  return {};
}

}  // namespace virtual_ur
