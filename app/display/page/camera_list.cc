#include "app/display/page/camera_list.h"

#include <algorithm>
#include <set>

#include "app/base/text/json_text.h"

namespace plumbline::display {
namespace {

/// True if a shell takes the word literally, and no program takes it for an option.
bool IsPlainWord(const std::string& word) {
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("@._:/-").find(c) != std::string_view::npos;
  };
  return !word.empty() && word.front() != '-' && std::all_of(word.begin(), word.end(), is_plain);
}

/// The name under which `plumbline cameras --choose` finds the camera. A serial number of a few
/// digits could be a place in its list, so the port is added.
std::string SelectorOf(const camera::V4l2Device& node,
                       const std::vector<camera::V4l2Device>& nodes) {
  constexpr std::size_t kLongestPlace = 4;
  if (node.port.empty()) return node.path;
  const std::string name = camera::StableName(node, nodes);
  const bool is_place =
      name.size() <= kLongestPlace && name.find_first_not_of("0123456789") == std::string::npos;
  return is_place ? camera::NameWithPort(node) : name;
}

}  // namespace

std::string CameraListJson(const std::vector<camera::V4l2Device>& nodes) {
  nlohmann::ordered_json json = {{"cameras", nlohmann::ordered_json::array()}};
  std::set<std::string> listed;
  for (const camera::V4l2Device& node : nodes) {
    const std::string select = SelectorOf(node, nodes);
    if (!listed.insert(select).second) continue;
    nlohmann::ordered_json command = nullptr;
    if (IsPlainWord(select)) command = "plumbline cameras --choose " + select;
    json["cameras"].push_back({{"name", node.name},
                               {"device", node.path},
                               {"select", select},
                               {"serial", node.serial},
                               {"port", node.port},
                               {"command", command}});
  }
  return text::JsonText(json);
}

}  // namespace plumbline::display
