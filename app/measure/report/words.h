// Columns, joints, parameters of effects and times in words, for readers of the report.
#pragma once

#include <string>
#include <string_view>

#include "app/measure/diagnosis/result/diagnosis.h"

namespace plumbline::measure {

/// "joint 5" for "q5" and "q5_deg", "speed of joint 5" for "qd5_deg_s", "time" for "t_s", "air
/// pressure" for "air_pressure_bar".
std::string ColumnInWords(std::string_view column);

/// A sentence with its joints, their parameters and recorded columns in words: "follows t_s"
/// becomes "follows time". Keys of the cell file remain, because these are what the reader has to
/// edit.
std::string InWords(std::string_view text, const Diagnosis& diagnosis);

/// "2026-11-21 07:30 UTC" for "2026-11-21T07:30:00Z".
std::string UtcInWords(const std::string& utc);

/// "joint 3, line 2, phase" for "q3_2_phase", "joint 3 of joint 2" for "q3_of_q2".
std::string ParameterInWords(std::string_view parameter);

}  // namespace plumbline::measure
