#include "app/cell/view_link/view_client.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>

#include "app/cell/view_link/view_json.h"
#include "app/cell/view_link/view_publisher.h"
#include "drivers/clock.h"

namespace plumbline::cell {
namespace {

/// Upper bound for a plausible text: that of 65,536 points.
constexpr off_t kMaxTextBytes = off_t{64} << 20;
/// Upper bound for a plausible slot; the largest supported image is smaller.
constexpr std::uint64_t kMaxSlotBytes = std::uint64_t{1} << 30;

/// The text in a memory of the publisher; nullopt if it cannot be read or is implausibly large.
std::optional<std::string> TextIn(const os::Descriptor& memory) {
  struct stat about {};
  if (fstat(memory.get(), &about) != 0 || about.st_size > kMaxTextBytes) return std::nullopt;
  std::string text(static_cast<std::size_t>(about.st_size), '\0');
  // The offset of the descriptor is shared with the other viewers.
  const ssize_t got = pread(memory.get(), text.data(), text.size(), 0);
  if (got != about.st_size) return std::nullopt;
  return text;
}

/// One message with the descriptors sent along with it.
struct Received {
  ssize_t bytes = 0;
  ViewMessage message;
  std::vector<os::Descriptor> descriptors;

  /// Whether it is complete, with as many descriptors as it says.
  bool Known() const {
    return bytes == sizeof message &&
           std::memcmp(message.magic, ViewMessage().magic, sizeof message.magic) == 0 &&
           descriptors.size() == 1U + (message.points != 0) + (message.images != 0);
  }
};

Received ReceiveFrom(int socket) {
  Received received;
  iovec part{&received.message, sizeof received.message};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int) * ViewMessage::kMaxDescriptors)] = {};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  header.msg_control = control;
  header.msg_controllen = sizeof control;
  received.bytes = recvmsg(socket, &header, MSG_DONTWAIT | MSG_CMSG_CLOEXEC | MSG_TRUNC);
  if (received.bytes < 0) return received;
  for (cmsghdr* at = CMSG_FIRSTHDR(&header); at != nullptr; at = CMSG_NXTHDR(&header, at)) {
    if (at->cmsg_level != SOL_SOCKET || at->cmsg_type != SCM_RIGHTS) continue;
    const std::size_t count = (at->cmsg_len - CMSG_LEN(0)) / sizeof(int);
    for (std::size_t k = 0; k < count; ++k) {
      int descriptor = -1;
      std::memcpy(&descriptor, CMSG_DATA(at) + k * sizeof descriptor, sizeof descriptor);
      received.descriptors.emplace_back(descriptor);
    }
  }
  return received;
}

std::string ConnectProblem(int code) {
  if (code == EACCES || code == EPERM) return kMayNotConnect;
  if (code == ENOENT || code == ECONNREFUSED) return kNotRunning;
  return fmt::format("plumblined cannot be reached: {}", std::strerror(code));
}

}  // namespace

ViewClient::~ViewClient() {
  Disconnect("");
}

void ViewClient::Disconnect(std::string problem) {
  socket_.Reset();
  if (at_ != nullptr) munmap(const_cast<std::uint8_t*>(at_), bytes_);
  at_ = nullptr;
  problem_ = std::move(problem);
  back_off_.Failed(MonotonicSeconds());
}

bool ViewClient::Connect() {
  if (socket_) return true;
  if (!back_off_.Due(MonotonicSeconds())) return false;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path_.size() >= sizeof address.sun_path) {
    Disconnect(path_ + ": too long for a socket path");
    return false;
  }
  std::memcpy(address.sun_path, path_.c_str(), path_.size() + 1);
  socket_.Reset(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const auto* const where = reinterpret_cast<const sockaddr*>(&address);
  if (!socket_ || connect(socket_.get(), where, sizeof address) != 0) {
    Disconnect(ConnectProblem(errno));
    return false;
  }
  problem_ = "connected to plumblined, no data yet";
  return true;
}

bool ViewClient::MapMemory(const os::Descriptor& memory, std::size_t slot_bytes) {
  if (at_ != nullptr) munmap(const_cast<std::uint8_t*>(at_), bytes_);
  at_ = nullptr;
  if (!images_) return true;
  struct stat about {};
  const std::size_t bytes = ViewPublisher::kSlots * slot_bytes;
  const bool enough = slot_bytes >= kViewPixels && slot_bytes <= kMaxSlotBytes &&
                      fstat(memory.get(), &about) == 0 &&
                      static_cast<std::size_t>(about.st_size) >= bytes;
  void* const at =
      enough ? mmap(nullptr, bytes, PROT_READ, MAP_SHARED, memory.get(), 0) : MAP_FAILED;
  if (at == MAP_FAILED) return false;
  at_ = static_cast<const std::uint8_t*>(at);
  bytes_ = bytes;
  slot_bytes_ = slot_bytes;
  ++memory_;
  return true;
}

bool ViewClient::CopyImage(const ViewImage& image, View::Pixels& pixels) const {
  const std::size_t size = static_cast<std::size_t>(image.width) *
                           static_cast<std::size_t>(image.height) * (image.colour ? 3 : 1);
  if (at_ == nullptr || image.slot >= ViewPublisher::kSlots || kViewPixels + size > slot_bytes_) {
    return false;
  }
  const std::uint8_t* const slot = at_ + static_cast<std::size_t>(image.slot) * slot_bytes_;
  // The mapping is read-only; a 32-bit atomic load does not write.
  const auto stamp = [slot] {
    return std::atomic_ref<std::uint32_t>(
               *reinterpret_cast<std::uint32_t*>(const_cast<std::uint8_t*>(slot)))
        .load();
  };
  if (stamp() != image.stamp) return false;
  pixels.stamp = 0;
  pixels.bytes.assign(slot + kViewPixels, slot + kViewPixels + size);
  OrderStampAndPixels();
  if (stamp() != image.stamp) return false;
  pixels.stamp = image.stamp;
  pixels.memory = memory_;
  return true;
}

/// Each state lists the images of all cameras; images that were already copied are skipped.
bool ViewClient::CopyImages(View& view) const {
  view.pixels.resize(view.state.cameras.size());
  for (std::size_t k = 0; k < view.pixels.size(); ++k) {
    const std::optional<ViewImage>& image = view.state.cameras[k].image;
    View::Pixels& pixels = view.pixels[k];
    if (!image) {
      pixels = {};
      continue;
    }
    const bool here = pixels.stamp == image->stamp && pixels.memory == memory_;
    if (!here && !CopyImage(*image, pixels)) return false;
  }
  return true;
}

bool ViewClient::Receive(Arrived& arrived) {
  Received got = ReceiveFrom(socket_.get());
  if (got.bytes < 0 && (errno == EAGAIN || errno == EINTR)) return true;
  if (got.bytes <= 0) {
    Disconnect("plumblined closed the connection");
    return false;
  }
  if (!got.Known() ||
      (got.message.images != 0 && !MapMemory(got.descriptors.back(), got.message.slot_bytes))) {
    Disconnect(
        "plumblined sends data in an unknown format; restart it and this program, so that both "
        "are of the same version");
    arrived = {};
    return false;
  }
  arrived.state = std::move(got.descriptors[0]);
  if (got.message.points != 0) arrived.points = std::move(got.descriptors[1]);
  return true;
}

bool ViewClient::Take(const Arrived& arrived) {
  const auto text_of = [](const os::Descriptor& memory) {
    return TextIn(memory).value_or("");  // refused below, with the reason for an empty text
  };
  if (arrived.points) {
    static std::atomic<std::uint64_t> lists{1};  // a View may be used with several clients
    auto points = PointsOfJson(text_of(arrived.points));
    if (!points) {
      Disconnect(points.error());
      return false;
    }
    points_ = std::move(points).value();
    points_number_ = ++lists;
  }
  if (!arrived.state) return false;
  auto state = ViewOfJson(text_of(arrived.state));
  if (!state) {
    problem_ = state.error();
    return false;
  }
  std::vector<ViewPoint> points = std::move(fresh_.state.points);
  if (fresh_.state.points_number != points_number_) points = points_;
  fresh_.state = std::move(state).value();
  fresh_.state.points = std::move(points);
  fresh_.state.points_number = points_number_;
  return true;
}

bool ViewClient::Read(double timeout_s, View& view) {
  const double deadline_s = MonotonicSeconds() + timeout_s;
  if (!Connect()) {
    std::this_thread::sleep_for(
        std::chrono::duration<double>(std::min(std::max(timeout_s, 0.0), BackOff::kFirst_s)));
    return false;
  }
  Arrived arrived;
  for (;;) {
    const double left_s = arrived.state ? 0 : deadline_s - MonotonicSeconds();
    pollfd waiting{socket_.get(), POLLIN, 0};
    const int ready = poll(&waiting, 1, static_cast<int>(std::ceil(1e3 * std::max(0.0, left_s))));
    if (ready <= 0 || !Receive(arrived)) break;
  }
  if (!Take(arrived)) return false;
  if (!images_) {
    fresh_.pixels.clear();
  } else if (!CopyImages(fresh_)) {
    return false;  // an image was overwritten during the copy; the next state is on its way
  }
  std::swap(view, fresh_);
  back_off_.Well();
  if (socket_) problem_.clear();
  return true;
}

}  // namespace plumbline::cell
