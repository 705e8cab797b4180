// Supports of effects: all single ones and pairs, triples of the best pairs, a beam beyond.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "app/diagnosis/search.h"

namespace plumbline {
namespace {

constexpr std::size_t kPairsForTriples = 24;  // triples grow from the best pairs
constexpr std::size_t kBeam = 4;
constexpr double kGainToGrow = 2;  // of the score, to go on beyond three effects

class Searching {
 public:
  Searching(Pool& pool, const Candidates& candidates, std::size_t most,
            const std::function<bool()>& interrupted)
      : pool_(pool), candidates_(candidates), most_(most), interrupted_(interrupted) {}

  std::vector<Explanation> Run();

 private:
  /// True where two moments stand so near that only a few rows lie between them: outliers, no
  /// event.
  bool HasShortStep(const std::vector<int>& support) const;
  /// True where two lines of one joint stand nearer than its range can tell apart.
  bool HasTwinLines(const std::vector<int>& support) const;
  /// Two exponentials are one with another time constant, or something else.
  bool HasTwoDrifts(const std::vector<int>& support) const {
    return std::count_if(support.begin(), support.end(), [this](int block) {
             return pool_.blocks()[static_cast<std::size_t>(block)].id == "thermal_drift";
           }) > 1;
  }
  bool Interrupted() const { return interrupted_ && interrupted_(); }
  /// Fits a support once; what elimination leaves is listed.
  void JudgeSupport(std::vector<int> support);
  void Grow(const Explanation& from);
  void NewShapes(const Explanation& from);
  std::vector<Explanation> Best(std::size_t count, std::size_t blocks) const;
  const Explanation& Winner() const {
    return *std::min_element(found_.begin(), found_.end(), Better);
  }
  static bool Better(const Explanation& a, const Explanation& b) { return a.score < b.score; }

  Pool& pool_;
  const Candidates& candidates_;
  std::size_t most_;
  const std::function<bool()>& interrupted_;
  std::vector<int> offered_;
  std::set<std::vector<int>> tried_;
  std::set<std::vector<int>> listed_;
  std::vector<Explanation> found_;
};

bool Searching::HasShortStep(const std::vector<int>& support) const {
  std::vector<double> moments;
  for (const int block : support) {
    const Block& of = pool_.blocks()[static_cast<std::size_t>(block)];
    if (BeginsAtAMoment(of.term)) moments.push_back(of.columns.front().values.front());
  }
  if (moments.size() < 2) return false;
  std::sort(moments.begin(), moments.end());
  const Dataset& data = pool_.problem().data();
  const int least = std::max(6, data.rows() / 10);
  for (std::size_t k = 1; k < moments.size(); ++k) {
    int between = 0;
    for (const int row : pool_.problem().rows()) {
      const Conditions& moment = data.conditions[static_cast<std::size_t>(row)];
      const double clock =
          data.table.recorded.time ? moment.t_s.value_or(0) : moment.row.value_or(0);
      between += clock >= moments[k - 1] && clock < moments[k] ? 1 : 0;
    }
    if (between < least) return true;
  }
  return false;
}

bool Searching::HasTwinLines(const std::vector<int>& support) const {
  constexpr double kLobes = 0.7;
  const Dataset& data = pool_.problem().data();
  std::vector<std::pair<int, double>> lines;
  for (const int block : support) {
    const Block& of = pool_.blocks()[static_cast<std::size_t>(block)];
    if (of.id == "gear_periodic") {
      lines.emplace_back(of.term.parameters.front().joint, of.columns.front().values[1]);
    }
  }
  for (std::size_t a = 0; a < lines.size(); ++a) {
    double low = 1e9, high = -1e9;
    for (const MeasuredRow& row : data.table.rows) {
      low = std::min(low, row.q[lines[a].first]);
      high = std::max(high, row.q[lines[a].first]);
    }
    const double lobe = 2 * std::numbers::pi / std::max(0.05, high - low);
    for (std::size_t b = a + 1; b < lines.size(); ++b) {
      const double apart = std::abs(lines[a].second - lines[b].second);
      const bool whole = lines[a].second == std::round(lines[a].second) &&
                         lines[b].second == std::round(lines[b].second);
      if (lines[a].first == lines[b].first && apart < kLobes * lobe && !whole) return true;
    }
  }
  return false;
}

void Searching::JudgeSupport(std::vector<int> support) {
  std::sort(support.begin(), support.end());
  support.erase(std::unique(support.begin(), support.end()), support.end());
  if (!tried_.insert(support).second) return;
  if (HasShortStep(support) || HasTwinLines(support) || HasTwoDrifts(support)) return;
  Explanation explanation = pool_.Evaluate(support);
  if (pool_.Absurd(explanation)) return;
  if (listed_.insert(explanation.columns).second) found_.push_back(std::move(explanation));
}

void Searching::Grow(const Explanation& from) {
  for (const int block : offered_) {
    std::vector<int> support = from.blocks;
    support.push_back(block);
    JudgeSupport(std::move(support));
    if (Interrupted()) return;
  }
}

void Searching::NewShapes(const Explanation& from) {
  for (const int block : AddShapes(pool_, candidates_.searched, pool_.Residual(from))) {
    if (std::find(offered_.begin(), offered_.end(), block) == offered_.end()) {
      offered_.push_back(block);
    }
    std::vector<int> support = from.blocks;
    support.push_back(block);
    JudgeSupport(std::move(support));
    JudgeSupport({block});
  }
}

std::vector<Explanation> Searching::Best(std::size_t count, std::size_t blocks) const {
  std::vector<Explanation> best;
  for (const Explanation& explanation : found_) {
    if (blocks == 0 || explanation.blocks.size() == blocks) best.push_back(explanation);
  }
  std::stable_sort(best.begin(), best.end(), Better);
  if (best.size() > count) best.resize(count);
  return best;
}

std::vector<Explanation> Searching::Run() {
  for (const Block& block : candidates_.blocks) {
    const int index = pool_.Add(block);
    if (pool_.Observable(index)) offered_.push_back(index);
  }
  JudgeSupport({});
  const Explanation nothing = found_.front();
  for (const int block : offered_) JudgeSupport({block});
  NewShapes(nothing);
  for (const Explanation& single : Best(3, 1)) NewShapes(single);
  // All pairs.
  for (std::size_t i = 0; i < offered_.size(); ++i) {
    for (std::size_t j = i + 1; j < offered_.size(); ++j) JudgeSupport({offered_[i], offered_[j]});
    if (Interrupted()) break;
  }
  for (const Explanation& pair : Best(2, 2)) NewShapes(pair);
  // Triples and more only where two effects beat one: otherwise there is nothing to explain.
  while (!Interrupted()) {
    const Explanation best = Winner();
    const std::size_t size = best.blocks.size();
    if (size < 2 || size >= most_) break;
    const std::size_t width = size == 2 ? kPairsForTriples : kBeam;
    const double before = best.score;
    NewShapes(best);
    for (const Explanation& from : Best(width, size)) Grow(from);
    if (!(Winner().score < before - kGainToGrow)) break;
  }
  return Best(kMostListed, 0);
}

}  // namespace

std::vector<Explanation> Search(Pool& pool, const Candidates& candidates, std::size_t most,
                                const std::function<bool()>& interrupted) {
  return Searching(pool, candidates, most, interrupted).Run();
}

}  // namespace plumbline
