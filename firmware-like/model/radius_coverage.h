// Which share of the landings a stated radius contains, in words.
#pragma once

#include "firmware-like/model/radius_basis.h"

namespace plumbline::model {

/// "95 %, measured". A radius whose basis is unknown contains no known share: "basis unknown".
constexpr const char* CoverageText(RadiusBasis basis) {
  switch (basis) {
    case RadiusBasis::kUnknown:
      return "basis unknown";
    case RadiusBasis::kAssumed:
      return "95 %, assumed";
    case RadiusBasis::kPropagated:
      return "95 %, propagated";
    case RadiusBasis::kMeasured:
      return "95 %, measured";
  }
  return "basis unknown";
}

}  // namespace plumbline::model
