#include "app/measure/diagnosis/shapes/moment_search.h"

#include <algorithm>
#include <numeric>

#include "app/measure/diagnosis/linear/carried_columns.h"
#include "app/measure/diagnosis/shapes/shape_gain.h"
#include "firmware-like/effects/catalogue.h"

namespace plumbline::measure {
namespace {

using I = effects::Influence<double>;
enum { kTime, kRow, kFirstSize };  // parameters of these effects

/// t_s if recorded, otherwise the row number.
double ClockOf(const Dataset& data, const effects::Conditions& moment) {
  return data.table.recorded.time ? moment.t_s.value_or(0) : moment.row.value_or(0);
}

Eigen::VectorXd ClockAtRows(const LinearProblem& problem) {
  return SignalAtRows(
      problem, [&](const effects::Conditions& moment) { return ClockOf(problem.data(), moment); });
}

Eigen::MatrixXd From(double moment, const Eigen::VectorXd& clock) {
  return (clock.array() >= moment).cast<double>();
}

/// Whitened columns of carriers that act from the moment of a block on.
Eigen::MatrixXd ColumnsFromMoment(const LinearProblem& problem, const Block& block,
                                  const std::vector<int>& influences) {
  const double moment = block.columns.front().values.front();
  return problem.Carried(influences, From(moment, ClockAtRows(problem)));
}

/// Candidate event times halfway between successive rows, without the outermost twentieth.
std::vector<double> Moments(const LinearProblem& problem) {
  const Eigen::VectorXd at_rows = ClockAtRows(problem);
  std::vector<double> times(at_rows.begin(), at_rows.end());
  std::ranges::sort(times);
  times.erase(std::unique(times.begin(), times.end()), times.end());
  std::vector<double> moments;
  const std::size_t margin = std::max<std::size_t>(4, times.size() / 20);
  for (std::size_t k = margin; k + margin < times.size(); ++k)
    moments.push_back((times[k - 1] + times[k]) / 2);
  return moments;
}

/// Steps of some entries of the influence at each of the moments: what does not depend on the
/// residual.
class StepScan {
  static constexpr int kMaxSizes = 3;
  using Inverse = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxSizes, kMaxSizes>;
  using Sizes = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxSizes, 1>;

 public:
  StepScan(const LinearProblem& problem, const std::vector<double>& moments,
           const std::vector<int>& influences)
      : carried_(problem.CarriedBy(influences)), order_(carried_.rows().size()) {
    const Eigen::VectorXd at_rows = ClockAtRows(problem);
    const auto clock = [&](int position) { return at_rows[carried_.rows()[position].value()]; };
    std::iota(order_.begin(), order_.end(), 0);
    std::ranges::stable_sort(order_, [&](int a, int b) { return clock(a) < clock(b); });
    for (const double moment : moments) {
      const auto before = [&](int position, double t) { return clock(position) < t; };
      const auto first = std::lower_bound(order_.begin(), order_.end(), moment, before);
      from_.push_back(static_cast<int>(first - order_.begin()));
    }
    for (const Eigen::MatrixXd& gram : carried_.GramsOfSteps(order_, from_)) {
      inverses_.emplace_back(InverseForGain(gram));
    }
  }

  /// The step with the largest reduction of chi2.
  std::size_t Best(const Eigen::VectorXd& residual) const {
    const Eigen::MatrixXd along = carried_.Along(residual);
    Sizes sum = Sizes::Zero(along.cols());
    auto next = static_cast<int>(order_.size());
    double most = -1;
    std::size_t best = 0;
    for (std::size_t step = from_.size(); step-- > 0;) {
      while (next > from_[step]) sum += along.row(order_[--next]);
      const double gain = sum.dot(inverses_[step].lazyProduct(sum));
      if (!(gain >= most)) continue;
      most = gain;
      best = step;
    }
    return best;
  }

 private:
  const CarriedColumns& carried_;
  std::vector<int> order_;         ///< positions in the rows, by time
  std::vector<int> from_;          ///< position in `order_` of the first row after each moment
  std::vector<Inverse> inverses_;  ///< of the Gram matrix of each step
};

/// Block of an effect that acts from a moment on, with one column per size.
Block BlockFrom(const Dataset& data, const effects::Effect& effect, std::string_view word,
                double moment, double trials) {
  const effects::EffectTraits& traits = effect.traits();
  Block block;
  block.id = traits.id;
  block.term.effect = &effect;
  block.term.word = word;
  block.term.parameters = {{data.table.recorded.time ? kTime : kRow}};
  for (int spec = kFirstSize; spec < static_cast<int>(traits.parameters.size()); ++spec) {
    if (traits.parameters[spec].role != effects::ParameterRole::kSize) continue;
    BlockColumn& column = block.columns.emplace_back();
    column.parameter = static_cast<int>(block.term.parameters.size());
    column.plausible = PlausibleSizes(traits, spec);
    block.term.parameters.push_back({spec});
  }
  for (BlockColumn& column : block.columns) {
    column.values.assign(block.term.parameters.size(), 0.0);
    column.values.front() = moment;
  }
  block.trials = trials;
  return block;
}

/// True if too few rows are between two event times of the support.
bool MomentsTooClose(const LinearProblem& problem, std::span<const Block* const> support) {
  std::vector<double> moments;
  for (const Block* block : support) {
    if (ActsFromEventTime(block->term)) moments.push_back(block->columns.front().values.front());
  }
  if (moments.size() < 2) return false;
  std::ranges::sort(moments);
  const Dataset& data = problem.data();
  const int least = std::max(6, data.rows() / 10);
  for (std::size_t k = 1; k < moments.size(); ++k) {
    const auto within = [&](RowIndex row) {
      const double clock = ClockOf(data, data.conditions[row]);
      return clock >= moments[k - 1] && clock < moments[k];
    };
    const auto between = std::ranges::count_if(problem.rows(), within);
    if (between < least) return true;
  }
  return false;
}

/// Common part of the searches for an event time.
class MomentSearch : public ShapeSearch {
 public:
  explicit MomentSearch(const effects::Effect& effect) : effect_(effect) {}

  std::vector<Block> Refitted(const Dataset& data,
                              const effects::ActiveEffect& effect) const override {
    std::vector<Block> blocks;
    for (std::size_t k = 0; k < effect.values.size(); ++k) {
      if (effect.term.parameters[k].spec >= kFirstSize) continue;
      blocks.push_back(BlockFrom(data, effect_, effect.term.word, effect.values[k], data.rows()));
    }
    return blocks;
  }
  bool Excludes(const LinearProblem& problem,
                std::span<const Block* const> support) const override {
    return MomentsTooClose(problem, support);
  }
  /// True if no row of the problem lies between the given row and the moment.
  bool LeavesUndetermined(const LinearProblem& problem, const Block& block,
                          RowIndex row) const override {
    const Dataset& data = problem.data();
    const double moment = block.columns.front().values.front();
    const double clock = ClockOf(data, data.conditions[row]);
    return std::ranges::none_of(problem.rows(), [&](RowIndex other) {
      const double of_other = ClockOf(data, data.conditions[other]);
      return clock < moment ? of_other >= clock && of_other < moment
                            : of_other >= moment && of_other <= clock;
    });
  }

 protected:
  const effects::Effect& effect_;
};

/// Block of an effect that acts from the best of the moments on.
Block BestFrom(const LinearProblem& problem, const Eigen::VectorXd& residual,
               const std::vector<double>& moments, const effects::Effect& effect,
               std::string_view word, const std::vector<int>& influences) {
  const StepScan& scan = problem.Kept<StepScan>(
      influences.front(), [&] { return StepScan(problem, moments, influences); });
  return BlockFrom(problem.data(), effect, word, moments[scan.Best(residual)],
                   static_cast<double>(moments.size()));
}

class StepSearch final : public MomentSearch {
 public:
  StepSearch() : MomentSearch(*effects::FindEffect("step_event")) {}

  std::vector<Block> Propose(const LinearProblem& problem,
                             const Eigen::VectorXd& residual) const override {
    const std::vector<double> moments = Moments(problem);
    if (moments.empty()) return {};
    std::vector<Block> blocks;
    blocks.push_back(
        BestFrom(problem, residual, moments, effect_, "base", TranslationEntries(I::kBase)));
    blocks.push_back(
        BestFrom(problem, residual, moments, effect_, "tool", TranslationEntries(I::kTip)));
    return blocks;
  }

  std::optional<Eigen::MatrixXd> Columns(const LinearProblem& problem,
                                         const Block& block) const override {
    const bool tool = block.term.word == "tool";
    return ColumnsFromMoment(problem, block, TranslationEntries(tool ? I::kTip : I::kBase));
  }
};

class TiltSearch final : public MomentSearch {
 public:
  TiltSearch() : MomentSearch(*effects::FindEffect("tilt_event")) {}

  std::vector<Block> Propose(const LinearProblem& problem,
                             const Eigen::VectorXd& residual) const override {
    const std::vector<double> moments = Moments(problem);
    if (moments.empty()) return {};
    return {BestFrom(problem, residual, moments, effect_, "", TiltEntries())};
  }

  std::optional<Eigen::MatrixXd> Columns(const LinearProblem& problem,
                                         const Block& block) const override {
    return ColumnsFromMoment(problem, block, TiltEntries());
  }

 private:
  static std::vector<int> TiltEntries() { return {I::kBaseTilt, I::kBaseTilt + 1}; }
};

class ZoomSearch final : public MomentSearch {
 public:
  ZoomSearch() : MomentSearch(*effects::FindEffect("camera_zoom")) {}

  std::vector<Block> Fixed(const Dataset& data) const override {
    return {WholeBlock(data, effect_, "")};
  }

  std::vector<Block> Propose(const LinearProblem& problem,
                             const Eigen::VectorXd& residual) const override {
    const std::vector<double> moments = ZoomMoments(problem);
    const Eigen::VectorXd clock = ClockAtRows(problem);
    Found found;
    found.reserve(moments.size());
    for (const double moment : moments) {
      const auto columns = problem.Carried({I::kCameraDepth}, From(moment, clock));
      found.emplace_back(
          Gain(problem, columns, residual),
          BlockFrom(problem.data(), effect_, "", moment, static_cast<double>(moments.size())));
    }
    return Best(std::move(found), 1);
  }

 private:
  /// Times at which the camera may have been zoomed: changes of zoom_counts if recorded, otherwise
  /// all.
  static std::vector<double> ZoomMoments(const LinearProblem& problem) {
    constexpr std::string_view kColumn = "zoom_counts";
    if (!problem.data().conditions.front().Signal(kColumn)) return Moments(problem);
    const Eigen::VectorXd clock = ClockAtRows(problem);
    const Eigen::VectorXd zoom = SignalAtRows(
        problem, [&](const effects::Conditions& m) { return m.Signal(kColumn).value_or(0); });
    std::vector<std::pair<double, double>> rows;
    rows.reserve(clock.size());
    for (int j = 0; j < clock.size(); ++j) rows.emplace_back(clock[j], zoom[j]);
    std::ranges::sort(rows);
    std::vector<double> moments;
    for (std::size_t k = 1; k < rows.size(); ++k) {
      if (rows[k].second != rows[k - 1].second)
        moments.push_back((rows[k - 1].first + rows[k].first) / 2);
    }
    return moments;
  }
};

}  // namespace

const ShapeSearch& StepEventSearch() {
  static const StepSearch search;
  return search;
}

const ShapeSearch& TiltEventSearch() {
  static const TiltSearch search;
  return search;
}

const ShapeSearch& CameraZoomSearch() {
  static const ZoomSearch search;
  return search;
}

}  // namespace plumbline::measure
