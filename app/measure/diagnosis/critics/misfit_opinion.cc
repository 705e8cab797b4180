// What the critic of rows with a common condition says about them.
#include <fmt/format.h>

#include <algorithm>

#include "app/measure/diagnosis/critics/misfit.h"
#include "app/measure/diagnosis/linear/robust.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"

namespace plumbline::measure {
namespace {

/// Sizes of the residuals, divided by the median size under unit noise so that rows with different
/// numbers of residuals can be compared.
PerRow<double> SizesOf(const Dataset& data, const FitOfAllRows& fit) {
  const PerRow<RowResidual> residuals = ResidualsOf(fit.linear);
  PerRow<double> sizes;
  for (const RowIndex row : data.row_indices())
    sizes.push_back(SizeOf(data.numbers[row], residuals[row]) /
                    MedianOfChi(std::max(1, data.numbers[row].count)));
  return sizes;
}

/// What rows under a condition that were rejected may have in common, and what to do.
const char* WordsOf(const RowCondition& condition) {
  if (condition.column == "artefact")
    return "it may have moved, or it is loose; fasten it and measure again";
  if (condition.column == "camera")
    return "it may have moved, or its lens or tags are wrong; calibrate it again and measure more "
           "rows with it";
  if (condition.column == "tool")
    return "its tip, its stiffness or its mount may be wrong; measure its TCP again";
  if (condition.column == "payload_item")
    return "its mass or its centre of gravity may be wrong; weigh it";
  if (condition.column == "session")
    return "the instrument, its frame or the tool may have changed; check what differs there";
  if (condition.column == "kind")
    return "these rows contradict the others; check the instrument that measured them, its frame "
           "and the tool";
  return "an effect acts only there, or the noise is larger there. Measure more rows there to "
         "distinguish these; if it is noise, state that of each row in the column sigma_mm";
}

/// True if a condition holds for some rows, but not for more than half of them.
bool LeavesMostRows(const Dataset& data, const RowCondition& condition) {
  const IndexRange<RowIndex> rows = data.row_indices();
  const auto meeting =
      std::ranges::count_if(rows, [&](RowIndex row) { return Meets(condition, data, row); });
  return meeting > 0 && 2 * meeting <= data.rows();
}

/// "lines 12 to 40": where rows are in the file.
std::string LinesText(const Dataset& data, const LargerResiduals& rows) {
  return fmt::format("lines {} to {}", data.measured(rows.first).line,
                     data.measured(rows.last).line);
}

/// Note on residuals that are larger under a condition.
std::string NoteOf(const Dataset& data, const LargerUnderCondition& larger, const Misfit& misfit) {
  const std::string text = fmt::format(
      "residuals of the {} poses with {} are {:.1f} times as large as those of the other "
      "{} (medians)",
      larger.poses, TextOf(larger.condition), larger.ratio, larger.of_poses - larger.poses);
  if (misfit.certain) return text + ": " + WordsOf(larger.condition);
  return fmt::format(
      "{}, but they were measured in only {} of time, within {}: a disturbance of the instrument "
      "then would do the same.{} Measure some of them again at another time",
      text, larger.stretches == 1 ? "one stretch" : "two stretches", LinesText(data, larger),
      misfit.outside_domain ? " Such points are outside [domain]." : "");
}

/// Larger residuals under a condition, or for a while, whichever chance explains less.
Opinion OpinionOnLargerResiduals(const Dataset& data, const FitOfAllRows& fit) {
  Opinion opinion;
  const PerRow<double> sizes = SizesOf(data, fit);
  const auto larger = FindLargerUnderCondition(data, sizes);
  const auto briefly = FindLargerForAWhile(data, sizes);
  if (larger && !(briefly && briefly->p_value < larger->p_value)) {
    const bool certain = !data.table.recorded.order || larger->stretches >= kMinStretches;
    opinion.misfit = {larger->condition, true, certain, LeavesMostRows(data, larger->condition)};
    opinion.notes.push_back(NoteOf(data, *larger, *opinion.misfit));
  } else if (briefly) {
    opinion.notes.push_back(fmt::format(
        "residuals of {} successive poses ({}) are {:.1f} times as large as those of the other {} "
        "(medians): the instrument or the arm was disturbed then, or these poses have in common "
        "what the model does not fit. The radius does not cover such errors; find out what "
        "happened, and measure these poses again",
        briefly->poses, LinesText(data, *briefly), briefly->ratio,
        briefly->of_poses - briefly->poses));
  }
  return opinion;
}

/// Rows under a condition that were rejected.
Opinion OpinionOnRejected(const Dataset& data, const OutlierCondition& found) {
  Opinion opinion;
  opinion.misfit = {found.condition, false, true, LeavesMostRows(data, found.condition)};
  opinion.notes.push_back(fmt::format("{} of the {} rows with {} are rejected as outliers: {}",
                                      found.rejected, found.rows, TextOf(found.condition),
                                      WordsOf(found.condition)));
  return opinion;
}

}  // namespace

Opinion OpinionOnMisfit(const Identified& identified, const FitOfAllRows& fit) {
  const Dataset& data = fit.problem.data;
  const bool searched_all = identified.fit.data.rows() == data.rows();
  const std::vector<RowQuantity> loads =
      searched_all ? GravityLoadsAt(data, *identified.linear) : std::vector<RowQuantity>();
  const auto found = ConditionOfOutliers(data, fit.problem.weights, loads);
  Opinion opinion = found ? OpinionOnRejected(data, *found) : OpinionOnLargerResiduals(data, fit);
  if (!opinion.misfit || !opinion.misfit->certain) return opinion;
  opinion.drivers = {DriverOf(opinion.misfit->condition.column)};
  opinion.permits = Verdict::kUnknown;
  return opinion;
}

}  // namespace plumbline::measure
