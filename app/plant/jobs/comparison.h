// Comparison of two versions of the diagnosis on the same rows of every cell.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/plant/jobs/cell_work.h"

namespace plumbline::plant {

/// Error of rows that took part neither in choosing nor in fitting, by the split that both report
/// and that is hardest for the old version.
struct HeldOutPair {
  std::string by;  ///< how the rows were split
  double old_mm = 0, new_mm = 0;
  /// Standard deviation of log(new / old), from the 95 % intervals of both, taken as
  /// independent. The rows are the same, so that the errors move together, and the difference is
  /// more certain than this.
  double log_sd = 0;
};

/// Answers of both versions for one cell.
struct CellComparison {
  enum class Change {
    kEqual,         ///< within the uncertainty
    kBetter,        ///< clearly
    kWorse,         ///< clearly
    kRefused,       ///< the new version gives no answer, the old one did: worse
    kAnswers,       ///< the other way round: better
    kNotComparable  ///< neither answers, the rows differ, or nothing could be held out
  };
  std::string cell;
  Change change = Change::kNotComparable;
  std::optional<HeldOutPair> error;
  std::string verdict_old, verdict_new;
  std::vector<std::string> effects_old, effects_new;  ///< "joint_compliance q2 q3"
  std::string reason;                                 ///< why not comparable, or refused
  bool found_differs() const { return verdict_old != verdict_new || effects_old != effects_new; }
};

/// A change is clear if log(new / old) is beyond 1.96 of its standard deviations (see
/// HeldOutPair) and beyond kLeastChange. Pure; answers are those of `plumbline diagnose --json`,
/// whatever they contain.
inline constexpr double kLeastChange = 0.05;
CellComparison CompareAnswers(const std::string& cell, const JobAnswer& old_answer,
                              const JobAnswer& new_answer);

/// All cells. Small changes that no cell shows clearly by itself add up over the plant.
struct PlantComparison {
  std::vector<CellComparison> cells;
  int better = 0, equal = 0, worse = 0, not_comparable = 0;
  int changed_findings = 0;
  /// Geometric mean of new / old over the cells that have both, and its 95 % interval from the
  /// scatter between the cells (Student's t); absent with fewer than three cells.
  std::optional<double> ratio, ratio_low, ratio_high;
  /// A cell is clearly worse, or the plant as a whole by more than kLeastPlantChange.
  bool IsWorse() const;
};
inline constexpr double kLeastPlantChange = 0.01;
PlantComparison CompareCells(std::vector<CellComparison> cells);

/// Counts, the worst cells, and findings that changed, as a table for the terminal.
std::string ComparisonText(const PlantComparison& comparison);
nlohmann::ordered_json ComparisonJson(const PlantComparison& comparison);

}  // namespace plumbline::plant
