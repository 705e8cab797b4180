// Header of a table: the columns of the format, and which of them a file has.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/base/config/fault.h"
#include "app/measure/table/csv.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::measure {

/// Columns of a table: the format has about 60 for the largest robot; the others are signals of the
/// user's own. A row takes memory for each.
inline constexpr int kMaxColumns = 256;

enum class Quantity {
  kSession,
  kTime,
  kQ,
  kQd,
  kQdd,
  kTau,
  kPayload,
  kTool,
  kPayloadItem,
  kTemperature,
  kPosition,
  kRange,
  kOrientation,
  kJointStep,
  kArtefact,
  kGauge,
  kSigma,
  kCamera,
  kFurther,
  kUnused,
};

/// Meaning of a column: its quantity, component and factor to SI.
struct Column {
  std::string name;
  Quantity quantity = Quantity::kUnused;
  int index = 0;
  double to_si = 1;
};

/// The columns of a file, in its order.
struct TableHeader {
  std::vector<Column> columns;
  RecordedColumns recorded;
  std::vector<std::string> further;  ///< names of columns that are not part of the format
};

/// Reads a header line. All faults are reported: a missing column of a joint or of an incomplete
/// group, a column twice, a column of a joint that the cell lacks. A column that is not part of the
/// format becomes an additional signal, with a warning.
/// @return  nullopt if there is a fault
std::optional<TableHeader> HeaderFromCsv(std::string_view line, const std::string& file,
                                         const std::vector<model::Joint>& joints,
                                         config::FaultList& faults);

}  // namespace plumbline::measure
