#include "app/diagnosis/search.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <queue>
#include <set>

#include "app/diagnosis/elimination.h"
#include "app/diagnosis/shape_refit.h"
#include "app/diagnosis/shape_search.h"

namespace plumbline {

std::vector<BlockIndex> AddShapes(Pool& pool, const std::vector<const Effect*>& searched,
                                  const Eigen::VectorXd& residual) {
  std::vector<BlockIndex> indices;
  for (const Effect* effect : searched) {
    for (const Block& block : ShapeSearchOf(*effect)->Propose(pool.problem(), residual)) {
      const BlockIndex index = pool.Add(block);
      if (pool.Observable(index)) indices.push_back(index);
    }
  }
  return indices;
}

namespace {

constexpr std::size_t kPairsForTriples = 24;  // triples grow from the best pairs
constexpr std::size_t kBeam = 4;

class Searching {
 public:
  Searching(Pool& pool, const Candidates& candidates, std::size_t most,
            const std::function<bool()>& interrupted)
      : pool_(pool), candidates_(candidates), most_(most), interrupted_(interrupted) {}

  std::vector<Explanation> Run();

 private:
  /// True where the shapes of one of its effects do not go together.
  bool Excluded(const std::vector<BlockIndex>& support) const;
  bool Interrupted() const { return interrupted_ && interrupted_(); }
  /// The score from which on an explanation of so many blocks changes nothing: neither is it listed
  /// at the end, nor grown from.
  double WorstOfUse(std::size_t blocks) const;
  /// Fits a support once; what elimination leaves is listed.
  void JudgeSupport(std::vector<BlockIndex> support);
  void Grow(const Explanation& from);
  void NewShapes(const Explanation& from);
  void RefineShapes();
  void RefitShapes();
  void Exchange();
  /// Exchanges and refines until the best score no longer falls, four rounds at most.
  void Settle();
  void Offer(BlockIndex block);
  /// The blocks offered, the best by itself first.
  std::vector<BlockIndex> ByScoreAlone() const;
  std::vector<Explanation> Best(std::size_t count, std::size_t blocks) const;
  const Explanation& Winner() const {
    return *std::min_element(found_.begin(), found_.end(), Better);
  }
  static bool Better(const Explanation& a, const Explanation& b) { return a.score < b.score; }

  Pool& pool_;
  const Candidates& candidates_;
  std::size_t most_;
  const std::function<bool()>& interrupted_;
  std::vector<BlockIndex> offered_;
  std::set<std::vector<BlockIndex>> tried_;
  std::set<std::vector<ColumnIndex>> listed_, refitted_;
  std::vector<Explanation> found_;
  /// The best scores found, of all explanations (0) and of those of so many blocks; the worst
  /// first.
  std::map<std::size_t, std::priority_queue<double>> best_scores_;
};

bool Searching::Excluded(const std::vector<BlockIndex>& support) const {
  std::vector<const Block*> blocks;
  blocks.reserve(support.size());
  for (const BlockIndex block : support) blocks.push_back(&pool_.blocks()[block]);
  return ShapesClash(pool_.problem(), blocks);
}

void Searching::JudgeSupport(std::vector<BlockIndex> support) {
  std::sort(support.begin(), support.end());
  support.erase(std::unique(support.begin(), support.end()), support.end());
  if (support.size() > most_ || !tried_.insert(support).second) return;
  if (Excluded(support)) return;
  std::optional<Explanation> explanation = pool_.EvaluateBelow(support, WorstOfUse(support.size()));
  if (!explanation) return;
  if (!listed_.insert(explanation->columns).second) return;
  const auto keep = [&](std::size_t blocks, std::size_t most) {
    std::priority_queue<double>& scores = best_scores_[blocks];
    scores.push(explanation->score);
    if (scores.size() > most) scores.pop();
  };
  keep(0, kMostListed);
  if (!explanation->blocks.empty()) keep(explanation->blocks.size(), kPairsForTriples);
  found_.push_back(std::move(*explanation));
}

double Searching::WorstOfUse(std::size_t blocks) const {
  const auto worst = [this](std::size_t key, std::size_t most) {
    const auto scores = best_scores_.find(key);
    const bool full = scores != best_scores_.end() && scores->second.size() == most;
    return full ? scores->second.top() : HUGE_VAL;
  };
  return std::max(worst(0, kMostListed), worst(blocks, kPairsForTriples));
}

void Searching::Grow(const Explanation& from) {
  for (const BlockIndex block : offered_) {
    std::vector<BlockIndex> support = from.blocks;
    support.push_back(block);
    JudgeSupport(std::move(support));
    if (Interrupted()) return;
  }
}

void Searching::NewShapes(const Explanation& from) {
  for (const BlockIndex block : AddShapes(pool_, candidates_.searched, pool_.Residual(from))) {
    Offer(block);
    std::vector<BlockIndex> support = from.blocks;
    support.push_back(block);
    JudgeSupport(std::move(support));
    JudgeSupport({block});
  }
}

/// Proposes every searched shape of the best anew, for what all its other effects leave: a shape
/// that was chosen among fewer effects fits what they lacked, too. Explanations of many lines stay
/// as they are: refining them would take as long as the search, and each line has little to gain.
void Searching::RefineShapes() {
  const Explanation best = Winner();
  if (best.blocks.size() > kMostRefittedBlocks) return;
  for (const BlockIndex block : best.blocks) {
    const Effect* const effect = pool_.blocks()[block].term.effect;
    const auto& searched = candidates_.searched;
    if (std::find(searched.begin(), searched.end(), effect) == searched.end()) continue;
    std::vector<BlockIndex> beside = best.blocks;
    std::erase(beside, block);
    for (const BlockIndex shape : AddShapes(pool_, {effect}, pool_.PartialResidual(best, block))) {
      std::vector<BlockIndex> support = beside;
      support.push_back(shape);
      JudgeSupport(std::move(support));
    }
  }
}

void Searching::Offer(BlockIndex block) {
  if (std::find(offered_.begin(), offered_.end(), block) == offered_.end()) {
    offered_.push_back(block);
  }
}

/// Refits the best as a whole where it has a shape that no scan of one residual finds exactly: a
/// time constant beside a step leaves an error that further effects would be taken for.
void Searching::RefitShapes() {
  const Explanation best = Winner();
  if (best.blocks.size() > kMostRefittedBlocks) return;
  const bool bends = std::any_of(best.blocks.begin(), best.blocks.end(), [this](BlockIndex block) {
    return HasContinuousShape(pool_.blocks()[block]);
  });
  if (!bends) return;
  if (!refitted_.insert(best.columns).second) return;
  const Explanation refitted = WithRefittedShapes(pool_, best);
  for (const BlockIndex block : refitted.blocks) Offer(block);
  JudgeSupport(refitted.blocks);
}

/// Tries every offered block in the place of each block of the best: an early choice may only
/// imitate a block that came later.
void Searching::Exchange() {
  const Explanation best = Winner();
  if (best.blocks.size() > kMostRefittedBlocks) return;
  for (const BlockIndex block : best.blocks) {
    std::vector<BlockIndex> beside = best.blocks;
    std::erase(beside, block);
    for (const BlockIndex other : std::vector<BlockIndex>(offered_)) {
      std::vector<BlockIndex> support = beside;
      support.push_back(other);
      JudgeSupport(std::move(support));
    }
    if (Interrupted()) return;
  }
}

void Searching::Settle() {
  constexpr int kMostRounds = 4;
  double before = HUGE_VAL;
  for (int round = 0; round < kMostRounds && Winner().score < before; ++round) {
    before = Winner().score;
    RefineShapes();
    RefitShapes();
    Exchange();
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

std::vector<BlockIndex> Searching::ByScoreAlone() const {
  std::map<BlockIndex, double> scores;
  for (const Explanation& single : found_) {
    if (single.blocks.size() == 1) scores[single.blocks.front()] = single.score;
  }
  const auto score = [&](BlockIndex block) {
    const auto known = scores.find(block);
    return known == scores.end() ? HUGE_VAL : known->second;
  };
  std::vector<BlockIndex> blocks = offered_;
  std::stable_sort(blocks.begin(), blocks.end(),
                   [&](BlockIndex a, BlockIndex b) { return score(a) < score(b); });
  return blocks;
}

std::vector<Explanation> Searching::Run() {
  for (const Block& block : candidates_.blocks) {
    const BlockIndex index = pool_.Add(block);
    if (pool_.Observable(index)) offered_.push_back(index);
  }
  JudgeSupport({});
  const Explanation nothing = found_.front();
  for (const BlockIndex block : offered_) JudgeSupport({block});
  NewShapes(nothing);
  for (const Explanation& single : Best(3, 1)) NewShapes(single);
  // All pairs, those of the best single effects first: what cannot be as good is soon seen.
  const std::vector<BlockIndex> by_score = ByScoreAlone();
  for (std::size_t i = 0; i < by_score.size(); ++i) {
    for (std::size_t j = i + 1; j < by_score.size(); ++j) JudgeSupport({by_score[i], by_score[j]});
    if (Interrupted()) break;
  }
  for (const Explanation& pair : Best(2, 2)) NewShapes(pair);
  Settle();
  // Triples and more only where two effects beat one: otherwise there is nothing to explain.
  while (!Interrupted()) {
    const Explanation best = Winner();
    const std::size_t size = best.blocks.size();
    if (size < 2 || size >= most_) break;
    const std::size_t width = size == 2 ? kPairsForTriples : kBeam;
    const double before = best.score;
    NewShapes(best);
    for (const Explanation& from : Best(width, size)) Grow(from);
    Settle();
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
