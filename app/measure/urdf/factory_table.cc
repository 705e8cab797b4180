#include "app/measure/urdf/factory_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "app/base/config/xml_document.h"
#include "app/base/text/yaml_scalars.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline::measure {
namespace {

constexpr std::array kFrameKeys = {"x", "y", "z", "roll", "pitch", "yaw"};
constexpr double kFarthestOrigin_m = 10;
constexpr double kLargestTurn = 2 * std::numbers::pi + 1e-3;
constexpr std::array kUrLinks = {"shoulder", "upper_arm", "forearm",
                                 "wrist_1",  "wrist_2",   "wrist_3"};

/// A mapping with at least one of the keys of a frame.
struct FrameBlock {
  std::string parent, name;
  int line = 0;
  std::array<const text::YamlScalar*, kFrameKeys.size()> values{};
  const text::YamlScalar* stray = nullptr;  ///< the first other key
};

/// Splits "kinematics.joint1.x" into "kinematics.joint1" and "x".
std::pair<std::string, std::string> SplitPath(const std::string& path) {
  const std::size_t dot = path.rfind('.');
  if (dot == std::string::npos) return {"", path};
  return {path.substr(0, dot), path.substr(dot + 1)};
}

std::vector<FrameBlock> BlocksOf(const std::vector<text::YamlScalar>& scalars) {
  std::vector<FrameBlock> blocks;
  const auto block_of = [&](const std::string& parent, const std::string& name) -> FrameBlock* {
    // The scalars of a block stand together.
    const bool last =
        !blocks.empty() && blocks.back().parent == parent && blocks.back().name == name;
    return last ? &blocks.back() : nullptr;
  };
  for (const text::YamlScalar& scalar : scalars) {
    const auto [path, key] = SplitPath(scalar.path);
    const auto [parent, name] = SplitPath(path);
    FrameBlock* block = path.empty() ? nullptr : block_of(parent, name);
    if (block == nullptr && !path.empty()) {
      FrameBlock& added = blocks.emplace_back();
      added.parent = parent;
      added.name = name;
      added.line = scalar.line;
      block = &added;
    }
    if (block == nullptr) continue;
    const auto known = std::find(kFrameKeys.begin(), kFrameKeys.end(), key);
    if (known != kFrameKeys.end()) {
      block->values[static_cast<std::size_t>(known - kFrameKeys.begin())] = &scalar;
    } else if (block->stray == nullptr) {
      block->stray = &scalar;
    }
  }
  const auto has_none = [](const FrameBlock& block) {
    return std::all_of(block.values.begin(), block.values.end(),
                       [](const text::YamlScalar* value) { return value == nullptr; });
  };
  blocks.erase(std::remove_if(blocks.begin(), blocks.end(), has_none), blocks.end());
  return blocks;
}

/// The number that a name ends in; -1 if it ends in none.
int NumberOf(const std::string& name) {
  const std::size_t last = name.find_last_not_of("0123456789");
  const std::string digits = last == std::string::npos ? name : name.substr(last + 1);
  return digits.empty() || digits.size() > 4 ? -1 : std::atoi(digits.c_str());
}

/// Places of the blocks along the chain; -1 for a name that does not say.
int PlaceOf(const FrameBlock& block, bool of_ur) {
  if (!of_ur) return NumberOf(block.name);
  const auto link = std::find(kUrLinks.begin(), kUrLinks.end(), block.name);
  return link == kUrLinks.end() ? -1 : static_cast<int>(link - kUrLinks.begin());
}

/// True if a block has the name of a UR's link; "wrist_1" alone is also a number.
bool IsUr(const std::vector<FrameBlock>& blocks) {
  return std::any_of(blocks.begin(), blocks.end(),
                     [](const FrameBlock& block) { return PlaceOf(block, true) >= 0; });
}

void OrderAlongChain(std::vector<FrameBlock>& blocks, bool of_ur) {
  std::stable_sort(blocks.begin(), blocks.end(), [&](const FrameBlock& a, const FrameBlock& b) {
    return PlaceOf(a, of_ur) < PlaceOf(b, of_ur);
  });
}

/// What is wrong with the places of the blocks along the chain: a name that says none, one place
/// twice, or a gap.
/// @param blocks  in the order of their places
std::optional<std::string> PlaceFaultOf(const std::vector<FrameBlock>& blocks, bool of_ur) {
  for (const FrameBlock& block : blocks) {
    if (PlaceOf(block, of_ur) >= 0) continue;
    return of_ur ? fmt::format(
                       "has a frame \"{}\" (line {}) beside those of a UR; its links are "
                       "{}: remove it, or rename the others if this is no UR",
                       block.name, block.line, fmt::join(kUrLinks, ", "))
                 : fmt::format(
                       "has a frame \"{}\" (line {}) without a number, so its place in the "
                       "arm is not clear; a factory table numbers its joints (joint1, "
                       "joint2, ..)",
                       block.name, block.line);
  }
  for (std::size_t k = 1; k < blocks.size(); ++k) {
    if (PlaceOf(blocks[k], of_ur) != PlaceOf(blocks[k - 1], of_ur)) continue;
    return fmt::format(
        "has two blocks of one number, {} (line {}) and {} (line {}), so the order of the joints "
        "is not clear; rename one",
        blocks[k - 1].name, blocks[k - 1].line, blocks[k].name, blocks[k].line);
  }
  if (of_ur && blocks.size() < kUrLinks.size()) {
    std::vector<std::string_view> missing(kUrLinks.begin(), kUrLinks.end());
    for (const FrameBlock& block : blocks) {
      missing.erase(std::remove(missing.begin(), missing.end(), block.name), missing.end());
    }
    return fmt::format("lacks the frame of {}; a UR has {}: export the table again",
                       fmt::join(missing, ", "), fmt::join(kUrLinks, ", "));
  }
  const int first = PlaceOf(blocks.front(), of_ur);
  if (first > 1) {
    return fmt::format(
        "starts with {} (line {}); the joints of an arm are numbered from 0 or 1: "
        "add the frames before it",
        blocks.front().name, blocks.front().line);
  }
  for (std::size_t k = 1; k < blocks.size(); ++k) {
    if (PlaceOf(blocks[k], of_ur) == first + static_cast<int>(k)) continue;
    return fmt::format(
        "has no frame between {} (line {}) and {} (line {}), so the arm would lack a "
        "joint; add it, or number the joints without a gap",
        blocks[k - 1].name, blocks[k - 1].line, blocks[k].name, blocks[k].line);
  }
  return std::nullopt;
}

class FrameReader {
 public:
  FrameReader(std::string file, config::FaultList& faults)
      : file_(std::move(file)), faults_(faults) {}

  Pose OriginOf(const FrameBlock& block, TableAngles angles) {
    std::array<double, kFrameKeys.size()> values{};
    const std::string place =
        block.parent.empty() ? block.name : fmt::format("{}.{}", block.parent, block.name);
    std::vector<std::string> missing;
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (block.values[k] == nullptr) missing.emplace_back(kFrameKeys[k]);
    }
    if (!missing.empty()) {
      Fault(block.line, place,
            fmt::format("has no {}; the frame of a joint has x, y, z in metres and roll, pitch, "
                        "yaw in radians",
                        fmt::join(missing, ", ")));
      return {};
    }
    if (block.stray != nullptr) {
      Fault(block.stray->line, block.stray->path,
            "is not part of a joint's frame (x, y, z, roll, pitch, yaw), and ignoring it could "
            "change the arm; remove it if the frame is complete without it");
      return {};
    }
    for (std::size_t k = 0; k < values.size(); ++k) {
      const auto value = Number(*block.values[k], k < 3);
      if (!value) return {};
      values[k] = *value;
    }
    const Vec3 turn(values[3], values[4], values[5]);
    Pose X;
    X.p = Vec3(values[0], values[1], values[2]);
    X.R = RotationFromRollPitchYaw(turn);
    if (angles == TableAngles::kXyz) {
      X.R = (Eigen::AngleAxisd(turn[0], Vec3::UnitX()) * Eigen::AngleAxisd(turn[1], Vec3::UnitY()) *
             Eigen::AngleAxisd(turn[2], Vec3::UnitZ()))
                .toRotationMatrix();
    }
    return X;
  }

  void Fault(int line, const std::string& key, const std::string& what) {
    faults_.Add({config::Fault::Severity::kFault, file_, line, key, what});
  }

 private:
  std::optional<double> Number(const text::YamlScalar& scalar, bool length) {
    const auto number = config::NumbersFromText(scalar.value, 1);
    if (!number) {
      Fault(scalar.line, scalar.path,
            fmt::format("\"{}\" is not a finite number", scalar.value.substr(0, 60)));
      return std::nullopt;
    }
    const double value = number->front(), limit = length ? kFarthestOrigin_m : kLargestTurn;
    if (std::abs(value) <= limit) return value;
    Fault(scalar.line, scalar.path,
          length ? fmt::format("{} is outside -{}..{}; the table is in metres: convert millimetres",
                               value, limit, limit)
                 : fmt::format("{} is more than a turn; the table is in radians: convert degrees",
                               value));
    return std::nullopt;
  }

  std::string file_;
  config::FaultList& faults_;
};

/// What is wrong with the table as a whole.
/// @param blocks  in the order of their places along the chain
std::optional<std::string> FaultOf(const std::vector<FrameBlock>& blocks, bool of_ur) {
  if (blocks.empty()) {
    return "has no frames of joints; a factory table has one block of x, y, z, roll, pitch, yaw "
           "for each joint, and a URDF is XML";
  }
  const auto other = std::find_if(blocks.begin(), blocks.end(), [&](const FrameBlock& block) {
    return block.parent != blocks.front().parent;
  });
  if (other != blocks.end()) {
    return fmt::format(
        "has frames under \"{}\" and under \"{}\" (line {}), so which of them form the arm is not "
        "clear; leave one table",
        blocks.front().parent, other->parent, other->line);
  }
  if (auto fault = PlaceFaultOf(blocks, of_ur)) return fault;
  if (std::ssize(blocks) > model::kMaxJoints) {
    return fmt::format("has {} joint frames; an arm has at most {}", blocks.size(),
                       model::kMaxJoints);
  }
  return std::nullopt;
}

}  // namespace

bool IsFactoryTable(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  if (first == std::string_view::npos || text[first] == '<') return false;
  const auto has = [&](std::string_view key) { return text.find(key) != std::string_view::npos; };
  return has("kinematics:") || (has("roll") && has("pitch") && has("yaw"));
}

std::optional<JointChain> ChainFromFactoryTable(std::string_view text, const std::string& file,
                                                TableAngles angles, config::FaultList& faults) {
  config::FaultList own;
  FrameReader reader(file, own);
  JointChain chain;
  const auto scalars = text::ScalarsFromYaml(text);
  if (!scalars) {
    reader.Fault(0, "", scalars.error());
  } else {
    std::vector<FrameBlock> blocks = BlocksOf(*scalars);
    const bool of_ur = IsUr(blocks);
    OrderAlongChain(blocks, of_ur);
    const auto fault = FaultOf(blocks, of_ur);
    if (fault) reader.Fault(0, "", *fault);
    for (std::size_t k = 0; k < blocks.size() && !fault; ++k) {
      ChainJoint& joint = chain.joints.emplace_back();
      joint.name = blocks[k].name;
      joint.child = fmt::format("{}_link", blocks[k].name);
      joint.X_prev = reader.OriginOf(blocks[k], angles);
    }
    chain.name = of_ur ? "UR" : "arm";
    chain.base = "base";
    chain.tip =
        of_ur || blocks.empty() ? "tool0" : fmt::format("the frame of {}", blocks.back().name);
  }
  faults.Append(own);
  if (own.HasFaults()) return std::nullopt;
  return chain;
}

}  // namespace plumbline::measure
