#include "tests/drivers/display/fake_card.h"

#include <drm.h>
#include <drm_mode.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdarg>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>

namespace plumbline::test {
namespace {

FakeCard* the_card = nullptr;
FakeFramebuffer* the_framebuffer = nullptr;

constexpr std::uint32_t kCrtc = 10, kEncoder = 20, kConnector = 30, kOverlay = 40, kPrimary = 41;

/// The properties, their numbers being their places from 100 on.
constexpr const char* kProperties[] = {"type",   "CRTC_ID", "ACTIVE", "MODE_ID", "FB_ID",
                                       "SRC_X",  "SRC_Y",   "SRC_W",  "SRC_H",   "CRTC_X",
                                       "CRTC_Y", "CRTC_W",  "CRTC_H"};

std::vector<std::uint32_t> PropertiesOf(std::uint32_t object) {
  if (object == kConnector) return {101};
  if (object == kCrtc) return {102, 103};
  return {100, 101, 104, 105, 106, 107, 108, 109, 110, 111, 112};
}

int Refuse(int error) {
  errno = error;
  return -1;
}

/// A list as the kernel hands it over: as many as there is room for, and how many there are.
template <typename T, typename Count>
void HandOver(const std::vector<T>& list, std::uint64_t to, Count& count) {
  if (to != 0 && count >= list.size()) {
    std::memcpy(reinterpret_cast<void*>(to), list.data(), list.size() * sizeof(T));
  }
  count = static_cast<Count>(list.size());
}

drm_mode_modeinfo ModeOf(image::ImageSize size, bool preferred) {
  drm_mode_modeinfo mode{};
  mode.hdisplay = static_cast<std::uint16_t>(size.width);
  mode.vdisplay = static_cast<std::uint16_t>(size.height);
  mode.vrefresh = 60;
  mode.type = preferred ? DRM_MODE_TYPE_PREFERRED : 0;
  return mode;
}

template <typename T>
T& As(void* argument) {
  return *static_cast<T*>(argument);
}

}  // namespace

FakeCard::FakeCard() {
  char folder[] = "/tmp/card-XXXXXX";
  path = std::string(mkdtemp(folder)) + "/card0";
  mkfifo(path.c_str(), 0600);  // readable and waited for, as a card's events are
  events_ = open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  struct stat status {};
  fstat(events_, &status);
  inode_ = status.st_ino;
  the_card = this;
}

FakeCard::~FakeCard() {
  the_card = nullptr;
  for (const auto& [handle, buffer] : buffers_) close(buffer.memory);
  close(events_);
  unlink(path.c_str());
  rmdir(path.substr(0, path.rfind('/')).c_str());
}

bool FakeCard::Owns(int fd) const {
  struct stat status {};
  return fstat(fd, &status) == 0 && S_ISFIFO(status.st_mode) && status.st_ino == inode_;
}

int FakeCard::MemoryAt(off_t offset) const {
  const auto found = buffers_.find(static_cast<std::uint32_t>(offset / 4096));
  return found == buffers_.end() ? -1 : found->second.memory;
}

std::uint32_t FakeCard::Pixel(int u, int v) const {
  const auto framebuffer = framebuffers_.find(on_screen_);
  if (framebuffer == framebuffers_.end()) return 0;
  const Buffer& buffer = buffers_.at(framebuffer->second);
  std::uint32_t pixel = 0;
  const off_t at = (off_t{v} * (buffer.width + 8) + u) * 4;
  return pread(buffer.memory, &pixel, sizeof pixel, at) == sizeof pixel ? pixel : 0;
}

void FakeCard::Refresh() {
  const std::lock_guard lock(mutex_);
  if (pending_ == 0) return;
  on_screen_ = pending_;
  pending_ = 0;
  drm_event_vblank event{};
  event.base.type = DRM_EVENT_FLIP_COMPLETE;
  event.base.length = sizeof event;
  event.user_data = pending_user_;
  event.crtc_id = kCrtc;
  if (write(events_, &event, sizeof event) != sizeof event) std::abort();
  if (on_flip) on_flip();
}

int FakeCard::Commit(const void* argument) {
  const auto& request = *static_cast<const drm_mode_atomic*>(argument);
  if (refuse_commits_with != 0) return Refuse(refuse_commits_with);
  if (pending_ != 0) return Refuse(EBUSY);
  std::map<std::string, std::uint64_t> set;
  const auto* objects = reinterpret_cast<const std::uint32_t*>(request.objs_ptr);
  const auto* counts = reinterpret_cast<const std::uint32_t*>(request.count_props_ptr);
  const auto* properties = reinterpret_cast<const std::uint32_t*>(request.props_ptr);
  const auto* values = reinterpret_cast<const std::uint64_t*>(request.prop_values_ptr);
  for (std::uint32_t i = 0, k = 0; i < request.count_objs; ++i) {
    const char* object = objects[i] == kConnector ? "connector "
                         : objects[i] == kCrtc    ? "crtc "
                         : objects[i] == kPrimary ? "plane "
                                                  : "? ";
    for (std::uint32_t n = 0; n < counts[i]; ++n, ++k) {
      set[std::string(object) + kProperties[properties[k] - 100]] = values[k];
    }
  }
  constexpr std::uint32_t kFlip = DRM_MODE_ATOMIC_NONBLOCK | DRM_MODE_PAGE_FLIP_EVENT;
  if ((request.flags & kFlip) != kFlip) return Refuse(EINVAL);
  image::ImageSize mode = mode_;
  if (set.contains("crtc MODE_ID")) {
    const auto blob = blobs_.find(static_cast<std::uint32_t>(set["crtc MODE_ID"]));
    if (blob == blobs_.end() || (request.flags & DRM_MODE_ATOMIC_ALLOW_MODESET) == 0 ||
        set["crtc ACTIVE"] != 1 || set["connector CRTC_ID"] != kCrtc || !connected) {
      return Refuse(EINVAL);
    }
    mode = blob->second;
  }
  const auto framebuffer = static_cast<std::uint32_t>(set["plane FB_ID"]);
  const auto width = static_cast<std::uint64_t>(mode.width);
  const auto height = static_cast<std::uint64_t>(mode.height);
  if (!framebuffers_.contains(framebuffer) || set["plane CRTC_ID"] != kCrtc || width == 0 ||
      set["plane SRC_W"] != width << 16U || set["plane SRC_H"] != height << 16U ||
      set["plane CRTC_W"] != width || set["plane CRTC_H"] != height) {
    return Refuse(EINVAL);
  }
  if (set.contains("crtc MODE_ID")) ++modes_set_;
  mode_ = mode;
  pending_ = framebuffer;
  pending_user_ = request.user_data;
  if (on_commit) on_commit();
  return 0;
}

int FakeCard::Ioctl(unsigned long request, void* argument) {
  const std::lock_guard lock(mutex_);
  return Answer(request, argument);
}

int FakeCard::Answer(unsigned long request, void* argument) {
  switch (request) {
    case DRM_IOCTL_SET_CLIENT_CAP:
      return atomic || As<drm_set_client_cap>(argument).capability != DRM_CLIENT_CAP_ATOMIC
                 ? 0
                 : Refuse(EOPNOTSUPP);
    case DRM_IOCTL_MODE_GETRESOURCES: {
      auto& resources = As<drm_mode_card_res>(argument);
      ++probes_;
      HandOver<std::uint32_t>({kCrtc}, resources.crtc_id_ptr, resources.count_crtcs);
      HandOver<std::uint32_t>({kEncoder}, resources.encoder_id_ptr, resources.count_encoders);
      HandOver<std::uint32_t>({kConnector}, resources.connector_id_ptr, resources.count_connectors);
      resources.count_fbs = 0;
      return 0;
    }
    case DRM_IOCTL_MODE_GETCONNECTOR: {
      auto& connector = As<drm_mode_get_connector>(argument);
      std::vector<drm_mode_modeinfo> offered;
      for (const image::ImageSize& size : modes) offered.push_back(ModeOf(size, offered.empty()));
      if (!connected) offered.clear();
      HandOver(offered, connector.modes_ptr, connector.count_modes);
      HandOver<std::uint32_t>({kEncoder}, connector.encoders_ptr, connector.count_encoders);
      connector.count_props = 0;
      connector.connection = connected ? 1 : 2;
      connector.connector_type = DRM_MODE_CONNECTOR_HDMIA;
      connector.connector_type_id = 1;
      return 0;
    }
    case DRM_IOCTL_MODE_GETENCODER: {
      auto& encoder = As<drm_mode_get_encoder>(argument);
      encoder.possible_crtcs = 1;
      return 0;
    }
    case DRM_IOCTL_MODE_GETPLANERESOURCES: {
      auto& planes = As<drm_mode_get_plane_res>(argument);
      HandOver<std::uint32_t>({kOverlay, kPrimary}, planes.plane_id_ptr, planes.count_planes);
      return 0;
    }
    case DRM_IOCTL_MODE_GETPLANE: {
      auto& plane = As<drm_mode_get_plane>(argument);
      plane.possible_crtcs = 1;
      plane.count_format_types = 0;
      return 0;
    }
    case DRM_IOCTL_MODE_OBJ_GETPROPERTIES: {
      auto& object = As<drm_mode_obj_get_properties>(argument);
      const std::vector<std::uint32_t> ids = PropertiesOf(object.obj_id);
      std::vector<std::uint64_t> values(ids.size(), 0);
      if (object.obj_id == kPrimary) values[0] = 1;  // type: primary
      std::uint32_t count = object.count_props;
      HandOver(ids, object.props_ptr, count);
      HandOver(values, object.prop_values_ptr, object.count_props);
      return 0;
    }
    case DRM_IOCTL_MODE_GETPROPERTY: {
      auto& property = As<drm_mode_get_property>(argument);
      if (property.prop_id < 100 || property.prop_id >= 100 + std::size(kProperties)) {
        return Refuse(ENOENT);
      }
      std::strncpy(property.name, kProperties[property.prop_id - 100], sizeof property.name - 1);
      property.count_values = property.count_enum_blobs = 0;
      return 0;
    }
    case DRM_IOCTL_MODE_CREATEPROPBLOB: {
      auto& blob = As<drm_mode_create_blob>(argument);
      const auto& mode = *reinterpret_cast<const drm_mode_modeinfo*>(blob.data);
      if (blob.length != sizeof mode) return Refuse(EINVAL);
      blob.blob_id = next_++;
      blobs_[blob.blob_id] = {mode.hdisplay, mode.vdisplay};
      return 0;
    }
    case DRM_IOCTL_MODE_DESTROYPROPBLOB:
      return blobs_.erase(As<drm_mode_destroy_blob>(argument).blob_id) == 1 ? 0 : Refuse(ENOENT);
    case DRM_IOCTL_MODE_CREATE_DUMB: {
      auto& dumb = As<drm_mode_create_dumb>(argument);
      dumb.handle = next_++;
      dumb.pitch = (dumb.width + 8) * 4;  // rows are padded, as cards do it
      dumb.size = std::uint64_t{dumb.pitch} * dumb.height;
      Buffer buffer{memfd_create("dumb", MFD_CLOEXEC), dumb.width, dumb.height};
      if (ftruncate(buffer.memory, static_cast<off_t>(dumb.size)) != 0) return Refuse(ENOMEM);
      buffers_[dumb.handle] = buffer;
      return 0;
    }
    case DRM_IOCTL_MODE_MAP_DUMB: {
      auto& map = As<drm_mode_map_dumb>(argument);
      map.offset = std::uint64_t{map.handle} * 4096;
      return 0;
    }
    case DRM_IOCTL_MODE_DESTROY_DUMB: {
      const auto found = buffers_.find(As<drm_mode_destroy_dumb>(argument).handle);
      if (found == buffers_.end()) return Refuse(ENOENT);
      close(found->second.memory);
      buffers_.erase(found);
      return 0;
    }
    case DRM_IOCTL_MODE_ADDFB2: {
      auto& framebuffer = As<drm_mode_fb_cmd2>(argument);
      if (!buffers_.contains(framebuffer.handles[0])) return Refuse(ENOENT);
      framebuffer.fb_id = next_++;
      framebuffers_[framebuffer.fb_id] = framebuffer.handles[0];
      return 0;
    }
    case DRM_IOCTL_MODE_RMFB: {
      const std::uint32_t id = As<std::uint32_t>(argument);
      if (id == on_screen_) on_screen_ = 0;
      if (id == pending_) pending_ = 0;
      return framebuffers_.erase(id) == 1 ? 0 : Refuse(ENOENT);
    }
    case DRM_IOCTL_MODE_ATOMIC:
      return Commit(argument);
    default:
      return Refuse(ENOTTY);
  }
}

FakeFramebuffer::FakeFramebuffer(const fb_var_screeninfo& with, std::size_t stride,
                                 std::size_t bytes)
    : var(with) {
  char name[] = "/tmp/framebuffer-XXXXXX";
  const int fd = mkstemp(name);
  path = name;
  if (ftruncate(fd, static_cast<off_t>(bytes)) != 0) std::abort();
  struct stat status {};
  fstat(fd, &status);
  inode_ = status.st_ino;
  close(fd);
  fix.type = FB_TYPE_PACKED_PIXELS;
  fix.visual = FB_VISUAL_TRUECOLOR;
  fix.line_length = static_cast<std::uint32_t>(stride);
  fix.smem_len = static_cast<std::uint32_t>(bytes);
  the_framebuffer = this;
}

FakeFramebuffer::~FakeFramebuffer() {
  the_framebuffer = nullptr;
  unlink(path.c_str());
}

bool FakeFramebuffer::Owns(int fd) const {
  struct stat status {};
  return fstat(fd, &status) == 0 && S_ISREG(status.st_mode) && status.st_ino == inode_;
}

std::vector<std::uint8_t> FakeFramebuffer::Bytes() const {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

int FakeFramebuffer::Ioctl(unsigned long request, void* argument) const {
  if (gone) return Refuse(ENODEV);
  if (request == FBIOGET_VSCREENINFO) {
    As<fb_var_screeninfo>(argument) = var;
  } else if (request == FBIOGET_FSCREENINFO) {
    As<fb_fix_screeninfo>(argument) = fix;
  } else {
    return Refuse(ENOTTY);
  }
  return 0;
}

}  // namespace plumbline::test

using plumbline::test::the_card;
using plumbline::test::the_framebuffer;

// Of libdrm and of ours alike: the executable's own symbols go before those of the C library.
extern "C" int ioctl(int fd, unsigned long request, ...) noexcept {
  va_list list;
  va_start(list, request);
  void* argument = va_arg(list, void*);
  va_end(list);
  if (the_card != nullptr && the_card->Owns(fd)) return the_card->Ioctl(request, argument);
  if (the_framebuffer != nullptr && the_framebuffer->Owns(fd)) {
    return the_framebuffer->Ioctl(request, argument);
  }
  return static_cast<int>(syscall(SYS_ioctl, fd, request, argument));
}

extern "C" void* __real_mmap(void* at, std::size_t bytes, int protection, int flags, int fd,
                             off_t offset);
extern "C" void* __wrap_mmap(void* at, std::size_t bytes, int protection, int flags, int fd,
                             off_t offset) {
  if (fd < 0 || the_card == nullptr || !the_card->Owns(fd)) {
    return __real_mmap(at, bytes, protection, flags, fd, offset);
  }
  return __real_mmap(at, bytes, protection, flags, the_card->MemoryAt(offset), 0);
}
