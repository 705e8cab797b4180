// JSON of the values in a view state: numbers, vectors, poses, optional values, enumerators.
//
// The readers accept untrusted text: they throw a std::exception that says what is wrong.
#pragma once

#include <fmt/format.h>

#include <optional>
#include <stdexcept>

#include "app/base/text/json_integer.h"
#include "app/base/text/json_text.h"
#include "firmware-like/geometry/pose.h"
#include "firmware-like/model/robot_state.h"

namespace plumbline::cell {

using Json = nlohmann::ordered_json;

using text::NumberJson;
/// @return  CameraStatus::kNever for null
double NumberOf(const Json& json);

template <typename Vector>
Json VectorJson(const Vector& values) {
  Json list = Json::array();
  for (const double value : values) list.push_back(NumberJson(value));
  return list;
}

/// @throws  std::exception if `json` is not a list of values.size() numbers
template <typename Vector>
void ReadVector(const Json& json, Vector& values) {
  if (json.size() != static_cast<std::size_t>(values.size())) {
    throw std::out_of_range(fmt::format("{} numbers instead of {}", json.size(), values.size()));
  }
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    values[i] = json.at(static_cast<std::size_t>(i)).get<double>();
  }
}

Vec3 Vec3Of(const Json& json);
/// At most kMaxJoints numbers.
model::JointVector JointsOf(const Json& json);
/// Position [m] and unit quaternion.
Json PoseJson(const Pose& X);
Pose PoseOfJson(const Json& json);
template <typename T>
Json OptionalJson(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

/// An enumerator between 0 and `last`.
template <typename E>
E EnumOf(const Json& json, E last) {
  const int number = text::IntegerFromJson<int>(json);
  if (number < 0 || number > static_cast<int>(last)) {
    throw std::out_of_range(fmt::format("{} is outside 0..{}", number, static_cast<int>(last)));
  }
  return static_cast<E>(number);
}

}  // namespace plumbline::cell
