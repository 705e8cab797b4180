#include "drivers/display/registry.h"

#include "drivers/device_kinds.h"

namespace plumbline::display {
namespace {

constexpr DeviceKind<Display, DisplayConnection> kDisplayKinds[] = {
    {"kms", [](const DisplayConnection& c) { return KmsDisplay::Create(c.kms, c.clock); }},
    {"framebuffer",
     [](const DisplayConnection& c) { return FramebufferDisplay::Create(c.framebuffer, c.clock); }},
    {"none", [](const DisplayConnection& c) { return NoDisplay::Create(c.none, c.clock); }},
};

}  // namespace

Result<std::unique_ptr<Display>> MakeDisplay(std::string_view kind,
                                             const DisplayConnection& connection) {
  return MakeOfKind(kDisplayKinds, "display", kind, connection);
}

}  // namespace plumbline::display
