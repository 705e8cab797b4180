#include "firmware-like/effects/empirical.h"

#include <cmath>

namespace plumbline {
namespace {

/// Where a value lies between the rows of the nodes: in row `below` with weight 1 - part, in the
/// next with weight part.
struct Place {
  Eigen::Index below = 0;
  double part = 0;
};

Place PlaceOf(double driver, const Eigen::MatrixXd& nodes) {
  Place place;
  for (Eigen::Index above = nodes.rows(); above - place.below > 1;) {  // halved until one is left
    const Eigen::Index middle = (place.below + above) / 2;
    (nodes(middle, 0) <= driver ? place.below : above) = middle;
  }
  const bool last = place.below + 1 == nodes.rows();
  if (last || driver <= nodes(place.below, 0)) return place;
  const double low = nodes(place.below, 0), high = nodes(place.below + 1, 0);
  place.part = (driver - low) / (high - low);
  return place;
}

struct EmpiricalFormula {
  enum Parameter { kBaseX, kTipX = kBaseX + 3, kTurn = kTipX + 3, kToolBending };

  static EffectTraits Traits() {
    constexpr Interval kFactor{0, 2};
    return {.id = "empirical",
            .meaning = "the error follows a recorded signal, by no catalogued physics",
            .remedy = "find out what the signal stands for; corrected only where there is data",
            .parameters = {{"base_x", "1", 1, kFactor},
                           {"base_y", "1", 1, kFactor},
                           {"base_z", "1", 1, kFactor},
                           {"tip_x", "1", 1, kFactor},
                           {"tip_y", "1", 1, kFactor},
                           {"tip_z", "1", 1, kFactor},
                           {"q#", "1", 1, kFactor},
                           {"tool_bending", "1", 1, kFactor}},
            .needs = {},
            .confused_with = {},
            .name = "an empirical term",
            .empirical = true};
  }

  template <typename T>
  static T& Carrier(const TermParameter& parameter, Influence<T>& influence) {
    if (parameter.spec == kTurn) return influence.Joint(Influence<T>::kTurn, parameter.joint);
    if (parameter.spec == kToolBending) return influence[Influence<T>::kBendRatio];
    if (parameter.spec < kTipX) return influence[Influence<T>::kBase + parameter.spec];
    return influence[Influence<T>::kTip + parameter.spec - kTipX];
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (term.drivers.empty() || term.nodes.rows() == 0) return;
    const std::optional<double> driver = conditions.Signal(term.drivers.front());
    if (!driver || std::isnan(*driver)) return;
    const Place place = PlaceOf(*driver, term.nodes);
    for (std::size_t k = 0; k < values.size(); ++k) {
      const auto column = static_cast<Eigen::Index>(k) + 1;
      double node = term.nodes(place.below, column);
      if (place.part > 0) node += place.part * (term.nodes(place.below + 1, column) - node);
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
  return parameter.spec < EmpiricalFormula::kTurn ? 1e-3 : 1.0;
}

std::string EmpiricalFault(const std::vector<std::string>& drivers, const Eigen::MatrixXd& nodes,
                           std::size_t parameters) {
  if (drivers.size() != 1) return "needs exactly one driver, the name of a recorded column";
  if (nodes.rows() == 0)
    return "needs nodes: rows of the driver's value and one number a parameter";
  if (nodes.cols() != static_cast<Eigen::Index>(parameters) + 1) {
    return "needs in each row of nodes the driver's value and one number a parameter, " +
           std::to_string(parameters + 1) + " in all";
  }
  for (Eigen::Index row = 1; row < nodes.rows(); ++row) {
    if (!(nodes(row, 0) > nodes(row - 1, 0))) {
      return "needs nodes whose first column rises; row " + std::to_string(row + 1) + " does not";
    }
  }
  return {};
}

}  // namespace plumbline
