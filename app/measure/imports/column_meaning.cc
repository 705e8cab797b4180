#include "app/measure/imports/column_meaning.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <numbers>
#include <set>

#include "firmware-like/model/joint_columns.h"

namespace plumbline::measure {
namespace {

struct KnownUnit {
  ValueKind kind;
  std::string_view name;
  UnitScale scale;
};

constexpr double kDegree = 180 / std::numbers::pi;
constexpr std::array kKnownUnits = {
    KnownUnit{ValueKind::kLength, "mm", {1, 0}},
    KnownUnit{ValueKind::kLength, "m", {1000, 0}},
    KnownUnit{ValueKind::kLength, "cm", {10, 0}},
    KnownUnit{ValueKind::kLength, "um", {1e-3, 0}},
    KnownUnit{ValueKind::kLength, "\xC2\xB5m", {1e-3, 0}},  // micro sign
    KnownUnit{ValueKind::kLength, "\xCE\xBCm", {1e-3, 0}},  // Greek mu
    KnownUnit{ValueKind::kLength, "in", {25.4, 0}},
    KnownUnit{ValueKind::kLength, "inch", {25.4, 0}},
    KnownUnit{ValueKind::kAngle, "deg", {1, 0}},
    KnownUnit{ValueKind::kAngle, "\xC2\xB0", {1, 0}},
    KnownUnit{ValueKind::kAngle, "degree", {1, 0}},
    KnownUnit{ValueKind::kAngle, "degrees", {1, 0}},
    KnownUnit{ValueKind::kAngle, "rad", {kDegree, 0}},
    KnownUnit{ValueKind::kAngle, "mrad", {1e-3 * kDegree, 0}},
    KnownUnit{ValueKind::kTemperature, "C", {1, 0}},
    KnownUnit{ValueKind::kTemperature,
              "\xC2\xB0"
              "C",
              {1, 0}},
    KnownUnit{ValueKind::kTemperature, "degC", {1, 0}},
    KnownUnit{ValueKind::kTemperature, "K", {1, -273.15}},
    KnownUnit{ValueKind::kTemperature, "F", {5.0 / 9, -160.0 / 9}},
    KnownUnit{ValueKind::kTemperature,
              "\xC2\xB0"
              "F",
              {5.0 / 9, -160.0 / 9}},
    KnownUnit{ValueKind::kMass, "kg", {1, 0}},
    KnownUnit{ValueKind::kMass, "g", {1e-3, 0}},
    KnownUnit{ValueKind::kMass, "lb", {0.45359237, 0}},
    KnownUnit{ValueKind::kTime, "s", {1, 0}},
    KnownUnit{ValueKind::kTime, "ms", {1e-3, 0}},
    KnownUnit{ValueKind::kTime, "min", {60, 0}},
    KnownUnit{ValueKind::kTime, "h", {3600, 0}},
};

/// Words, in lower case and without punctuation, by which exports name a column.
struct KnownName {
  std::string_view words;
  std::string_view target;
};

constexpr std::array kKnownNames = {
    KnownName{"x", "x_mm"},
    KnownName{"y", "y_mm"},
    KnownName{"z", "z_mm"},
    KnownName{"mx coord", "x_mm"},
    KnownName{"my coord", "y_mm"},
    KnownName{"mz coord", "z_mm"},
    KnownName{"mx", "x_mm"},
    KnownName{"my", "y_mm"},
    KnownName{"mz", "z_mm"},
    KnownName{"x coord", "x_mm"},
    KnownName{"y coord", "y_mm"},
    KnownName{"z coord", "z_mm"},
    KnownName{"x actual", "x_mm"},
    KnownName{"y actual", "y_mm"},
    KnownName{"z actual", "z_mm"},
    KnownName{"x measured", "x_mm"},
    KnownName{"y measured", "y_mm"},
    KnownName{"z measured", "z_mm"},
    KnownName{"measured x", "x_mm"},
    KnownName{"measured y", "y_mm"},
    KnownName{"measured z", "z_mm"},
    KnownName{"meas x", "x_mm"},
    KnownName{"meas y", "y_mm"},
    KnownName{"meas z", "z_mm"},
    KnownName{"x meas", "x_mm"},
    KnownName{"y meas", "y_mm"},
    KnownName{"z meas", "z_mm"},
    KnownName{"x ist", "x_mm"},
    KnownName{"y ist", "y_mm"},
    KnownName{"z ist", "z_mm"},
    KnownName{"x1", "x_mm"},
    KnownName{"y1", "y_mm"},
    KnownName{"z1", "z_mm"},
    KnownName{"x t", "x_mm"},
    KnownName{"y t", "y_mm"},
    KnownName{"z t", "z_mm"},
    KnownName{"range", "range_mm"},
    KnownName{"distance", "range_mm"},
    KnownName{"dist", "range_mm"},
    KnownName{"gauge", "gauge_mm"},
    KnownName{"indicator", "gauge_mm"},
    KnownName{"u 95", "u95_mm"},
    KnownName{"u95", "u95_mm"},
    KnownName{"u 95 x", "u95_x_mm"},
    KnownName{"u 95 y", "u95_y_mm"},
    KnownName{"u 95 z", "u95_z_mm"},
    KnownName{"u95 x", "u95_x_mm"},
    KnownName{"u95 y", "u95_y_mm"},
    KnownName{"u95 z", "u95_z_mm"},
    KnownName{"sigma", "sigma_mm"},
    KnownName{"temperature", "temp_C"},
    KnownName{"temp", "temp_C"},
    KnownName{"temperatur", "temp_C"},
    KnownName{"payload", "payload_kg"},
    KnownName{"load", "payload_kg"},
    KnownName{"time", "t_s"},
    KnownName{"time stamp", "t_s"},
    KnownName{"timestamp", "t_s"},
    KnownName{"zeit", "t_s"},
    KnownName{"session", "session"},
    KnownName{"artefact", "artefact"},
    KnownName{"artifact", "artefact"},
    KnownName{"qw", "qw"},
    KnownName{"qx", "qx"},
    KnownName{"qy", "qy"},
    KnownName{"qz", "qz"},
    KnownName{"number", "number"},
    KnownName{"no", "number"},
    KnownName{"nr", "number"},
    KnownName{"index", "number"},
    KnownName{"id", "number"},
    KnownName{"pose", "number"},
    KnownName{"row", "number"},
    KnownName{"step order", "number"},
    KnownName{"point number", "number"},
    KnownName{"point no", "number"},
    KnownName{"punkt nr", "number"},
    KnownName{"punktnummer", "number"},
    KnownName{"messpunkt", "name"},
    KnownName{"punkt", "name"},
    KnownName{"pose number", "number"},
    KnownName{"point", "name"},
    KnownName{"point name", "name"},
    KnownName{"target", "name"},
    KnownName{"name", "name"},
    KnownName{"element name", "name"},
    KnownName{"delete", "delete"},
};

/// Splits "U(95) X  [mm]" into "u 95 x" and "mm"; a unit may also follow an underscore or stand in
/// parentheses.
struct NameAndUnit {
  std::string words, unit;
  std::optional<int> number{};  ///< of a joint, or of a part of a quaternion
};

std::string Words(std::string_view text) {
  std::string words;
  bool gap = false;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) == 0 && byte < 0x80) {
      gap = true;
      continue;
    }
    if (gap && !words.empty()) words += ' ';
    gap = false;
    words += static_cast<char>(std::tolower(byte));
  }
  return words;
}

std::vector<std::string_view> Split(std::string_view words) {
  std::vector<std::string_view> split;
  while (!words.empty()) {
    const std::size_t end = std::min(words.find(' '), words.size());
    split.push_back(words.substr(0, end));
    words.remove_prefix(std::min(end + 1, words.size()));
  }
  return split;
}

bool IsKnownUnit(std::string_view unit) {
  return std::ranges::any_of(kKnownUnits,
                             [&](const KnownUnit& known) { return known.name == unit; });
}

NameAndUnit Parted(std::string_view name) {
  for (const auto& [open, close] : {std::pair{'[', ']'}, std::pair{'(', ')'}}) {
    const auto begin = name.rfind(open);
    if (begin == std::string_view::npos || begin == 0 || name.back() != close) continue;
    const std::string_view unit = name.substr(begin + 1, name.size() - begin - 2);
    if (open == '[' || IsKnownUnit(unit)) return {Words(name.substr(0, begin)), std::string(unit)};
  }
  const auto last = name.find_last_of("_ ");
  if (last != std::string_view::npos && last > 0 && IsKnownUnit(name.substr(last + 1))) {
    return {Words(name.substr(0, last)), std::string(name.substr(last + 1))};
  }
  return {Words(name), ""};
}

/// The number in "joint 3", "j3", "a3", "axis 3", "q3", "theta 3", "achse 3".
std::optional<int> PlainJointNumber(std::string_view words) {
  for (const std::string_view prefix : {"joint", "axis", "achse", "theta", "j", "a", "q"}) {
    if (!words.starts_with(prefix)) continue;
    std::string_view digits = words.substr(prefix.size());
    if (digits.starts_with(' ')) digits.remove_prefix(1);
    if (digits.empty() || digits.size() > 2) continue;
    int number = 0;
    for (const char c : digits) {
      if (c < '0' || c > '9') return std::nullopt;
      number = 10 * number + (c - '0');
    }
    return number;
  }
  return std::nullopt;
}

/// A column that is named like a joint reading.
struct JointName {
  int number = 0;
  std::string_view arm{};  ///< first word of the name, if it may be that of an arm
};

/// True if a word says that a column is not a reading of a position: what was commanded, or another
/// quantity. Such a word is never the name of an arm.
bool NamesOther(std::string_view word) {
  constexpr std::string_view kOther =
      " target soll set setpoint command commanded cmd nominal desired goal planned "
      "reference ref sim torque moment drehmoment velocity vel speed qd acceleration "
      "geschwindigkeit current strom voltage power effort force friction error err "
      "fehler deviation delta diff difference residual offset min max limit status "
      "state mode brake stiffness motor ";
  const auto known = [word](const KnownName& name) { return name.words == word; };
  return kOther.find(" " + std::string(word) + " ") != std::string_view::npos ||
         std::ranges::any_of(kKnownNames, known);
}

/// Names that programs and robot descriptions give to a joint reading, too: "actual q 0" (RTDE),
/// "arm 3 joint", "panda joint3", "joint 3 position". nullopt where any word shows another
/// quantity, or what was commanded.
std::optional<JointName> JointNameOf(std::string_view words) {
  const auto plain = [](std::string_view name) {
    const auto number = PlainJointNumber(name);
    return number ? std::optional(JointName{*number}) : std::nullopt;
  };
  if (const auto name = plain(words)) return name;
  for (const std::string_view of_reading : {"actual ", "measured ", "ist "}) {
    if (words.starts_with(of_reading)) return plain(words.substr(of_reading.size()));
  }
  constexpr std::array<std::string_view, 4> kJoint = {"joint", "axis", "achse", "gelenk"};
  constexpr std::array<std::string_view, 6> kReading = {"actual",   "measured", "ist",
                                                        "position", "pos",      "angle"};
  std::optional<int> number;
  std::string_view arm;
  bool joint = false;
  for (const std::string_view word : Split(words)) {
    const std::size_t letters = std::min(word.find_first_of("0123456789"), word.size());
    const std::string_view name = word.substr(0, letters), digits = word.substr(letters);
    const bool numbered = !digits.empty() && digits.size() <= 2 &&
                          digits.find_first_not_of("0123456789") == std::string_view::npos;
    const bool is_joint = std::ranges::find(kJoint, name) != kJoint.end();
    joint |= is_joint;
    if (numbered && (is_joint || name.empty())) {
      if (number) return std::nullopt;
      number = std::stoi(std::string(digits));
    } else if (!is_joint && std::ranges::find(kReading, word) == kReading.end()) {
      if (word.data() != words.data() || NamesOther(word)) return std::nullopt;
      arm = word;
    }
  }
  return joint && number ? std::optional(JointName{*number, arm}) : std::nullopt;
}

/// True if the numbered columns are q0..q3 and nothing else: a quaternion.
bool HasQuaternion(const std::vector<NameAndUnit>& parts) {
  bool zero = false, three = false, more = false;
  for (const NameAndUnit& part : parts) {
    if (!part.words.starts_with("q")) continue;
    const auto name = JointNameOf(part.words);
    if (!name) continue;
    zero |= name->number == 0, three |= name->number == 3, more |= name->number > 3;
  }
  return zero && three && !more;
}

/// Numbers the columns of joints and quaternions. A first word is the name of an arm only if all
/// joints have it: beside joints without it, or with another one, it distinguishes readings.
void NumberColumns(bool quaternion, std::vector<NameAndUnit>& parts) {
  std::set<std::string_view> arms;
  for (const NameAndUnit& part : parts) {
    const auto name = JointNameOf(part.words);
    if (name && !(quaternion && part.words.starts_with("q"))) arms.insert(name->arm);
  }
  for (NameAndUnit& part : parts) {
    const auto name = JointNameOf(part.words);
    if (name && (name->arm.empty() || arms.size() == 1)) part.number = name->number;
  }
}

/// True if there are joints 0 and 1.
bool NumberedFromZero(const std::vector<NameAndUnit>& parts) {
  const auto has = [&parts](int number) {
    return std::ranges::any_of(parts,
                               [number](const NameAndUnit& part) { return part.number == number; });
  };
  return has(0) && has(1);
}

/// @param first  number of the first joint in the file
std::string TargetOf(const NameAndUnit& part, bool quaternion, int first) {
  if (part.number) {
    static constexpr std::array kParts = {"qw", "qx", "qy", "qz"};
    if (quaternion && part.words.starts_with("q") && *part.number <= 3) {
      return kParts[*part.number];
    }
    const int joint = *part.number + 1 - first;
    if (joint < 1 || joint > model::kMaxJoints) return "";
    const auto scale = ScaleOf(ValueKind::kLength, part.unit);
    return fmt::format("q{}_{}", joint, scale ? "mm" : "deg");
  }
  // "t" without a unit, or in degrees, may be a temperature.
  if (part.words == "t" && !part.unit.empty() && ScaleOf(ValueKind::kTime, part.unit)) return "t_s";
  for (const KnownName& known : kKnownNames) {
    if (part.words == known.words) return std::string(known.target);
  }
  return "";
}

}  // namespace

std::optional<UnitScale> ScaleOf(ValueKind kind, std::string_view unit) {
  for (const KnownUnit& known : kKnownUnits) {
    if (known.kind == kind && known.name == unit) return known.scale;
  }
  const bool has_usual = kind == ValueKind::kMass || kind == ValueKind::kTime;
  if (kind == ValueKind::kNumber || kind == ValueKind::kText) return UnitScale{};
  if (unit.empty() && has_usual) return UnitScale{};
  return std::nullopt;
}

std::string UnitsOf(ValueKind kind) {
  std::string units;
  for (const KnownUnit& known : kKnownUnits) {
    if (known.kind == kind && static_cast<unsigned char>(known.name[0]) < 0x80) {
      units += (units.empty() ? "" : ", ") + std::string(known.name);
    }
  }
  return units;
}

std::optional<ValueKind> KindOfTarget(std::string_view target) {
  static const std::map<std::string_view, ValueKind> kKinds = {
      {"x_mm", ValueKind::kLength},        {"y_mm", ValueKind::kLength},
      {"z_mm", ValueKind::kLength},        {"range_mm", ValueKind::kLength},
      {"gauge_mm", ValueKind::kLength},    {"sigma_mm", ValueKind::kLength},
      {"u95_mm", ValueKind::kLength},      {"u95_x_mm", ValueKind::kLength},
      {"u95_y_mm", ValueKind::kLength},    {"u95_z_mm", ValueKind::kLength},
      {"qw", ValueKind::kNumber},          {"qx", ValueKind::kNumber},
      {"qy", ValueKind::kNumber},          {"qz", ValueKind::kNumber},
      {"temp_C", ValueKind::kTemperature}, {"payload_kg", ValueKind::kMass},
      {"t_s", ValueKind::kTime},           {"session", ValueKind::kText},
      {"artefact", ValueKind::kText},      {"number", ValueKind::kText},
      {"name", ValueKind::kText},          {"delete", ValueKind::kText},
      {"camera", ValueKind::kText},        {"tool", ValueKind::kNumber},
      {"payload_item", ValueKind::kNumber}};
  if (const auto known = kKinds.find(target); known != kKinds.end()) return known->second;
  const auto joint = model::JointColumnFromName(target);
  if (!joint || joint->joint >= model::kMaxJoints ||
      joint->form->quantity != model::JointQuantity::kPosition) {
    return std::nullopt;
  }
  return joint->form->type == model::JointType::kRevolute ? ValueKind::kAngle : ValueKind::kLength;
}

std::vector<ColumnMeaning> MeaningsOf(const std::vector<std::string>& names,
                                      const std::vector<std::string>& units) {
  std::vector<NameAndUnit> parts;
  parts.reserve(names.size());
  for (const std::string& name : names) parts.push_back(Parted(name));
  const bool quaternion = HasQuaternion(parts);
  NumberColumns(quaternion, parts);
  const bool from_zero = !quaternion && NumberedFromZero(parts);
  std::vector<ColumnMeaning> meanings;
  for (std::size_t i = 0; i < names.size(); ++i) {
    ColumnMeaning& meaning = meanings.emplace_back();
    meaning.unit = parts[i].unit;
    if (meaning.unit.empty() && i < units.size()) meaning.unit = Parted(" " + units[i]).unit;
    if (meaning.unit.empty() && i < units.size()) meaning.unit = units[i];
    if (names[i].empty()) continue;
    meaning.target =
        TargetOf({parts[i].words, meaning.unit, parts[i].number}, quaternion, from_zero ? 0 : 1);
    // Exports use such words for other things, too: only the names of measured.csv itself count.
    if (names[i] == "camera" || names[i] == "tool" || names[i] == "payload_item")
      meaning.target = names[i];
    meaning.because =
        from_zero && parts[i].number ? "name; the joints are numbered from 0" : "name";
    if (quaternion && meaning.target.starts_with("q") && meaning.target.size() == 2) {
      meaning.because = "name; scalar first, as Leica writes it";
    }
    for (std::size_t k = 0; k < i; ++k) {
      if (meaning.target.empty() || meanings[k].target != meaning.target) continue;
      meaning.because = fmt::format("same meaning as column {}", k + 1);
      meaning.same_as = k;
      meaning.target.clear();
    }
  }
  return meanings;
}

}  // namespace plumbline::measure
