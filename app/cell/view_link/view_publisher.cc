#include "app/cell/view_link/view_publisher.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <utility>

#include "app/cell/view_link/view_json.h"
#include "drivers/os/file_writing.h"

namespace plumbline::cell {
namespace {

/// The kernel raises it to its minimum, which holds a few messages: a viewer that does not read
/// keeps no more states in memory.
constexpr int kSendBuffer = 1;

std::atomic_ref<std::uint32_t> StampIn(std::uint8_t* slot) {
  return std::atomic_ref<std::uint32_t>(*reinterpret_cast<std::uint32_t*>(slot));
}

/// Lets the daemon's group connect. A plain chmod() would follow a symbolic link that replaced the
/// socket after it was bound.
bool OpenToGroup(const std::string& path) {
  const os::Descriptor at(open(path.c_str(), O_PATH | O_NOFOLLOW | O_CLOEXEC));
  if (!at) return false;
  struct stat about {};
  const bool is_socket = fstat(at.get(), &about) == 0 && S_ISSOCK(about.st_mode);
  const bool changed =
      is_socket && chmod(fmt::format("/proc/self/fd/{}", at.get()).c_str(), 0660) == 0;
  if (!is_socket) errno = ELOOP;
  return changed;
}

/// Sealed memory that contains the text; invalid if the system refuses it.
os::Descriptor MemoryWith(std::string_view text) {
  os::Descriptor memory(memfd_create("plumbline-state", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  constexpr int kSeals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE | F_SEAL_SEAL;
  if (!memory || !os::WriteAll(memory.get(), text) ||
      fcntl(memory.get(), F_ADD_SEALS, kSeals) != 0) {
    return {};
  }
  return memory;
}

}  // namespace

Result<std::unique_ptr<ViewPublisher>> ViewPublisher::Open(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    return Error{fmt::format("{}: too long for a socket path, which has at most {} bytes", path,
                             sizeof address.sun_path - 1)};
  }
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  os::Descriptor made(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!made)
    return Error{fmt::format("{}: cannot create a socket: {}", path, std::strerror(errno))};
  struct stat about {};
  if (lstat(path.c_str(), &about) == 0 && S_ISSOCK(about.st_mode)) unlink(path.c_str());
  const auto* const where = reinterpret_cast<const sockaddr*>(&address);
  if (bind(made.get(), where, sizeof address) != 0 || !OpenToGroup(path) ||
      listen(made.get(), kMaxViewers) != 0) {
    return Error{fmt::format("{}: {}", path, std::strerror(errno))};
  }
  return std::unique_ptr<ViewPublisher>(new ViewPublisher(path, std::move(made)));
}

ViewPublisher::ViewPublisher(std::string path, os::Descriptor socket)
    : path_(std::move(path)), socket_(std::move(socket)) {}

ViewPublisher::~ViewPublisher() {
  unlink(path_.c_str());
  if (at_ != nullptr) munmap(at_, kSlots * slot_bytes_);
}

bool ViewPublisher::PollViewers() {
  Accept();
  for (std::size_t k = viewers_.size(); k-- > 0;) {
    if (!Connected(viewers_[k])) Drop(k);
  }
  return !viewers_.empty();
}

bool ViewPublisher::Connected(const Viewer& viewer) {
  char byte = 0;
  const ssize_t got = recv(viewer.socket.get(), &byte, sizeof byte, MSG_DONTWAIT);
  return got > 0 || (got < 0 && (errno == EAGAIN || errno == EINTR));
}

void ViewPublisher::Accept() {
  for (;;) {
    os::Descriptor viewer(accept4(socket_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!viewer) return;
    if (viewers_.size() >= kMaxViewers) continue;
    setsockopt(viewer.get(), SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof kSendBuffer);
    viewers_.push_back({std::move(viewer), 0, 0});
  }
}

void ViewPublisher::Drop(std::size_t index) {
  viewers_.erase(viewers_.begin() + static_cast<std::ptrdiff_t>(index));
}

bool ViewPublisher::Reserve(std::size_t bytes) {
  if (bytes <= slot_bytes_) return true;
  const std::size_t slot = (bytes + 4095) / 4096 * 4096;
  os::Descriptor fresh(memfd_create("plumbline-view", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!fresh) return false;
  void* const at =
      ftruncate(fresh.get(), static_cast<off_t>(kSlots * slot)) == 0
          ? mmap(nullptr, kSlots * slot, PROT_READ | PROT_WRITE, MAP_SHARED, fresh.get(), 0)
          : MAP_FAILED;
  // Sealed after mapping it here: viewers can map it read-only and cannot truncate it.
  constexpr int kSeals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_FUTURE_WRITE | F_SEAL_SEAL;
  if (at == MAP_FAILED || fcntl(fresh.get(), F_ADD_SEALS, kSeals) != 0) return false;
  if (at_ != nullptr) munmap(at_, kSlots * slot_bytes_);
  memory_ = std::move(fresh);
  ++memory_number_;
  at_ = static_cast<std::uint8_t*>(at);
  slot_bytes_ = slot;
  next_.fill(0);
  return true;
}

std::optional<ViewImage> ViewPublisher::Share(std::size_t camera, const image::LumaView& luma,
                                              const std::uint8_t* bgr) {
  const std::size_t row = static_cast<std::size_t>(luma.width) * (bgr != nullptr ? 3 : 1);
  const auto height = static_cast<std::size_t>(luma.height);
  if (row == 0 || height == 0 || !Reserve(kViewPixels + row * height)) return std::nullopt;
  ViewImage image;
  image.slot = kSlotsPerCamera * static_cast<int>(camera) + next_[camera];
  image.stamp = ++stamp_ == 0 ? ++stamp_ : stamp_;
  image.width = luma.width;
  image.height = luma.height;
  image.colour = bgr != nullptr;
  std::uint8_t* const slot = at_ + static_cast<std::size_t>(image.slot) * slot_bytes_;
  StampIn(slot).store(0);
  OrderStampAndPixels();
  if (bgr != nullptr) {
    std::memcpy(slot + kViewPixels, bgr, row * height);
  } else {
    for (std::size_t v = 0; v < height; ++v) {
      std::memcpy(slot + kViewPixels + v * row, luma.row(static_cast<int>(v)), row);
    }
  }
  StampIn(slot).store(image.stamp);
  next_[camera] = (next_[camera] + 1) % kSlotsPerCamera;
  return image;
}

bool ViewPublisher::SendTo(Viewer& viewer, const os::Descriptor& state) {
  ViewMessage message;
  message.slot_bytes = slot_bytes_;
  message.points = viewer.points_sent != points_number_ ? 1 : 0;
  message.images = viewer.memory_sent != memory_number_ ? 1 : 0;
  std::array<int, ViewMessage::kMaxDescriptors> handed{state.get()};
  std::size_t count = 1;
  if (message.points != 0) handed[count++] = points_.get();
  if (message.images != 0) handed[count++] = memory_.get();
  iovec part{&message, sizeof message};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof handed)] = {};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  header.msg_control = control;
  header.msg_controllen = CMSG_SPACE(count * sizeof(int));
  cmsghdr* const head = CMSG_FIRSTHDR(&header);
  head->cmsg_level = SOL_SOCKET;
  head->cmsg_type = SCM_RIGHTS;
  head->cmsg_len = CMSG_LEN(count * sizeof(int));
  std::memcpy(CMSG_DATA(head), handed.data(), count * sizeof(int));
  if (sendmsg(viewer.socket.get(), &header, MSG_NOSIGNAL | MSG_DONTWAIT) < 0) {
    // Its socket is full, or too many descriptors wait in the sockets of viewers that do not read.
    return errno == EAGAIN || errno == EINTR || errno == ENOBUFS || errno == ETOOMANYREFS;
  }
  viewer.points_sent = points_number_;
  viewer.memory_sent = memory_number_;
  return true;
}

void ViewPublisher::Send(const ViewState& state) {
  if (viewers_.empty()) return;
  if (state.points_number != points_number_) {
    points_ = MemoryWith(JsonOfPoints(state.points));
    points_number_ = points_ ? state.points_number : 0;
  }
  const os::Descriptor text = MemoryWith(JsonOfView(state));
  if (!text || !points_) return;
  for (std::size_t k = viewers_.size(); k-- > 0;) {
    if (!SendTo(viewers_[k], text)) Drop(k);
  }
}

}  // namespace plumbline::cell
