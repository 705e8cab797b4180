#include "drivers/display/kms_display.h"

#include <drm_fourcc.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <xf86drm.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

#include "drivers/files/open_failure.h"

namespace plumbline::display {
namespace {

template <auto kFree>
struct FreeBy {
  template <typename T>
  void operator()(T* object) const {
    kFree(object);
  }
};
using DrmResources = std::unique_ptr<drmModeRes, FreeBy<drmModeFreeResources>>;
using DrmConnector = std::unique_ptr<drmModeConnector, FreeBy<drmModeFreeConnector>>;
using DrmEncoder = std::unique_ptr<drmModeEncoder, FreeBy<drmModeFreeEncoder>>;
using DrmPlanes = std::unique_ptr<drmModePlaneRes, FreeBy<drmModeFreePlaneResources>>;
using DrmPlane = std::unique_ptr<drmModePlane, FreeBy<drmModeFreePlane>>;
using DrmProperties = std::unique_ptr<drmModeObjectProperties, FreeBy<drmModeFreeObjectProperties>>;
using DrmProperty = std::unique_ptr<drmModePropertyRes, FreeBy<drmModeFreeProperty>>;
using DrmRequest = std::unique_ptr<drmModeAtomicReq, FreeBy<drmModeAtomicFree>>;

std::string NameOf(const drmModeConnector& connector) {
  const char* type = drmModeGetConnectorTypeName(connector.connector_type);
  return fmt::format("{}-{}", type == nullptr ? "Unknown" : type, connector.connector_type_id);
}

/// Id and value of an object property; nullopt if there is none of that name.
struct PropertyValue {
  std::uint32_t id = 0;
  std::uint64_t value = 0;
};
std::optional<PropertyValue> PropertyOf(int card, std::uint32_t object, std::uint32_t kind,
                                        std::string_view name) {
  const DrmProperties all(drmModeObjectGetProperties(card, object, kind));
  if (!all) return std::nullopt;
  for (std::uint32_t i = 0; i < all->count_props; ++i) {
    const DrmProperty property(drmModeGetProperty(card, all->props[i]));
    if (property && name == property->name) return {{all->props[i], all->prop_values[i]}};
  }
  return std::nullopt;
}

/// Index of a usable CRTC in the list of the card, as used by the kernel's masks.
std::optional<int> CrtcFor(int card, const drmModeRes& resources,
                           const drmModeConnector& connector) {
  for (int i = 0; i < connector.count_encoders; ++i) {
    const DrmEncoder encoder(drmModeGetEncoder(card, connector.encoders[i]));
    if (!encoder) continue;
    for (int k = 0; k < resources.count_crtcs; ++k) {
      if ((encoder->possible_crtcs >> static_cast<unsigned>(k) & 1U) != 0) return k;
    }
  }
  return std::nullopt;
}

/// Primary plane of a CRTC.
std::optional<std::uint32_t> PrimaryPlaneOf(int card, int crtc_index) {
  const DrmPlanes planes(drmModeGetPlaneResources(card));
  for (std::uint32_t i = 0; planes && i < planes->count_planes; ++i) {
    const DrmPlane plane(drmModeGetPlane(card, planes->planes[i]));
    if (!plane || (plane->possible_crtcs >> static_cast<unsigned>(crtc_index) & 1U) == 0) continue;
    const auto type = PropertyOf(card, plane->plane_id, DRM_MODE_OBJECT_PLANE, "type");
    if (type && type->value == DRM_PLANE_TYPE_PRIMARY) return plane->plane_id;
  }
  return std::nullopt;
}

/// First mode of the requested size, otherwise the preferred mode.
drmModeModeInfo ChooseMode(const drmModeConnector& connector, image::ImageSize wanted) {
  drmModeModeInfo chosen = connector.modes[0];
  for (int i = connector.count_modes - 1; i >= 0; --i) {
    if ((connector.modes[i].type & DRM_MODE_TYPE_PREFERRED) != 0) chosen = connector.modes[i];
  }
  for (int i = connector.count_modes - 1; i >= 0; --i) {
    const drmModeModeInfo& mode = connector.modes[i];
    if (image::ImageSize{mode.hdisplay, mode.vdisplay} == wanted) chosen = mode;
  }
  return chosen;
}

/// @return the name of the first missing property; empty: all found
std::string FindProperties(int card, KmsOutput& output) {
  auto& p = output.property;
  const struct {
    std::uint32_t object, kind;
    const char* name;
    std::uint32_t& id;
  } wanted[] = {
      {output.connector, DRM_MODE_OBJECT_CONNECTOR, "CRTC_ID", p.connector_crtc},
      {output.crtc, DRM_MODE_OBJECT_CRTC, "ACTIVE", p.crtc_active},
      {output.crtc, DRM_MODE_OBJECT_CRTC, "MODE_ID", p.crtc_mode},
      {output.plane, DRM_MODE_OBJECT_PLANE, "FB_ID", p.plane_framebuffer},
      {output.plane, DRM_MODE_OBJECT_PLANE, "CRTC_ID", p.plane_crtc},
      {output.plane, DRM_MODE_OBJECT_PLANE, "SRC_X", p.plane_src_x},
      {output.plane, DRM_MODE_OBJECT_PLANE, "SRC_Y", p.plane_src_y},
      {output.plane, DRM_MODE_OBJECT_PLANE, "SRC_W", p.plane_src_w},
      {output.plane, DRM_MODE_OBJECT_PLANE, "SRC_H", p.plane_src_h},
      {output.plane, DRM_MODE_OBJECT_PLANE, "CRTC_X", p.plane_crtc_x},
      {output.plane, DRM_MODE_OBJECT_PLANE, "CRTC_Y", p.plane_crtc_y},
      {output.plane, DRM_MODE_OBJECT_PLANE, "CRTC_W", p.plane_crtc_w},
      {output.plane, DRM_MODE_OBJECT_PLANE, "CRTC_H", p.plane_crtc_h},
  };
  for (const auto& [object, kind, name, id] : wanted) {
    const auto property = PropertyOf(card, object, kind, name);
    if (!property) return name;
    id = property->id;
  }
  return "";
}

}  // namespace

Result<KmsOutput> ChooseKmsOutput(int card, const std::string& connector_name,
                                  image::ImageSize size) {
  const DrmResources resources(drmModeGetResources(card));
  if (!resources) return Error{"has no mode setting"};
  std::string seen;
  for (int i = 0; i < resources->count_connectors; ++i) {
    const DrmConnector connector(drmModeGetConnector(card, resources->connectors[i]));
    if (!connector) continue;
    KmsOutput output;
    output.name = NameOf(*connector);
    seen += (seen.empty() ? "" : ", ") + output.name;
    if (!connector_name.empty() && connector_name != output.name) continue;
    if (connector->connection != DRM_MODE_CONNECTED || connector->count_modes < 1) continue;
    const auto crtc_index = CrtcFor(card, *resources, *connector);
    if (!crtc_index) continue;
    const auto plane = PrimaryPlaneOf(card, *crtc_index);
    if (!plane) continue;
    output.connector = connector->connector_id;
    output.crtc = resources->crtcs[*crtc_index];
    output.plane = *plane;
    output.mode = ChooseMode(*connector, size);
    if (const std::string missing = FindProperties(card, output); !missing.empty()) {
      return Error{fmt::format("{} lacks the property {}", output.name, missing)};
    }
    return output;
  }
  if (connector_name.empty()) return Error{fmt::format("no monitor connected to any of {}", seen)};
  return Error{fmt::format("no monitor connected to {}; the card has {}", connector_name, seen)};
}

bool IsStillConnected(int card, std::uint32_t connector) {
  const DrmConnector now(drmModeGetConnectorCurrent(card, connector));
  return now && now->connection == DRM_MODE_CONNECTED;
}

int FlipTo(int card, const KmsOutput& output, std::uint32_t framebuffer, bool with_mode,
           void* user) {
  const DrmRequest request(drmModeAtomicAlloc());
  const auto& p = output.property;
  const auto set = [&](std::uint32_t object, std::uint32_t property, std::uint64_t value) {
    drmModeAtomicAddProperty(request.get(), object, property, value);
  };
  std::uint32_t mode_blob = 0;
  std::uint32_t flags = DRM_MODE_ATOMIC_NONBLOCK | DRM_MODE_PAGE_FLIP_EVENT;
  if (with_mode) {
    if (drmModeCreatePropertyBlob(card, &output.mode, sizeof output.mode, &mode_blob) != 0) {
      return errno;
    }
    set(output.connector, p.connector_crtc, output.crtc);
    set(output.crtc, p.crtc_active, 1);
    set(output.crtc, p.crtc_mode, mode_blob);
    flags |= DRM_MODE_ATOMIC_ALLOW_MODESET;
  }
  const std::uint64_t width = output.mode.hdisplay, height = output.mode.vdisplay;
  set(output.plane, p.plane_framebuffer, framebuffer);
  set(output.plane, p.plane_crtc, output.crtc);
  set(output.plane, p.plane_src_x, 0);
  set(output.plane, p.plane_src_y, 0);
  set(output.plane, p.plane_src_w, width << 16U);  // in 1/65536 of a pixel
  set(output.plane, p.plane_src_h, height << 16U);
  set(output.plane, p.plane_crtc_x, 0);
  set(output.plane, p.plane_crtc_y, 0);
  set(output.plane, p.plane_crtc_w, width);
  set(output.plane, p.plane_crtc_h, height);
  const int result = drmModeAtomicCommit(card, request.get(), flags, user);
  if (mode_blob != 0) drmModeDestroyPropertyBlob(card, mode_blob);
  return result < 0 ? -result : 0;
}

Result<std::unique_ptr<DumbBuffer>> DumbBuffer::Make(int card, image::ImageSize size) {
  std::unique_ptr<DumbBuffer> buffer(new DumbBuffer(card));
  const auto failed = [](const char* what) {
    return Error{
        fmt::format("cannot allocate a scan-out buffer ({}): {}", what, std::strerror(errno))};
  };
  drm_mode_create_dumb made{};
  made.width = static_cast<std::uint32_t>(size.width);
  made.height = static_cast<std::uint32_t>(size.height);
  made.bpp = 32;
  if (drmIoctl(card, DRM_IOCTL_MODE_CREATE_DUMB, &made) != 0) return failed("create");
  buffer->handle_ = made.handle;
  buffer->bytes_ = made.size;
  buffer->layout_ = {.size = size, .stride = made.pitch};
  if (const Result<void> valid = CheckLayout(buffer->layout_, made.size); !valid) {
    return Error{"the card provides a buffer with " + valid.error()};
  }
  const std::uint32_t handles[4] = {made.handle}, strides[4] = {made.pitch}, offsets[4] = {};
  if (drmModeAddFB2(card, made.width, made.height, DRM_FORMAT_XRGB8888, handles, strides, offsets,
                    &buffer->framebuffer_, 0) != 0) {
    return failed("framebuffer");
  }
  drm_mode_map_dumb mapped{};
  mapped.handle = made.handle;
  if (drmIoctl(card, DRM_IOCTL_MODE_MAP_DUMB, &mapped) != 0) return failed("map");
  void* memory = mmap(nullptr, made.size, PROT_READ | PROT_WRITE, MAP_SHARED, card,
                      static_cast<off_t>(mapped.offset));
  if (memory == MAP_FAILED) return failed("mmap");
  buffer->memory_ = static_cast<std::uint8_t*>(memory);
  return buffer;
}

DumbBuffer::~DumbBuffer() {
  if (memory_ != nullptr) munmap(memory_, bytes_);
  if (framebuffer_ != 0) drmModeRmFB(card_, framebuffer_);
  if (handle_ == 0) return;
  drm_mode_destroy_dumb gone{};
  gone.handle = handle_;
  drmIoctl(card_, DRM_IOCTL_MODE_DESTROY_DUMB, &gone);
}

namespace {

/// Callback of libdrm for a page-flip event.
void OnFlipped(int, unsigned, unsigned, unsigned, unsigned, void* user) {
  *static_cast<bool*>(user) = false;
}

}  // namespace

KmsDisplay::KmsDisplay(KmsOptions options, Clock clock, Sleep sleep)
    : options_(std::move(options)), clock_(clock), sleep_(sleep) {}

Result<std::unique_ptr<Display>> KmsDisplay::Create(const KmsOptions& options, Clock clock,
                                                    Sleep sleep) {
  if (options.card.empty()) return Error{"the display card is empty"};
  if (options.size.width < 0 || options.size.height < 0) {
    return Error{"the display size is negative"};
  }
  return std::unique_ptr<Display>(new KmsDisplay(options, clock, sleep));
}

/// @return why there is no display; empty: success
std::string KmsDisplay::Open() {
  card_.Reset(open(options_.card.c_str(), O_RDWR | O_CLOEXEC));
  if (!card_) {
    return files::OpenErrorText(errno, files::kDisplayDevice);
  }
  if (drmSetClientCap(card_.get(), DRM_CLIENT_CAP_UNIVERSAL_PLANES, 1) != 0 ||
      drmSetClientCap(card_.get(), DRM_CLIENT_CAP_ATOMIC, 1) != 0) {
    return "has no atomic mode setting. Use the display kind \"framebuffer\".";
  }
  auto output = ChooseKmsOutput(card_.get(), options_.connector, options_.size);
  if (!output) return output.error();
  for (auto& buffer : buffers_) {
    auto made = DumbBuffer::Make(card_.get(), output->size());
    if (!made) return made.error();
    buffer = std::move(made).value();
  }
  output_ = std::move(output).value();
  last_hotplug_poll_s_ = clock_();
  return "";
}

void KmsDisplay::Close() {
  for (auto& buffer : buffers_) buffer.reset();
  output_.reset();
  mode_is_set_ = flipping_ = false;
  card_.Reset();
}

DisplayResult KmsDisplay::Disconnect(const std::string& why) {
  problem_ = fmt::format("{}{} {}", options_.card, output_ ? ", " + output_->name + ":" : ":", why);
  Close();
  back_off_.Failed(clock_());
  return DisplayResult::kLost;
}

DisplayResult KmsDisplay::WaitForFlip(double timeout_s) {
  const double left_s = std::clamp(timeout_s, 0.0, kFlipTimeout_s);
  pollfd waited{.fd = card_.get(), .events = POLLIN, .revents = 0};
  if (poll(&waited, 1, static_cast<int>(1e3 * left_s)) > 0) {
    drmEventContext events{};
    events.version = 3;
    events.page_flip_handler2 = OnFlipped;
    if ((waited.revents & POLLIN) == 0 || drmHandleEvent(card_.get(), &events) != 0) {
      return Disconnect("card lost");
    }
  }
  if (!flipping_) return DisplayResult::kReady;
  if (clock_() - flip_requested_s_ < kFlipTimeout_s) return DisplayResult::kBusy;
  return Disconnect("the card does not complete page flips; reopening");
}

DisplayResult KmsDisplay::Wait(double timeout_s) {
  const double now_s = clock_();
  if (!output_) {
    if (!back_off_.Due(now_s)) {
      sleep_(std::max(timeout_s, 0.0));
      return DisplayResult::kWaiting;
    }
    if (const std::string why = Open(); !why.empty()) return Disconnect(why);
    back_off_.Well();
  }
  if (now_s - last_hotplug_poll_s_ > kHotplugPollPeriod_s) {
    last_hotplug_poll_s_ = now_s;
    if (!IsStillConnected(card_.get(), output_->connector))
      return Disconnect("monitor disconnected");
  }
  return flipping_ ? WaitForFlip(timeout_s) : DisplayResult::kReady;
}

DisplayResult KmsDisplay::Show(DrawnPicture& picture) {
  if (!output_) return DisplayResult::kLost;
  if (flipping_) return DisplayResult::kBusy;
  if (picture.size() != size()) return DisplayResult::kSizeMismatch;
  DumbBuffer& buffer = *buffers_[next_];
  buffer.Fill(picture);
  const int error = FlipTo(card_.get(), *output_, buffer.framebuffer(), !mode_is_set_, &flipping_);
  if (error == EBUSY) return DisplayResult::kBusy;
  if (error == EACCES || error == EPERM) {
    return Disconnect("another program controls the display. Stop the desktop.");
  }
  if (error != 0) return Disconnect(fmt::format("page flip rejected: {}", std::strerror(error)));
  mode_is_set_ = flipping_ = true;
  flip_requested_s_ = clock_();
  next_ = 1 - next_;
  return DisplayResult::kShown;
}

}  // namespace plumbline::display
