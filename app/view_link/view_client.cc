#include "app/view_link/view_client.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>

#include "app/view_link/scene_message.h"
#include "app/view_link/view_json.h"
#include "app/view_link/view_publisher.h"
#include "drivers/clock.h"

namespace plumbline::view_link {
namespace {

constexpr std::size_t kMaxMessageBytes = 1 << 21;
/// Upper bound for a plausible slot; the largest supported image is smaller.
constexpr std::uint64_t kMaxSlotBytes = std::uint64_t{1} << 30;

/// One message, with the descriptor sent along with it, if any.
struct Received {
  ssize_t bytes = 0;
  os::Descriptor descriptor;
};

Received ReceiveFrom(int socket, std::vector<char>& message) {
  message.resize(kMaxMessageBytes);
  iovec part{message.data(), message.size()};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))] = {};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  header.msg_control = control;
  header.msg_controllen = sizeof control;
  Received received;
  received.bytes = recvmsg(socket, &header, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
  if (received.bytes < 0) return received;
  for (cmsghdr* at = CMSG_FIRSTHDR(&header); at != nullptr; at = CMSG_NXTHDR(&header, at)) {
    if (at->cmsg_level != SOL_SOCKET || at->cmsg_type != SCM_RIGHTS) continue;
    int descriptor = -1;
    std::memcpy(&descriptor, CMSG_DATA(at), sizeof descriptor);
    received.descriptor.Reset(descriptor);
  }
  return received;
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
    Disconnect(fmt::format("{}: {}; is plumblined running, and may this user connect?", path_,
                           std::strerror(errno)));
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

void ViewClient::SendScene(const status::SceneStatus& scene) {
  if (!socket_) return;
  const SceneMessage message = EncodeScene(scene);
  // No retry: the message would be outdated. Read() detects a lost connection.
  [[maybe_unused]] const ssize_t sent =
      send(socket_.get(), message.data(), message.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
}

bool ViewClient::Read(double timeout_s, View& view) {
  const double deadline_s = MonotonicSeconds() + timeout_s;
  if (!Connect()) {
    std::this_thread::sleep_for(
        std::chrono::duration<double>(std::min(std::max(timeout_s, 0.0), BackOff::kFirst_s)));
    return false;
  }
  std::string newest;
  for (;;) {
    const double left_s = newest.empty() ? deadline_s - MonotonicSeconds() : 0;
    pollfd waiting{socket_.get(), POLLIN, 0};
    const int ready = poll(&waiting, 1, static_cast<int>(std::ceil(1e3 * std::max(0.0, left_s))));
    if (ready <= 0) break;
    const Received got = ReceiveFrom(socket_.get(), message_);
    if (got.bytes < 0 && (errno == EAGAIN || errno == EINTR)) continue;
    if (got.bytes <= 0) {
      Disconnect("plumblined closed the connection");
      break;
    }
    if (!got.descriptor) {
      newest.assign(message_.data(), static_cast<std::size_t>(got.bytes));
      continue;
    }
    ViewMemory memory;
    const bool known = static_cast<std::size_t>(got.bytes) == sizeof memory &&
                       std::memcmp(message_.data(), memory.magic, sizeof memory.magic) == 0;
    if (known) std::memcpy(&memory, message_.data(), sizeof memory);
    if (!known || !MapMemory(got.descriptor, memory.slot_bytes)) {
      Disconnect(
          "plumblined sends images in an unknown format; restart it and this program, so that both "
          "are of the same version");
      return false;
    }
  }
  if (newest.empty()) return false;
  auto state = ViewOfJson(newest);
  if (!state) {
    problem_ = state.error();
    return false;
  }
  fresh_.state = std::move(state).value();
  if (!images_) {
    fresh_.pixels.clear();
  } else if (!CopyImages(fresh_)) {
    return false;  // an image was overwritten during the copy; the next state is on its way
  }
  std::swap(view, fresh_);
  back_off_.Well();
  problem_.clear();
  return true;
}

}  // namespace plumbline::view_link
