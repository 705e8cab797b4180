#include "drivers/motion/motion_link.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <system_error>
#include <utility>

#include "drivers/back_off.h"
#include "drivers/clock.h"
#include "drivers/real_time.h"

namespace plumbline::motion_link {

using motion_offset::MotionOffset;
using motion_offset::Obstacle;

namespace {

constexpr int kWait_ms = 50;
constexpr std::size_t kLargestDatagram = 9216;
/// Datagrams taken before one is answered: a flood must not postpone the answer.
constexpr int kMaxTaken = 64;

double RealTimeSeconds() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

struct MotionLink::Arrival {
  sockaddr_in from{};
  double received_s = 0;  ///< monotonic, when it was taken
  double arrived_s = 0;   ///< CLOCK_REALTIME, when the kernel had it; 0: not known
  RobotPacket packet;
  std::array<char, kLargestDatagram> bytes;
};

Result<std::unique_ptr<MotionLink>> MotionLink::Create(const MotionSettings& settings) {
  auto codec = MakeMotionCodec(settings.kind, settings.codec);
  if (!codec) return codec.failure();
  in_addr robot{}, listen{};
  if (inet_pton(AF_INET, settings.robot.c_str(), &robot) != 1 ||
      inet_pton(AF_INET, settings.listen.c_str(), &listen) != 1) {
    return Error{"robot and listen must be IPv4 addresses such as 192.168.1.10"};
  }
  if (const char* fault = Fault(settings.limits)) return Error{fault};
  return std::unique_ptr<MotionLink>(
      new MotionLink(settings, std::move(codec).value(), robot.s_addr));
}

MotionLink::MotionLink(MotionSettings settings, std::unique_ptr<MotionCodec> codec,
                       std::uint32_t robot)
    : settings_(std::move(settings)),
      codec_(std::move(codec)),
      robot_(robot),
      next_(std::make_unique<Arrival>()),
      newest_(std::make_unique<Arrival>()),
      offset_(settings_.limits, 0) {
  now_.state = status::MotionLinkState::kWaiting;
  now_.obstacle = Obstacle::kNoPackets;
}

MotionLink::~MotionLink() {
  Stop();
}

void MotionLink::Start() {
  if (thread_.joinable()) return;
  stop_ = false;
  ended_ = false;
  thread_ = std::thread([this] {
    SetRealTimePriority(kMotionPriority, "motion");
    Run();
    socket_.Reset();
    port_ = 0;
    ended_ = true;
  });
}

void MotionLink::RequestStop() {
  if (!stop_.exchange(true)) stop_since_s_ = MonotonicSeconds();
}

void MotionLink::Stop() {
  if (!thread_.joinable()) return;
  RequestStop();
  thread_.join();
}

void MotionLink::UseModel(std::shared_ptr<const motion_offset::MotionModel> model) {
  const std::lock_guard lock(model_mutex_);
  next_model_ = std::move(model);
  model_waits_ = true;
}

void MotionLink::TakeModel() {
  const std::unique_lock lock(model_mutex_, std::try_to_lock);
  if (!lock || !model_waits_) return;
  model_.swap(next_model_);
  model_waits_ = false;
}

void MotionLink::Report(const motion_offset::CycleReport& report) {
  reports_.Begin() = report;
  reports_.Publish();
}

std::string MotionLink::problem() const {
  const std::lock_guard lock(problem_mutex_);
  return problem_;
}

bool MotionLink::OpenSocket() {
  const auto fail = [this](const char* what) {
    const std::lock_guard lock(problem_mutex_);
    problem_ = fmt::format("{}:{}: {}: {}", settings_.listen, settings_.port, what,
                           std::generic_category().message(errno));
    return false;
  };
  os::Descriptor opened(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!opened) return fail("socket");
  const int yes = 1;
  setsockopt(opened.get(), SOL_SOCKET, SO_TIMESTAMPNS, &yes, sizeof yes);
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_port = htons(static_cast<std::uint16_t>(settings_.port));
  inet_pton(AF_INET, settings_.listen.c_str(), &own.sin_addr);
  if (bind(opened.get(), reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0) {
    return fail("the UDP port cannot be opened");
  }
  socklen_t size = sizeof own;
  getsockname(opened.get(), reinterpret_cast<sockaddr*>(&own), &size);
  socket_ = std::move(opened);
  port_ = ntohs(own.sin_port);
  const std::lock_guard lock(problem_mutex_);
  problem_.clear();
  return true;
}

void MotionLink::Run() {
  BackOff attempts;
  while (!socket_ && !stop_) {
    heartbeat_.Beat();
    const double now_s = MonotonicSeconds();
    if (attempts.Due(now_s) && !OpenSocket()) {
      attempts.Failed(now_s);
      now_.state = status::MotionLinkState::kNoSocket;
      status_.Begin() = now_;
      status_.Publish();
    }
    if (!socket_) SleepSeconds(1e-3 * kWait_ms);
  }
  offset_ = MotionOffset(settings_.limits, MonotonicSeconds());
  while (true) {
    heartbeat_.Beat();
    TakeModel();
    const double now_s = MonotonicSeconds();
    const bool stopped =
        stop_ && (offset_.offset().zero() || now_s - stop_since_s_ > kLongestStop_s);
    if (stopped) return;
    pollfd waiting{socket_.get(), POLLIN, 0};
    if (poll(&waiting, 1, kWait_ms) > 0) {
      Serve();
    } else {
      offset_.Idle(MonotonicSeconds());
    }
    Publish();
  }
}

long MotionLink::Receive(Arrival& arrival) {
  iovec part{arrival.bytes.data(), arrival.bytes.size()};
  alignas(cmsghdr) std::array<char, 128> control;
  msghdr message{};
  message.msg_name = &arrival.from;
  message.msg_namelen = sizeof arrival.from;
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const long size = recvmsg(socket_.get(), &message, MSG_DONTWAIT);
  if (size < 0) return size;
  arrival.received_s = MonotonicSeconds();
  arrival.arrived_s = 0;
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_TIMESTAMPNS) continue;
    timespec at{};
    std::memcpy(&at, CMSG_DATA(c), sizeof at);
    arrival.arrived_s = static_cast<double>(at.tv_sec) + 1e-9 * static_cast<double>(at.tv_nsec);
  }
  return (message.msg_flags & MSG_TRUNC) != 0 ? 0 : size;
}

void MotionLink::Serve() {
  Arrival& next = *next_;
  Arrival& newest = *newest_;
  bool accepted = false;
  for (int taken = 0; taken < kMaxTaken; ++taken) {
    const long size = Receive(next);
    if (size < 0) break;
    if (next.from.sin_addr.s_addr != robot_) {
      ++now_.foreign;
      now_.foreign_address = next.from.sin_addr.s_addr;
      continue;
    }
    const std::string_view fault =
        codec_->Parse({next.bytes.data(), static_cast<std::size_t>(size)}, next.packet);
    if (!fault.empty()) {
      ++now_.malformed;
      continue;
    }
    const auto acceptance =
        offset_.Accept({next.received_s, next.packet.number, next.packet.running});
    if (acceptance.order != motion_offset::PacketOrder::kNew) ++now_.out_of_order;
    if (!acceptance.accepted) continue;
    if (accepted) ++now_.superseded;
    accepted = true;
    newest.from = next.from;
    newest.received_s = next.received_s;
    newest.arrived_s = next.arrived_s;
    newest.packet = next.packet;
  }
  if (accepted) Answer(newest);
}

void MotionLink::Answer(const Arrival& arrival) {
  MotionOffset::Order order;
  if (stop_) {
    order.obstacle = Obstacle::kStopping;
  } else {
    order = OrderFor(*reports_.Read(), model_.get(), settings_.rules, arrival.packet.q,
                     offset_.offset(), arrival.received_s);
  }
  const motion_offset::Offset& offset =
      offset_.Next({arrival.received_s, arrival.packet.number, arrival.packet.running}, order);
  std::array<char, 512> answer;
  const std::size_t size = codec_->Encode(arrival.packet, offset, answer);
  const long sent = sendto(socket_.get(), answer.data(), size, MSG_DONTWAIT,
                           reinterpret_cast<const sockaddr*>(&arrival.from), sizeof arrival.from);
  ++(sent == static_cast<long>(size) ? now_.answered : now_.not_sent);
  now_.wanted_m = order.obstacle == Obstacle::kNone ? order.wanted.translation.norm() : 0;
  now_.late = arrival.packet.late.value_or(0);
  const double spent_s = arrival.arrived_s > 0
                             ? std::max(0.0, RealTimeSeconds() - arrival.arrived_s)
                             : MonotonicSeconds() - arrival.received_s;
  answers_.Add(spent_s);
  now_.longest_answer_s = std::max(now_.longest_answer_s, spent_s);
}

void MotionLink::Publish() {
  using State = status::MotionLinkState;
  now_.obstacle = offset_.obstacle();
  now_.offset_m = offset_.offset().translation.norm();
  now_.lost = offset_.lost();
  now_.streams = offset_.streams();
  now_.state = now_.obstacle == Obstacle::kNoPackets     ? State::kWaiting
               : now_.obstacle == Obstacle::kNotAnswered ? State::kNotAnswering
               : now_.obstacle == Obstacle::kNone        ? State::kCorrecting
                                                         : State::kAnswering;
  status_.Begin() = now_;
  status_.Publish();
}

}  // namespace plumbline::motion_link
