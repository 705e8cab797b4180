#include "app/measure/urdf/ur_kinematics.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <map>

#include "app/base/config/xml_document.h"
#include "app/base/text/yaml_scalars.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline::measure {
namespace {

constexpr std::array kUrLinks = {"shoulder", "upper_arm", "forearm",
                                 "wrist_1",  "wrist_2",   "wrist_3"};
constexpr std::array kUrKeys = {"x", "y", "z", "roll", "pitch", "yaw"};
constexpr double kUrFarthest_m = 100;
constexpr double kUrLargestAngle = 125;  // rad, 20 turns

class UrReader {
 public:
  UrReader(const std::vector<text::YamlScalar>& scalars, std::string file,
           config::FaultList& faults)
      : file_(std::move(file)), faults_(faults) {
    for (const text::YamlScalar& scalar : scalars) scalars_.emplace(scalar.path, &scalar);
  }

  Pose OriginOf(const char* link, UrAngles angles) {
    std::array<double, 6> values{};
    for (std::size_t k = 0; k < values.size(); ++k) {
      const double limit = k < 3 ? kUrFarthest_m : kUrLargestAngle;
      values[k] = Number(fmt::format("kinematics.{}.{}", link, kUrKeys[k]), limit);
    }
    const Vec3 turn(values[3], values[4], values[5]);
    Pose X;
    X.p = Vec3(values[0], values[1], values[2]);
    X.R = RotationFromRollPitchYaw(turn);
    if (angles == UrAngles::kXyz) {
      X.R = (Eigen::AngleAxisd(turn[0], Vec3::UnitX()) * Eigen::AngleAxisd(turn[1], Vec3::UnitY()) *
             Eigen::AngleAxisd(turn[2], Vec3::UnitZ()))
                .toRotationMatrix();
    }
    return X;
  }

 private:
  double Number(const std::string& key, double limit) {
    const auto found = scalars_.find(key);
    if (found == scalars_.end()) {
      Fault(0, key,
            "missing; a default_kinematics.yaml has x, y, z, roll, pitch, yaw of six links");
      return 0;
    }
    const text::YamlScalar& scalar = *found->second;
    const auto number = config::NumbersFromText(scalar.value, 1);
    if (!number) {
      Fault(scalar.line, key,
            fmt::format("\"{}\" is not a finite number", scalar.value.substr(0, 60)));
      return 0;
    }
    if (std::abs(number->front()) <= limit) return number->front();
    Fault(scalar.line, key,
          fmt::format("{} is outside -{}..{}; the file is in metres and radians", number->front(),
                      limit, limit));
    return 0;
  }
  void Fault(int line, const std::string& key, const std::string& what) {
    faults_.Add({config::Fault::Severity::kFault, file_, line, key, what});
  }

  std::map<std::string, const text::YamlScalar*> scalars_;
  std::string file_;
  config::FaultList& faults_;
};

}  // namespace

bool IsUrKinematics(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  return first != std::string_view::npos && text[first] != '<' &&
         text.find("kinematics:") != std::string_view::npos;
}

std::optional<JointChain> ChainFromUrKinematics(std::string_view text, const std::string& file,
                                                UrAngles angles, config::FaultList& faults) {
  const auto scalars = text::ScalarsFromYaml(text);
  if (!scalars) {
    faults.Add({config::Fault::Severity::kFault, file, 0, "", scalars.error()});
    return std::nullopt;
  }
  config::FaultList own;
  UrReader reader(*scalars, file, own);
  JointChain chain{"UR", "base", "tool0", {}, {}};
  for (const char* link : kUrLinks) {
    ChainJoint& joint = chain.joints.emplace_back();
    joint.name = link;
    joint.child = fmt::format("{}_link", link);
    joint.X_prev = reader.OriginOf(link, angles);
  }
  faults.Append(own);
  if (own.HasFaults()) return std::nullopt;
  return chain;
}

}  // namespace plumbline::measure
