#include "app/diagnosis/gross_errors.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "app/diagnosis/alignment.h"
#include "firmware-like/statistics/median.h"

namespace plumbline {
namespace {

// Farther than any effect moves the middle row, but for a known frame: a base turned by a degree or
// so, which base_frame still holds plausible, goes as far. It is asked about, not corrected.
constexpr double kGross_m = 0.025;
constexpr double kMended = 0.2;  // of the residual, that a mended mistake must fall below

double MiddleResidual(const Linearisation& linear) {
  std::vector<double> sizes;
  for (const LinearRow& row : linear.rows) sizes.push_back(row.residual.norm());
  return MedianOf(sizes);
}

double AfterMend(const Dataset& data, int threads, const std::function<void(JointVector&)>& mend) {
  Dataset mended = data;
  for (std::size_t k = 0; k < mended.table.rows.size(); ++k) {
    mend(mended.table.rows[k].q);
    mended.conditions[k].q = mended.table.rows[k].q;
  }
  const Result<Model> model = Aligned(mended, Model::Declared(mended), threads);
  if (!model) return 1e9;
  const Result<Linearisation> linear = Linearise(mended, *model, false, threads);
  return linear ? MiddleResidual(*linear) : 1e9;
}

}  // namespace

std::optional<std::string> GrossError(const Dataset& data, const Linearisation& aligned,
                                      int threads) {
  const double before = MiddleResidual(aligned);
  if (before < kGross_m) return std::nullopt;
  const std::string found =
      fmt::format("measured points lie {:.0f} mm from where the declared cell puts them (median)",
                  1e3 * before);
  const auto better = [&](double after) { return after < kMended * before; };
  constexpr double kDegPerRadian = 180 / std::numbers::pi;
  const std::vector<Joint>& joints = data.cell.robot.joints;
  const auto turns = [&](int i) {
    return joints[static_cast<std::size_t>(i)].type != JointType::kPrismatic;
  };
  const double as_radians = AfterMend(data, threads, [&](JointVector& q) {
    for (int i = 0; i < data.cell.robot.size(); ++i) {
      if (turns(i)) q[i] *= kDegPerRadian;
    }
  });
  if (better(as_radians)) {
    return fmt::format("{}; {:.2f} mm if the q columns hold radians: write degrees", found,
                       1e3 * as_radians);
  }
  for (int i = 0; i < data.cell.robot.size(); ++i) {
    const double after = AfterMend(data, threads, [i](JointVector& q) { q[i] = -q[i]; });
    if (better(after)) {
      return fmt::format(
          "{}; {:.2f} mm if joint q{} counts the other way: check its sign in the cell, "
          "or in the recording",
          found, 1e3 * after, i + 1);
    }
  }
  for (int i = 0; i < data.cell.robot.size(); ++i) {
    if (!turns(i)) continue;
    for (const double turn : {90.0, -90.0, 180.0}) {
      const double after =
          AfterMend(data, threads, [&](JointVector& q) { q[i] += turn / kDegPerRadian; });
      if (better(after)) {
        return fmt::format(
            "{}; {:.2f} mm if joint q{} is turned by {:.0f} deg: check theta_offset_deg", found,
            1e3 * after, i + 1, turn);
      }
    }
  }
  return fmt::format(
      "{}: no effect but a wrong frame does that; check the DH table, units (mm, deg), the frame "
      "(is "
      "it \"unaligned\"?) and that cell and data belong together",
      found);
}

}  // namespace plumbline
