// Result of one check of the installation: health, finding and remedy.
#pragma once

#include <string>
#include <vector>

namespace plumbline::cli {

enum class Health {
  kGood,
  kNotChecked,  ///< not configured, or not observable from here
  kWarning,     ///< works, but not for long or not as well as it could
  kFault,       ///< does not work
};

inline const char* HealthText(Health health) {
  return health == Health::kGood         ? "good"
         : health == Health::kNotChecked ? "-"
         : health == Health::kWarning    ? "warning"
                                         : "FAULT";
}

struct CheckResult {
  Health health = Health::kGood;
  std::string subject;  ///< "state directory"
  std::string finding;  ///< "/var/lib/plumbline, 12.3 GiB free"
  std::string remedy;   ///< what to do; empty if nothing
};

using CheckResults = std::vector<CheckResult>;

}  // namespace plumbline::cli
