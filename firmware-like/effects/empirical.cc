#include "firmware-like/effects/empirical.h"

#include <array>
#include <cmath>
#include <optional>

namespace plumbline::effects {
namespace {

/// Position of a value in an ascending sequence: element `below` has weight 1 - part, the next one
/// weight part.
struct Place {
  Eigen::Index below = 0;
  double part = 0;
};

/// @param stride  number of rows between consecutive values
Place PlaceOf(double driver, const Eigen::MatrixXd& nodes, Eigen::Index column, Eigen::Index count,
              Eigen::Index stride) {
  const auto at = [&](Eigen::Index k) { return nodes(k * stride, column); };
  Place place;
  for (Eigen::Index above = count; above - place.below > 1;) {  // bisection
    const Eigen::Index middle = (place.below + above) / 2;
    (at(middle) <= driver ? place.below : above) = middle;
  }
  const bool last = place.below + 1 == count;
  if (last || driver <= at(place.below)) return place;
  const double low = at(place.below), high = at(place.below + 1);
  place.part = (driver - low) / (high - low);
  return place;
}

/// Number of rows with the same value of the first driver: 1 for one driver; for two, the number of
/// values of the second driver.
Eigen::Index GroupSize(const Eigen::MatrixXd& nodes) {
  Eigen::Index size = 1;
  while (size < nodes.rows() && nodes(size, 0) == nodes(0, 0)) ++size;
  return size;
}

/// The nodes used for interpolation, with weights that sum to 1.
struct Around {
  std::array<Eigen::Index, 4> node{};
  std::array<double, 4> weight{};
  std::size_t count = 0;

  void Add(Eigen::Index at, double share) {
    if (share <= 0) return;
    node[count] = at;
    weight[count++] = share;
  }
};

/// nullopt if a driver is unknown.
std::optional<Around> NodesAround(const EffectTerm& term, const Conditions& conditions) {
  std::array<double, 2> value{};
  for (std::size_t k = 0; k < term.drivers.size(); ++k) {
    const std::optional<double> driver = conditions.Signal(term.drivers[k]);
    if (!driver || std::isnan(*driver)) return std::nullopt;
    value[k] = *driver;
  }
  const Eigen::Index group = term.drivers.size() == 2 ? GroupSize(term.nodes) : 1;
  const Place first = PlaceOf(value[0], term.nodes, 0, term.nodes.rows() / group, group);
  Place second;
  if (term.drivers.size() == 2) second = PlaceOf(value[1], term.nodes, 1, group, 1);
  Around around;
  const Eigen::Index at = first.below * group + second.below;
  around.Add(at, (1 - first.part) * (1 - second.part));
  around.Add(at + 1, (1 - first.part) * second.part);
  around.Add(at + group, first.part * (1 - second.part));
  around.Add(at + group + 1, first.part * second.part);
  return around;
}

struct EmpiricalFormula {
  enum Parameter {
    kBaseX,
    kTipX = kBaseX + 3,
    kTurn = kTipX + 3,
    kToolBending,
    kLengthA,
    kOffsetD,
    kTiltX
  };

  static EffectTraits Traits() {
    constexpr model::Interval kFactor{0, 2};
    return {
        .id = "empirical",
        .meaning = "the error follows a recorded signal, without a known physical cause",
        .remedy =
            "find the physical cause behind the signal; the correction is valid only where there "
            "is data",
        .parameters = {{"base_x", "1", 1, kFactor},
                       {"base_y", "1", 1, kFactor},
                       {"base_z", "1", 1, kFactor},
                       {"tip_x", "1", 1, kFactor},
                       {"tip_y", "1", 1, kFactor},
                       {"tip_z", "1", 1, kFactor},
                       {"q#", "1", 1, kFactor},
                       {"tool_bending", "1", 1, kFactor},
                       {"a#", "1", 1, kFactor},
                       {"d#", "1", 1, kFactor},
                       {"tilt_x", "1", 1, kFactor},
                       {"tilt_y", "1", 1, kFactor}},
        .needs = {},
        .confused_with = {},
        .name = "an empirical term",
        .empirical = true};
  }

  template <typename T>
  static T& Carrier(const TermParameter& parameter, Influence<T>& influence) {
    if (parameter.spec == kTurn) return influence.Joint(Influence<T>::kTurn, parameter.joint);
    if (parameter.spec == kToolBending) return influence[Influence<T>::kBendRatio];
    if (parameter.spec == kLengthA) return influence.Joint(Influence<T>::kLengthA, parameter.joint);
    if (parameter.spec == kOffsetD) return influence.Joint(Influence<T>::kOffsetD, parameter.joint);
    if (parameter.spec >= kTiltX)
      return influence[Influence<T>::kBaseTilt + parameter.spec - kTiltX];
    if (parameter.spec < kTipX) return influence[Influence<T>::kBase + parameter.spec];
    return influence[Influence<T>::kTip + parameter.spec - kTipX];
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (term.drivers.empty() || term.drivers.size() > 2 || term.nodes.rows() == 0) return;
    const std::optional<Around> around = NodesAround(term, conditions);
    if (!around) return;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const auto column = static_cast<Eigen::Index>(k + term.drivers.size());
      double node = 0;
      for (std::size_t i = 0; i < around->count; ++i) {
        node += around->weight[i] * term.nodes(around->node[i], column);
      }
      const double to_SI = EmpiricalNodeToSI(term.parameters[k]);
      Carrier(term.parameters[k], influence) += values[k] * (to_SI * node);
    }
  }
};

}  // namespace

const Effect& Empirical() {
  static const EffectOf<EmpiricalFormula> effect;
  return effect;
}

double EmpiricalNodeToSI(const TermParameter& parameter) {
  using Formula = EmpiricalFormula;
  const bool of_link = parameter.spec >= Formula::kLengthA && parameter.spec < Formula::kTiltX;
  const bool length = parameter.spec < Formula::kTurn || of_link;
  return length ? 1e-3 : 1.0;
}

std::string EmpiricalFault(const std::vector<std::string>& drivers, const Eigen::MatrixXd& nodes,
                           std::size_t parameters) {
  if (drivers.empty() || drivers.size() > 2)
    return "needs one or two drivers, the names of recorded columns";
  if (nodes.rows() == 0)
    return "needs nodes: rows of the drivers' values and one number a parameter";
  if (nodes.cols() != static_cast<Eigen::Index>(parameters + drivers.size())) {
    return "needs in each row of nodes the drivers' values and one number a parameter, " +
           std::to_string(parameters + drivers.size()) + " in all";
  }
  const Eigen::Index group = drivers.size() == 2 ? GroupSize(nodes) : 1;
  if (nodes.rows() % group != 0) {
    return "needs nodes on a full grid: every value of the first driver with the same " +
           std::to_string(group) + " values of the second";
  }
  for (Eigen::Index row = 1; row < nodes.rows(); ++row) {
    const std::string place = "; row " + std::to_string(row + 1) + " does not";
    const bool new_group = row % group == 0;
    if (new_group ? !(nodes(row, 0) > nodes(row - 1, 0)) : nodes(row, 0) != nodes(row - 1, 0)) {
      return group == 1 ? "needs nodes whose first column rises" + place
                        : "needs nodes whose first column rises from group to group" + place;
    }
    if (group == 1 || row < group) {
      if (!new_group && !(nodes(row, 1) > nodes(row - 1, 1)))
        return "needs nodes whose second driver rises within a group" + place;
    } else if (nodes(row, 1) != nodes(row - group, 1)) {
      return "needs the same values of the second driver in every group" + place;
    }
  }
  return {};
}

}  // namespace plumbline::effects
