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

/// The clock of event times: t_s, if recorded and running on from session to session; otherwise the
/// row number.
int ClockOf(const Dataset& data) {
  if (!data.table.recorded.time) return kRow;
  double latest_s = -HUGE_VAL;
  SessionIndex session;
  for (const RowIndex row : data.row_indices()) {
    const double t_s = data.conditions[row].t_s.value_or(0);
    if (data.session_of[row] != session && t_s < latest_s) return kRow;
    session = data.session_of[row];
    latest_s = std::max(latest_s, t_s);
  }
  return kTime;
}

double ReadingOf(int clock, const effects::Conditions& moment) {
  return (clock == kTime ? moment.t_s : moment.row).value_or(0);
}

/// The clock by which a block acts.
int ClockOf(const Block& block) {
  return block.term.parameters.front().spec;
}

bool HasHappened(const Block& block, const effects::Conditions& moment) {
  return ReadingOf(ClockOf(block), moment) >= block.columns.front().values.front();
}

Eigen::VectorXd ClockAtRows(const LinearProblem& problem, int clock) {
  return SignalAtRows(problem,
                      [&](const effects::Conditions& moment) { return ReadingOf(clock, moment); });
}

Eigen::MatrixXd From(double moment, const Eigen::VectorXd& clock) {
  return (clock.array() >= moment).cast<double>();
}

/// Whitened columns of carriers that act from the moment of a block on.
Eigen::MatrixXd ColumnsFromMoment(const LinearProblem& problem, const Block& block,
                                  const std::vector<int>& influences) {
  const double moment = block.columns.front().values.front();
  return problem.Carried(influences, From(moment, ClockAtRows(problem, ClockOf(block))));
}

/// Candidate event times.
struct Moments {
  std::vector<double> all;
  std::vector<std::size_t> between_sessions;  ///< those at which another session begins
};

/// The intervals of the clock between the last of some rows of a session and the first of the next.
template <typename Rows>
std::vector<model::Interval> Breaks(const Dataset& data, int clock, const Rows& rows) {
  std::vector<model::Interval> breaks;
  std::optional<RowIndex> last;
  for (const RowIndex row : rows) {
    if (last && data.session_of[row] != data.session_of[*last]) {
      breaks.push_back(
          {ReadingOf(clock, data.conditions[*last]), ReadingOf(clock, data.conditions[row])});
    }
    last = row;
  }
  return breaks;
}

/// Those among ascending times at which another session begins.
std::vector<std::size_t> BetweenSessions(const LinearProblem& problem,
                                         const std::vector<double>& moments) {
  const Dataset& data = problem.data();
  std::vector<std::size_t> between;
  for (const model::Interval& gap : Breaks(data, ClockOf(data), problem.rows())) {
    const auto after = std::ranges::upper_bound(moments, gap.low);
    if (after != moments.end() && *after < gap.high) between.push_back(after - moments.begin());
  }
  return between;
}

/// Number of event times among which a known one was searched.
double TrialsOf(const Dataset& data, int clock, double moment) {
  const auto breaks = Breaks(data, clock, data.row_indices());
  const bool between = std::ranges::any_of(breaks, [moment](const model::Interval& gap) {
    return moment > gap.low && moment < gap.high;
  });
  return between ? static_cast<double>(breaks.size()) : data.rows();
}

/// Event times halfway between successive rows, without the outermost twentieth.
Moments MomentsOf(const LinearProblem& problem) {
  const Eigen::VectorXd at_rows = ClockAtRows(problem, ClockOf(problem.data()));
  std::vector<double> times(at_rows.begin(), at_rows.end());
  std::ranges::sort(times);
  times.erase(std::unique(times.begin(), times.end()), times.end());
  std::vector<double> moments;
  const std::size_t margin = std::max<std::size_t>(4, times.size() / 20);
  for (std::size_t k = margin; k + margin < times.size(); ++k)
    moments.push_back((times[k - 1] + times[k]) / 2);
  return {moments, BetweenSessions(problem, moments)};
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
    const Eigen::VectorXd at_rows = ClockAtRows(problem, ClockOf(problem.data()));
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

  /// Reduction of chi2 of each step.
  std::vector<double> Gains(const Eigen::VectorXd& residual) const {
    const Eigen::MatrixXd along = carried_.Along(residual);
    Sizes sum = Sizes::Zero(along.cols());
    auto next = static_cast<int>(order_.size());
    std::vector<double> gains(from_.size());
    for (std::size_t step = from_.size(); step-- > 0;) {
      while (next > from_[step]) sum += along.row(order_[--next]);
      gains[step] = sum.dot(inverses_[step].lazyProduct(sum));
    }
    return gains;
  }

 private:
  const CarriedColumns& carried_;
  std::vector<int> order_;         ///< positions in the rows, by time
  std::vector<int> from_;          ///< position in `order_` of the first row after each moment
  std::vector<Inverse> inverses_;  ///< of the Gram matrix of each step
};

/// Block of an effect that acts from a moment on, with one column per size, or per size and joint.
Block BlockFrom(const Dataset& data, const effects::Effect& effect, std::string_view word,
                int clock, double moment, double trials) {
  const effects::EffectTraits& traits = effect.traits();
  Block block;
  block.id = traits.id;
  block.term.effect = &effect;
  block.term.word = word;
  block.term.prismatic = effects::PrismaticJoints(data.cell.robot);
  block.term.parameters = {{clock}};
  const auto add = [&](int spec, int joint) {
    BlockColumn& column = block.columns.emplace_back();
    column.unit = traits.per_joint ? block.columns.count() - 1 : 0;
    column.parameter = static_cast<int>(block.term.parameters.size());
    column.plausible = PlausibleSizes(traits, spec, {}, block.term.prismatic, joint);
    block.term.parameters.push_back({spec, joint});
  };
  for (int spec = kFirstSize; spec < static_cast<int>(traits.parameters.size()); ++spec) {
    if (traits.parameters[spec].role != effects::ParameterRole::kSize) continue;
    const int joints = traits.per_joint ? data.cell.robot.size() : 0;
    for (int joint = 0; joint < joints; ++joint) add(spec, joint);
    if (!traits.per_joint) add(spec, -1);
  }
  block.units = traits.per_joint ? block.columns.count() : 1;
  for (BlockColumn& column : block.columns) {
    column.values.assign(block.term.parameters.size(), 0.0);
    column.values.front() = moment;
  }
  block.trials = trials;
  return block;
}

/// True if too few rows are between two event times of the support.
bool MomentsTooClose(const LinearProblem& problem, std::span<const Block* const> support) {
  std::vector<const Block*> events;
  std::ranges::copy_if(support, std::back_inserter(events),
                       [](const Block* block) { return ActsFromEventTime(block->term); });
  const Dataset& data = problem.data();
  const int least = std::max(6, data.rows() / 10);
  for (std::size_t k = 0; k < events.size(); ++k) {
    for (std::size_t other = 0; other < k; ++other) {
      const auto between = std::ranges::count_if(problem.rows(), [&](RowIndex row) {
        const effects::Conditions& moment = data.conditions[row];
        return HasHappened(*events[k], moment) != HasHappened(*events[other], moment);
      });
      if (between < least) return true;
    }
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
      const int spec = effect.term.parameters[k].spec;
      if (spec >= kFirstSize) continue;
      blocks.push_back(BlockFrom(data, effect_, effect.term.word, spec, effect.values[k],
                                 TrialsOf(data, spec, effect.values[k])));
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
    const double clock = ReadingOf(ClockOf(block), data.conditions[row]);
    return std::ranges::none_of(problem.rows(), [&](RowIndex other) {
      const double of_other = ReadingOf(ClockOf(block), data.conditions[other]);
      return clock < moment ? of_other >= clock && of_other < moment
                            : of_other >= moment && of_other <= clock;
    });
  }

 protected:
  const effects::Effect& effect_;
};

/// Reduction of chi2 of a step of some entries of the influence at each of the moments.
std::vector<double> GainsAt(const LinearProblem& problem, const Eigen::VectorXd& residual,
                            const Moments& moments, const std::vector<int>& influences) {
  const StepScan& scan = problem.Kept<StepScan>(
      influences.front(), [&] { return StepScan(problem, moments.all, influences); });
  return scan.Gains(residual);
}

/// Blocks of an effect that acts from the best of all moments on, and from the best of those
/// between two sessions, when things are switched off, moved and exchanged.
std::vector<Block> BestFrom(const Dataset& data, const Moments& moments,
                            const std::vector<double>& gains, const effects::Effect& effect,
                            std::string_view word) {
  const auto block = [&](std::size_t moment, std::size_t trials) {
    return BlockFrom(data, effect, word, ClockOf(data), moments.all[moment],
                     static_cast<double>(trials));
  };
  const auto& between = moments.between_sessions;
  std::vector<Block> blocks;
  const auto of_gain = [&](std::size_t moment) { return gains[moment]; };
  if (!between.empty()) {
    const std::size_t best = *std::ranges::max_element(between, {}, of_gain);
    blocks.push_back(block(best, between.size()));
  }
  const auto best = static_cast<std::size_t>(std::ranges::max_element(gains) - gains.begin());
  if (std::ranges::find(between, best) == between.end())
    blocks.push_back(block(best, gains.size()));
  return blocks;
}

class StepSearch final : public MomentSearch {
 public:
  StepSearch() : MomentSearch(*effects::FindEffect("step_event")) {}

  std::vector<Block> Propose(const LinearProblem& problem,
                             const Eigen::VectorXd& residual) const override {
    const Moments moments = MomentsOf(problem);
    std::vector<Block> blocks;
    for (const auto& [word, entry] : {std::pair("base", I::kBase), std::pair("tool", I::kTip)}) {
      if (moments.all.empty()) break;
      const auto gains = GainsAt(problem, residual, moments, TranslationEntries(entry));
      for (Block& block : BestFrom(problem.data(), moments, gains, effect_, word))
        blocks.push_back(std::move(block));
    }
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
    const Moments moments = MomentsOf(problem);
    if (moments.all.empty()) return {};
    const auto gains = GainsAt(problem, residual, moments, TiltEntries());
    return BestFrom(problem.data(), moments, gains, effect_, "");
  }

  std::optional<Eigen::MatrixXd> Columns(const LinearProblem& problem,
                                         const Block& block) const override {
    return ColumnsFromMoment(problem, block, TiltEntries());
  }

 private:
  static std::vector<int> TiltEntries() { return {I::kBaseTilt, I::kBaseTilt + 1}; }
};

class OffsetSearch final : public MomentSearch {
 public:
  OffsetSearch() : MomentSearch(*effects::FindEffect("offset_event")) {}

  /// All joints from the moment at which one of them gains most.
  std::vector<Block> Propose(const LinearProblem& problem,
                             const Eigen::VectorXd& residual) const override {
    const Moments moments = MomentsOf(problem);
    if (moments.all.empty()) return {};
    std::vector<double> largest(moments.all.size(), 0.0);
    for (int joint = 0; joint < problem.data().cell.robot.size(); ++joint) {
      const auto gains = GainsAt(problem, residual, moments, {EntryOf(joint)});
      std::ranges::transform(largest, gains, largest.begin(),
                             [](double a, double b) { return std::max(a, b); });
    }
    return BestFrom(problem.data(), moments, largest, effect_, "");
  }

  std::optional<Eigen::MatrixXd> Columns(const LinearProblem& problem,
                                         const Block& block) const override {
    std::vector<int> entries;
    for (const BlockColumn& column : block.columns)
      entries.push_back(EntryOf(block.term.parameters[column.parameter].joint));
    return ColumnsFromMoment(problem, block, entries);
  }

 private:
  static int EntryOf(int joint) { return I::kTurn * model::kMaxJoints + joint; }
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
    const int clock = ClockOf(problem.data());
    const Eigen::VectorXd at_rows = ClockAtRows(problem, clock);
    Found found;
    found.reserve(moments.size());
    for (const double moment : moments) {
      const auto columns = problem.Carried({I::kCameraDepth}, From(moment, at_rows));
      found.emplace_back(Gain(problem, columns, residual),
                         BlockFrom(problem.data(), effect_, "", clock, moment,
                                   static_cast<double>(moments.size())));
    }
    return Best(std::move(found), 1);
  }

 private:
  /// Times at which the camera may have been zoomed: changes of zoom_counts if recorded, otherwise
  /// all.
  static std::vector<double> ZoomMoments(const LinearProblem& problem) {
    constexpr std::string_view kColumn = "zoom_counts";
    if (!problem.data().conditions.front().Signal(kColumn)) return MomentsOf(problem).all;
    const Eigen::VectorXd clock = ClockAtRows(problem, ClockOf(problem.data()));
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

const ShapeSearch& OffsetEventSearch() {
  static const OffsetSearch search;
  return search;
}

const ShapeSearch& CameraZoomSearch() {
  static const ZoomSearch search;
  return search;
}

}  // namespace plumbline::measure
