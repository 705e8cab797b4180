// Fuzzer: arbitrary bytes as cell, configuration, robot profile, object table, zoom profile or
// bodies: faults, never a crash or a hang, and no tree deeper than the scan before the parser
// allows.
#include <toml++/toml.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "app/base/config/body_reader.h"
#include "app/base/config/cell_reader.h"
#include "app/base/config/daemon_config_reader.h"
#include "app/base/config/robot_profile_reader.h"
#include "app/base/config/zoom_profile_reader.h"
#include "app/base/text/text.h"
#include "app/cell/scene/object_table.h"

namespace {

constexpr std::string_view kCell = R"(schema = 1
[robot]
name = "arm"
convention = "mdh"
[[robot.joint]]
a_mm = 500
alpha_deg = 0
d_mm = 0
[tool]
model = "rigid"
tcp_mm = [0, 0, 100]
)";

constexpr std::string_view kProfile = R"(schema = 1
name = "test"
source = "fuzz"
[[read]]
table = "holding"
first = 0
count = 20
[[joints]]
table = "holding"
address = [0]
type = "int16"
unit = "mrad"
)";

plumbline::Result<std::string> File(const std::string& path) {
  return std::string(path.find("profile") != std::string::npos ? kProfile : kCell);
}

int DepthOf(const toml::node& node) {
  int deepest = 0;
  if (const auto* table = node.as_table()) {
    for (const auto& [key, child] : *table) deepest = std::max(deepest, 1 + DepthOf(child));
  } else if (const auto* array = node.as_array()) {
    for (const toml::node& child : *array) deepest = std::max(deepest, 1 + DepthOf(child));
  }
  return deepest;
}

/// One part of a header may mean two levels: an array of tables and its last table.
void CompareDepth(std::string_view text) {
  if (plumbline::text::LineNestedTooDeepInToml(text)) return;
  try {
    if (DepthOf(toml::parse(text)) > 2 * plumbline::text::kMaxNestingDepth) std::abort();
  } catch (const toml::parse_error&) {
    return;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  CompareDepth(text);
  plumbline::config::FaultList faults;
  bool read = false;
  switch (data[0] % 8) {
    case 0:
      read = plumbline::config::CellFromText(text, "cell.toml", faults).has_value();
      break;
    case 1:
      read = plumbline::config::DaemonConfigFromText(text, "plumbline.toml", File, "/", faults)
                 .has_value();
      break;
    case 2:
      read = plumbline::config::RobotProfileFromText(text, "profile.toml", faults).has_value();
      break;
    case 3: {
      plumbline::target::TagDatabase tags;
      tags.tags.push_back({17, 0.05});
      read = plumbline::cell::ObjectTableFromText(text, "objects.toml", &tags, faults).has_value();
      break;
    }
    case 4:
      read = plumbline::config::HidProfileFromText(text, "zoom.toml", faults).has_value();
      break;
    default:
      read = plumbline::config::TagDatabaseFromText(text, "bodies.toml", faults).has_value();
  }
  // Either a value or a fault, never both or neither.
  if (read == faults.HasFaults()) std::abort();
  return plumbline::config::FaultsText(faults).empty() && !read ? 1 : 0;
}
