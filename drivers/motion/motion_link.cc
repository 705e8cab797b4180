#include "drivers/motion/motion_link.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <linux/filter.h>
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

namespace {

constexpr int kWait_ms = 50;
constexpr std::size_t kLargestDatagram = 9216;
/// Datagrams taken before one is answered: a flood must not postpone the answer. After so many the
/// thread rests, because it has a higher priority than the control cycle.
constexpr int kMaxTaken = 64;
constexpr double kRest_s = 0.001;
/// Packets from others in a second that are not a controller with another address.
constexpr std::uint64_t kFlood = 2000;
/// In the socket: a controller's packets have a few hundred bytes.
constexpr int kReceiveBuffer = 256 * 1024;

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
  std::array<char, kLargestDatagram> bytes;
};

Result<std::unique_ptr<MotionLink>> MotionLink::Create(const MotionSettings& settings) {
  in_addr listen{};
  if (inet_pton(AF_INET, settings.listen.c_str(), &listen) != 1) {
    return Error{"listen must be an IPv4 address of this computer, or 0.0.0.0"};
  }
  Result<MotionResponder> responder = MotionResponder::Create(settings, MonotonicSeconds());
  if (!responder) return responder.failure();
  return std::unique_ptr<MotionLink>(new MotionLink(settings, std::move(responder).value()));
}

MotionLink::MotionLink(MotionSettings settings, MotionResponder responder)
    : settings_(std::move(settings)),
      responder_(std::move(responder)),
      next_(std::make_unique<Arrival>()),
      newest_(std::make_unique<Arrival>()) {
  Publish();
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
  setsockopt(opened.get(), SOL_SOCKET, SO_RCVBUF, &kReceiveBuffer, sizeof kReceiveBuffer);
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
  others_ignored_ = false;
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
    if (attempts.Due(now_s)) {
      no_socket_ = !OpenSocket();
      if (no_socket_) attempts.Failed(now_s);
      Publish();
    }
    if (!socket_) SleepSeconds(1e-3 * kWait_ms);
  }
  responder_.Restart(MonotonicSeconds());
  while (true) {
    heartbeat_.Beat();
    TakeModel();
    const double now_s = MonotonicSeconds();
    const bool stopped =
        stop_ && (responder_.offset().zero() || now_s - stop_since_s_ > kLongestStop_s);
    if (stopped) return;
    pollfd waiting{socket_.get(), POLLIN, 0};
    if (poll(&waiting, 1, kWait_ms) > 0) {
      if (!Serve()) SleepSeconds(kRest_s);
    } else {
      responder_.Idle(MonotonicSeconds());
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

bool MotionLink::Serve() {
  int taken = 0;
  for (; taken < kMaxTaken; ++taken) {
    const long size = Receive(*next_);
    if (size < 0) break;
    const std::string_view datagram(next_->bytes.data(), static_cast<std::size_t>(size));
    if (!responder_.Take(next_->from.sin_addr.s_addr, datagram, next_->received_s)) continue;
    next_.swap(newest_);
  }
  Answer(*newest_);
  const double now_s = MonotonicSeconds();
  const std::uint64_t foreign = responder_.Status().foreign;
  if (now_s - foreign_since_s_ >= 1) {
    foreign_since_s_ = now_s;
    foreign_before_ = foreign;
  }
  if (foreign - foreign_before_ > kFlood) IgnoreOthers();
  return taken < kMaxTaken;
}

void MotionLink::IgnoreOthers() {
  if (others_ignored_) return;
  in_addr robot{};
  inet_pton(AF_INET, settings_.robot.c_str(), &robot);
  constexpr std::uint32_t kSourceOfIpv4 = 12;  // offset in the header [RFC 791]
  std::array<sock_filter, 4> code = {{
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(SKF_NET_OFF) + kSourceOfIpv4),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, ntohl(robot.s_addr), 0, 1),
      BPF_STMT(BPF_RET | BPF_K, 0xFFFFFFFFU),
      BPF_STMT(BPF_RET | BPF_K, 0U),
  }};
  const sock_fprog program{static_cast<unsigned short>(code.size()), code.data()};
  setsockopt(socket_.get(), SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program);
  others_ignored_ = true;
}

void MotionLink::Answer(const Arrival& arrival) {
  std::array<char, 512> answer;
  const std::size_t size = responder_.Answer(*reports_.Read(), model_.get(), stop_, answer);
  if (size == 0) return;
  const long sent = sendto(socket_.get(), answer.data(), size, MSG_DONTWAIT,
                           reinterpret_cast<const sockaddr*>(&arrival.from), sizeof arrival.from);
  if (sent != static_cast<long>(size)) ++not_sent_;
  const double spent_s = arrival.arrived_s > 0
                             ? std::max(0.0, RealTimeSeconds() - arrival.arrived_s)
                             : MonotonicSeconds() - arrival.received_s;
  answers_.Add(spent_s);
  longest_answer_s_ = std::max(longest_answer_s_, spent_s);
}

void MotionLink::Publish() {
  status::MotionLinkStatus& status = status_.Begin();
  status = responder_.Status();
  status.not_sent = not_sent_;
  status.longest_answer_s = longest_answer_s_;
  if (no_socket_) status.state = status::MotionLinkState::kNoSocket;
  status_.Publish();
}

}  // namespace plumbline::motion_link
