#include "drivers/display/registry.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>

namespace plumbline::display {
namespace {

using MadeDisplay = Result<std::unique_ptr<Display>>;

struct DisplayKind {
  std::string_view name;
  MadeDisplay (*make)(const DisplayConnection&);
};

constexpr std::array<DisplayKind, 3> kDisplayKinds = {{
    {"kms", [](const DisplayConnection& c) { return KmsDisplay::Create(c.kms, c.clock); }},
    {"framebuffer",
     [](const DisplayConnection& c) { return FramebufferDisplay::Create(c.framebuffer, c.clock); }},
    {"none", [](const DisplayConnection& c) { return NoDisplay::Create(c.none, c.clock); }},
}};

}  // namespace

std::vector<std::string_view> DisplayKinds() {
  std::vector<std::string_view> names;
  names.reserve(kDisplayKinds.size());
  for (const DisplayKind& kind : kDisplayKinds) names.push_back(kind.name);
  return names;
}

Result<std::unique_ptr<Display>> MakeDisplay(std::string_view kind,
                                             const DisplayConnection& connection) {
  for (const DisplayKind& known : kDisplayKinds) {
    if (known.name == kind) return known.make(connection);
  }
  return Error{
      fmt::format("display \"{}\" is not one of {}", kind, fmt::join(DisplayKinds(), ", "))};
}

}  // namespace plumbline::display
