#include "app/measure/diagnosis/search/search.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <queue>
#include <set>

#include "app/measure/diagnosis/linear/shape_search.h"
#include "app/measure/diagnosis/search/explained_effects.h"

namespace plumbline::measure {

namespace {

/// Adds blocks; returns the observable ones.
std::vector<BlockIndex> AddObservable(CandidateSet& candidate_set,
                                      const std::vector<Block>& blocks) {
  std::vector<BlockIndex> indices = candidate_set.Add(blocks);
  std::erase_if(indices, [&](BlockIndex index) { return !candidate_set.Observable(index); });
  return indices;
}

}  // namespace

std::vector<BlockIndex> AddShapes(CandidateSet& candidate_set,
                                  const std::vector<const effects::Effect*>& searched,
                                  const Eigen::VectorXd& residual) {
  std::vector<Block> proposed;
  for (const effects::Effect* effect : searched) {
    for (Block& block : ShapeSearchOf(*effect)->Propose(candidate_set.problem(), residual)) {
      proposed.push_back(std::move(block));
    }
  }
  return AddObservable(candidate_set, proposed);
}

namespace {

constexpr std::size_t kPairsForTriples = 24;  // number of pairs extended to triples
constexpr std::size_t kBeam = 4;

class EffectSearch {
 public:
  EffectSearch(CandidateSet& candidate_set, const Candidates& candidates, std::size_t most,
               const std::function<bool()>& interrupted)
      : candidate_set_(candidate_set),
        candidates_(candidates),
        most_(most),
        interrupted_(interrupted) {}

  std::vector<Explanation> Run();

 private:
  /// True if shapes within the support exclude each other.
  bool Excluded(const std::vector<BlockIndex>& support) const;
  bool Interrupted() const { return interrupted_ && interrupted_(); }
  /// Score limit for explanations with this number of blocks: worse ones are neither returned nor
  /// extended.
  double WorstUsefulScore(std::size_t blocks) const;
  /// Fits a support, unless already tried, and lists the explanation that remains after
  /// elimination.
  void EvaluateSupport(std::vector<BlockIndex> support);
  void Grow(const Explanation& from);
  void NewShapes(const Explanation& from);
  void RefineShapes();
  void RefitShapes();
  void Exchange();
  /// Refines, refits and exchanges blocks of the best explanation until its score no longer
  /// improves, at most four rounds.
  void RefineBest();
  void Offer(BlockIndex block);
  /// The offered blocks, ordered by their score alone, best first.
  std::vector<BlockIndex> ByScoreAlone() const;
  std::vector<Explanation> Best(std::size_t count, std::size_t blocks) const;
  const Explanation& Winner() const { return *std::ranges::min_element(found_, Better); }
  static bool Better(const Explanation& a, const Explanation& b) { return a.score < b.score; }

  CandidateSet& candidate_set_;
  const Candidates& candidates_;
  std::size_t most_;
  const std::function<bool()>& interrupted_;
  std::vector<BlockIndex> offered_;
  std::set<std::vector<BlockIndex>> tried_;
  std::set<std::vector<ColumnIndex>> listed_, refitted_;
  std::vector<Explanation> found_;
  /// The best scores by number of blocks (key 0: over all explanations), each with the worst on
  /// top.
  std::map<std::size_t, std::priority_queue<double>> best_scores_;
};

bool EffectSearch::Excluded(const std::vector<BlockIndex>& support) const {
  std::vector<const Block*> blocks;
  blocks.reserve(support.size());
  for (const BlockIndex block : support) blocks.push_back(&candidate_set_.blocks()[block]);
  return ShapesConflict(candidate_set_.problem(), blocks);
}

void EffectSearch::EvaluateSupport(std::vector<BlockIndex> support) {
  std::ranges::sort(support);
  support.erase(std::unique(support.begin(), support.end()), support.end());
  if (support.size() > most_ || !tried_.insert(support).second) return;
  if (Excluded(support)) return;
  std::optional<Explanation> explanation =
      candidate_set_.EvaluateBelow(support, WorstUsefulScore(support.size()));
  if (!explanation || !ShapesAreVisible(candidate_set_, *explanation)) return;
  if (!listed_.insert(explanation->columns).second) return;
  const auto keep = [&](std::size_t blocks, std::size_t most) {
    std::priority_queue<double>& scores = best_scores_[blocks];
    scores.push(explanation->score);
    if (scores.size() > most) scores.pop();
  };
  keep(0, kMaxListed);
  if (!explanation->blocks.empty()) keep(explanation->blocks.size(), kPairsForTriples);
  found_.push_back(std::move(*explanation));
}

double EffectSearch::WorstUsefulScore(std::size_t blocks) const {
  const auto worst = [this](std::size_t key, std::size_t most) {
    const auto scores = best_scores_.find(key);
    const bool full = scores != best_scores_.end() && scores->second.size() == most;
    return full ? scores->second.top() : HUGE_VAL;
  };
  return std::max(worst(0, kMaxListed), worst(blocks, kPairsForTriples));
}

void EffectSearch::Grow(const Explanation& from) {
  for (const BlockIndex block : offered_) {
    std::vector<BlockIndex> support = from.blocks;
    support.push_back(block);
    EvaluateSupport(std::move(support));
    if (Interrupted()) return;
  }
}

void EffectSearch::NewShapes(const Explanation& from) {
  for (const BlockIndex block :
       AddShapes(candidate_set_, candidates_.searched, candidate_set_.Residual(from))) {
    Offer(block);
    std::vector<BlockIndex> support = from.blocks;
    support.push_back(block);
    EvaluateSupport(std::move(support));
    EvaluateSupport({block});
  }
}

/// Proposes every searched shape of the best explanation anew for the residual of its other
/// effects: a shape chosen before those effects were added also fitted their part. Explanations
/// with many lines are skipped: they would take as long as the search, for little gain per line.
void EffectSearch::RefineShapes() {
  const Explanation best = Winner();
  if (best.blocks.size() > kMaxRefittedBlocks) return;
  for (const BlockIndex block : best.blocks) {
    const effects::Effect* const effect = candidate_set_.blocks()[block].term.effect;
    const auto& searched = candidates_.searched;
    if (std::ranges::find(searched, effect) == searched.end()) continue;
    std::vector<BlockIndex> others = best.blocks;
    std::erase(others, block);
    for (const BlockIndex shape :
         AddShapes(candidate_set_, {effect}, candidate_set_.PartialResidual(best, block))) {
      std::vector<BlockIndex> support = others;
      support.push_back(shape);
      EvaluateSupport(std::move(support));
    }
  }
}

void EffectSearch::Offer(BlockIndex block) {
  if (std::ranges::find(offered_, block) == offered_.end()) {
    offered_.push_back(block);
  }
}

/// Refits the best explanation as a whole if it has a continuous shape. A scan of one residual
/// finds such a shape only approximately (a time constant next to a step, for example), and the
/// remaining error would be attributed to further effects.
void EffectSearch::RefitShapes() {
  const Explanation best = Winner();
  if (best.blocks.size() > kMaxRefittedBlocks) return;
  const bool has_continuous_shape = std::ranges::any_of(best.blocks, [this](BlockIndex block) {
    return HasContinuousShape(candidate_set_.blocks()[block]);
  });
  if (!has_continuous_shape) return;
  if (!refitted_.insert(best.columns).second) return;
  const Explanation refitted = WithRefittedShapes(candidate_set_, best);
  for (const BlockIndex block : refitted.blocks) Offer(block);
  EvaluateSupport(refitted.blocks);
}

/// Tries every offered block in place of each block of the best explanation: an early choice may
/// only imitate a block that was offered later.
void EffectSearch::Exchange() {
  const Explanation best = Winner();
  if (best.blocks.size() > kMaxRefittedBlocks) return;
  for (const BlockIndex block : best.blocks) {
    std::vector<BlockIndex> others = best.blocks;
    std::erase(others, block);
    for (const BlockIndex other : std::vector<BlockIndex>(offered_)) {
      std::vector<BlockIndex> support = others;
      support.push_back(other);
      EvaluateSupport(std::move(support));
    }
    if (Interrupted()) return;
  }
}

void EffectSearch::RefineBest() {
  constexpr int kMaxRounds = 4;
  double previous = HUGE_VAL;
  for (int round = 0; round < kMaxRounds && Winner().score < previous; ++round) {
    previous = Winner().score;
    RefineShapes();
    RefitShapes();
    Exchange();
  }
}

std::vector<Explanation> EffectSearch::Best(std::size_t count, std::size_t blocks) const {
  std::vector<Explanation> best;
  for (const Explanation& explanation : found_) {
    if (blocks == 0 || explanation.blocks.size() == blocks) best.push_back(explanation);
  }
  std::ranges::stable_sort(best, Better);
  if (best.size() > count) best.resize(count);
  return best;
}

std::vector<BlockIndex> EffectSearch::ByScoreAlone() const {
  std::map<BlockIndex, double> scores;
  for (const Explanation& single : found_) {
    if (single.blocks.size() == 1) scores[single.blocks.front()] = single.score;
  }
  const auto score = [&](BlockIndex block) {
    const auto known = scores.find(block);
    return known == scores.end() ? HUGE_VAL : known->second;
  };
  std::vector<BlockIndex> blocks = offered_;
  std::ranges::stable_sort(blocks, [&](BlockIndex a, BlockIndex b) { return score(a) < score(b); });
  return blocks;
}

std::vector<Explanation> EffectSearch::Run() {
  offered_ = AddObservable(candidate_set_, candidates_.blocks);
  EvaluateSupport({});
  const Explanation nothing = found_.front();
  for (const BlockIndex block : offered_) EvaluateSupport({block});
  NewShapes(nothing);
  for (const Explanation& single : Best(3, 1)) NewShapes(single);
  // All pairs, starting with the best single effects so that poor pairs are skipped early.
  const std::vector<BlockIndex> by_score = ByScoreAlone();
  for (std::size_t i = 0; i < by_score.size(); ++i) {
    for (std::size_t j = i + 1; j < by_score.size(); ++j)
      EvaluateSupport({by_score[i], by_score[j]});
    if (Interrupted()) break;
  }
  for (const Explanation& pair : Best(2, 2)) NewShapes(pair);
  RefineBest();
  // Triples and more only if two effects are better than one.
  while (!Interrupted()) {
    const Explanation best = Winner();
    const std::size_t size = best.blocks.size();
    if (size < 2 || size >= most_) break;
    const std::size_t width = size == 2 ? kPairsForTriples : kBeam;
    const double previous = best.score;
    NewShapes(best);
    for (const Explanation& from : Best(width, size)) Grow(from);
    RefineBest();
    if (!(Winner().score < previous - kMinGainToGrow)) break;
  }
  return Best(kMaxListed, 0);
}

}  // namespace

std::vector<Explanation> Search(CandidateSet& candidate_set, const Candidates& candidates,
                                std::size_t most, const std::function<bool()>& interrupted) {
  return EffectSearch(candidate_set, candidates, most, interrupted).Run();
}

}  // namespace plumbline::measure
