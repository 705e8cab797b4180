#include "app/programs/correction/point_text.h"

#include <fmt/format.h>

#include "firmware-like/geometry/rotation.h"

namespace plumbline::programs {
namespace {

std::optional<std::vector<double>> ValuesOf(const Point& point, const Conventions& conventions) {
  const std::size_t count = 3 + static_cast<std::size_t>(conventions.orientation_numbers);
  if (point.numbers.size() < count) return std::nullopt;
  std::vector<double> values;
  for (std::size_t k = 0; k < count; ++k) {
    if (!point.numbers[k]) return std::nullopt;
    values.push_back(point.numbers[k]->value);
  }
  return values;
}

Vec3 PositionOf(const Point& point) {
  return {point.numbers[0]->value, point.numbers[1]->value, point.numbers[2]->value};
}

}  // namespace

bool StatesPositionAlone(const Point& point) {
  for (std::size_t k = 0; k < point.numbers.size(); ++k) {
    if (point.numbers[k].has_value() != (k < 3)) return false;
  }
  return point.numbers.size() >= 3;
}

Result<Pose> PoseOf(const Point& point, const Conventions& conventions,
                    const std::optional<Mat3>& orientation) {
  Pose pose;
  if (const auto values = ValuesOf(point, conventions)) {
    const Result<Mat3> R = conventions.rotation(std::span(*values).subspan(3));
    if (!R) return R.failure();
    pose = {*R, conventions.m_per_unit * Vec3((*values)[0], (*values)[1], (*values)[2])};
  } else if (orientation && StatesPositionAlone(point)) {
    pose = {*orientation, conventions.m_per_unit * PositionOf(point)};
  } else {
    return Error{
        "not all of its numbers are written: what is missing keeps the value of the point before"};
  }
  if (!pose.R.allFinite() || !pose.p.allFinite()) return Error{"its numbers are not finite"};
  return pose;
}

Pose PoseFromNumbers(std::span<const double> numbers, const Conventions& conventions) {
  const Result<Mat3> R = conventions.rotation(numbers.subspan(3));
  return {R ? *R : Mat3(Mat3::Identity()),
          conventions.m_per_unit * Vec3(numbers[0], numbers[1], numbers[2])};
}

std::optional<std::vector<double>> NumbersOfPose(const Pose& X_UP, const Point& like,
                                                 const Conventions& conventions) {
  const auto old = ValuesOf(like, conventions);
  if (!old) return std::nullopt;
  std::vector<double> numbers;
  for (int axis = 0; axis < 3; ++axis) numbers.push_back(X_UP.p[axis] / conventions.m_per_unit);
  const std::vector<double> angles = conventions.numbers(X_UP.R, std::span(*old).subspan(3));
  numbers.insert(numbers.end(), angles.begin(), angles.end());
  return numbers;
}

std::string_view TrimmedBlanks(std::string_view text) {
  const std::size_t first = text.find_first_not_of(' ');
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(' ') - first + 1);
}

void AddIfChanged(std::string_view bytes, Edit edit, std::vector<Edit>& edits) {
  if (bytes.substr(edit.begin, edit.end - edit.begin) != edit.text) {
    edits.push_back(std::move(edit));
  }
}

PointText TextOf(const Point& point, const Pose& taught, const Pose& corrected,
                 const Conventions& conventions, const std::vector<SourceFile>& files) {
  constexpr double kNoTurn_rad = 1e-10;
  PointText text;
  std::optional<std::vector<double>> numbers, old;
  if (StatesPositionAlone(point)) {
    const Vec3 p = corrected.p / conventions.m_per_unit, before = PositionOf(point);
    numbers.emplace(p.begin(), p.end());
    old.emplace(before.begin(), before.end());
  } else {
    numbers = NumbersOfPose(corrected, point, conventions);
    old = ValuesOf(point, conventions);
  }
  if (!numbers || !old || numbers->size() != old->size()) {
    text.problem = "not all of its numbers are written";
    return text;
  }
  const bool turned = VectorFromRotation(corrected.R * taught.R.transpose()).norm() >= kNoTurn_rad;
  std::vector<double> written = *old;
  for (std::size_t k = 0; k < numbers->size(); ++k) {
    if (k >= 3 && !turned) break;
    const Number& number = *point.numbers[k];
    if (number.span.file >= files.size()) {
      text.problem = "its numbers are in none of the files";
      return text;
    }
    const std::string& bytes = files[number.span.file].bytes;
    auto edit =
        NumberEdit(bytes, number, (*numbers)[k], k < 3 ? conventions.length : conventions.angle,
                   k < 3 ? 0 : conventions.turn);
    if (!edit) {
      text.problem = fmt::format("its number {} is written in an unusual way", k + 1);
      return text;
    }
    const auto value = NumberFromText(TrimmedBlanks(edit->text));
    if (value) written[k] = *value;
    AddIfChanged(bytes, std::move(*edit), text.edits);
  }
  text.written = taught;
  if (written.size() > 3) {
    if (!text.edits.empty()) text.written = PoseFromNumbers(written, conventions);
  } else {
    text.written = {corrected.R, conventions.m_per_unit * Vec3(written[0], written[1], written[2])};
  }
  return text;
}

}  // namespace plumbline::programs
