#include "drivers/display/kms_output.h"

#include <fmt/format.h>
#include <xf86drm.h>

#include <cstring>
#include <memory>
#include <optional>
#include <string_view>

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

}  // namespace plumbline::display
