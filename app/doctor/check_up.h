// What the doctor found at one place of the installation.
#pragma once

#include <string>
#include <vector>

namespace plumbline {

enum class Health {
  kGood,
  kNotLooked,  ///< not configured, or not to be seen from here
  kWarning,    ///< works, but not for long, or not as well as it could
  kFault,      ///< does not work
};

inline const char* HealthText(Health health) {
  return health == Health::kGood        ? "good"
         : health == Health::kNotLooked ? "-"
         : health == Health::kWarning   ? "warning"
                                        : "FAULT";
}

struct CheckedThing {
  Health health = Health::kGood;
  std::string what;    ///< "state directory"
  std::string told;    ///< what is so: "/var/lib/plumbline, 12.3 GiB free"
  std::string remedy;  ///< what to do; empty where nothing is
};

using CheckUp = std::vector<CheckedThing>;

}  // namespace plumbline
