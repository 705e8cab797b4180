// A condition on rows: a range of a recorded signal, or one tool, artefact, session and so on.
#pragma once

#include <string>

namespace plumbline::measure {

/// Rows on one side of a value of a recorded signal, or with one name.
struct RowCondition {
  std::string column;
  std::string name;   ///< of the artefact, camera .., if `column` is one of these
  double limit = 0;   ///< in file units
  bool above = true;  ///< the rows from `limit` up, otherwise those from `limit` down
};

/// "payload_kg of 80 or more", "tool 2"
std::string TextOf(const RowCondition& condition);

}  // namespace plumbline::measure
