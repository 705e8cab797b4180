#include "app/cli/profile_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "app/base/text/text.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::cli {
namespace {

using robot::NameOf;

/// "type", and "word_order" where it matters.
std::string TypeLines(robot::RegisterType type, modbus::WordOrder order) {
  std::string lines = fmt::format("type = \"{}\"\n", NameOf(type));
  if (robot::WordsOf(type) == 2) lines += fmt::format("word_order = \"{}\"\n", NameOf(order));
  return lines;
}

std::string UnitLines(const char* unit, double scale) {
  return (scale == 1 ? std::string() : fmt::format("scale = {:g}\n", scale)) +
         fmt::format("unit = \"{}\"\n", unit);
}

template <typename Addresses>
std::string AddressLine(const char* key, const Addresses& addresses) {
  return fmt::format("{} = [{}]\n", key, fmt::join(addresses, ", "));
}

std::string JointGroup(const robot::JointDecoding& joints, std::size_t first, std::size_t end,
                       bool prismatic) {
  const auto part = [&](const std::vector<int>& all) {
    return std::vector<int>(all.begin() + static_cast<std::ptrdiff_t>(first),
                            all.begin() + static_cast<std::ptrdiff_t>(end));
  };
  std::string text = fmt::format("\n[[joints]]\ntable = \"{}\"\n", NameOf(joints.table)) +
                     AddressLine("address", part(joints.addresses)) +
                     TypeLines(joints.type, joints.order);
  if (prismatic) return text + UnitLines("mm", joints.unit->m * kMmPerMetre);
  text += UnitLines(joints.unit->unit, joints.unit->scale);
  if (joints.wrap == robot::JointWrap::kPi) text += "wrap = \"pi\"\n";
  if (joints.wrap != robot::JointWrap::kRevolutions) return text;
  text += "wrap = \"revolutions\"\n" + AddressLine("revolutions", part(joints.revolutions));
  if (joints.revolutions_scale != 1)
    text += fmt::format("revolutions_scale = {:g}\n", joints.revolutions_scale);
  return text;
}

std::string PoseGroup(const robot::PoseDecoding& pose, robot::RegisterTable table) {
  const std::string head = fmt::format("table = \"{}\"\n", NameOf(table));
  return fmt::format("\n[tcp]\nof = \"{}\"\n[tcp.position]\n", pose.of_flange ? "flange" : "tool") +
         head + AddressLine("address", pose.position) + TypeLines(pose.type, pose.order) +
         UnitLines(pose.length_unit, pose.length_scale) + "[tcp.orientation]\n" + head +
         AddressLine("address", pose.orientation) + TypeLines(pose.type, pose.order) +
         UnitLines(pose.angle_unit, pose.angle_scale) +
         fmt::format("convention = \"{}\"\n", NameOf(pose.convention));
}

/// Without the characters that would end a TOML string or a comment.
std::string Quotable(std::string text) {
  for (char& c : text) {
    if (c == '"' || c == '\\' || static_cast<unsigned char>(c) < ' ') c = '_';
  }
  return text;
}

}  // namespace

std::vector<robot::RegisterBlock> BlocksOf(const robot::DecodingCandidate& candidate,
                                           const robot::RegisterImage& image, int max_count) {
  std::vector<std::pair<int, int>> wanted;
  const int words = robot::WordsOf(candidate.joints.type);
  for (const int address : candidate.joints.addresses) wanted.emplace_back(address, words);
  for (const int address : candidate.joints.revolutions) wanted.emplace_back(address, 1);
  if (candidate.pose) {
    const int of_pose = robot::WordsOf(candidate.pose->type);
    for (const int address : candidate.pose->position) wanted.emplace_back(address, of_pose);
    for (const int address : candidate.pose->orientation) wanted.emplace_back(address, of_pose);
  }
  return robot::BlocksFor(wanted, image, max_count);
}

std::string ProfileText(const FoundProfile& found, const std::vector<bool>& prismatic) {
  const robot::JointDecoding& joints = found.candidate.joints;
  std::string text = fmt::format(
      "# Found by plumbline registers scan; {}.\n# Compare the joints that plumbline doctor shows "
      "with the teach pendant before you use it.\n\nschema = 1\nname = \"{}\"\n"
      "source = \"plumbline registers scan {}:{}\"\nport = {}\nunit_id = {}\n",
      found.evidence, Quotable(found.name), Quotable(found.host), found.port, found.port,
      found.unit);
  for (const robot::RegisterBlock& block : found.blocks) {
    text += fmt::format("\n[[read]]\ntable = \"{}\"\nfirst = {}\ncount = {}\n", NameOf(block.table),
                        block.first, block.count);
  }
  for (std::size_t first = 0; first < prismatic.size();) {
    std::size_t end = first;
    while (end < prismatic.size() && prismatic[end] == prismatic[first]) ++end;
    text += JointGroup(joints, first, end, prismatic[first]);
    first = end;
  }
  if (found.candidate.pose) text += PoseGroup(*found.candidate.pose, joints.table);
  return text;
}

}  // namespace plumbline::cli
