#include "app/diagnosis/next_poses.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "app/diagnosis/contest.h"
#include "app/diagnosis/identify.h"
#include "app/diagnosis/pose_candidates.h"
#include "app/diagnosis/robust.h"
#include "app/diagnosis/words.h"

namespace plumbline {
namespace {

constexpr double kLeastGain = 0.1;  // sigma^2: a pose that brings less is not worth the way
constexpr double kWorthAnotherPayload = 1.5;  // in gain

struct PoseDesign {
  std::vector<NextPose> poses;
  std::set<std::size_t> untold;  ///< rivals, counted from 1
  double gain = 0;               ///< of the poses until all are told
};

/// Height in W that a tip has reached, or the base's if that is lower: nothing below was tried.
double LowestTip(const Linearisation& linear, const Model& model, const std::vector<int>& rows) {
  double lowest_m = model.frames.back().X_WB.p.z();
  for (const int row : rows) {
    lowest_m = std::min(lowest_m, linear.rows[static_cast<std::size_t>(row)].p_W.z());
  }
  return lowest_m;
}

/// Rows that the answer does not reject: where a wrong joint reading stands nobody was.
std::vector<int> Kept(const std::vector<double>& weights) {
  std::vector<int> rows;
  for (std::size_t k = 0; k < weights.size(); ++k) {
    if (weights[k] >= kOutlierWeight) rows.push_back(static_cast<int>(k));
  }
  return rows;
}

/// Greedy: the best candidate, then the best beside it, and so on.
PoseDesign DesignAt(const std::vector<double>& payloads_kg, const Pool& pool, const Model& model,
                    const std::vector<int>& kept, const std::vector<Explanation>& explanations,
                    const DiagnosisOptions& options) {
  const Dataset& data = pool.problem().data();
  Dataset candidates = PoseCandidates(Thinned(data, kept), payloads_kg);
  const Result<Linearisation> linear = LineariseApart(candidates, model, options.threads);
  PoseDesign design;
  Contests contests(pool, explanations);
  for (std::size_t j = 1; j < explanations.size(); ++j) design.untold.insert(j);
  if (!linear) return design;
  const double lowest_m = LowestTip(pool.problem().linear(), model, kept);
  std::set<int> taken;  // clusters: a pose with another payload is the same way to go
  ComeFrom(data.conditions.back(), candidates);
  while (static_cast<int>(design.poses.size()) < options.next_poses) {
    std::vector<double> gains(candidates.table.rows.size(), 0.0);
    InParallel(candidates.rows(), options.threads, [&](int first, int last) {
      for (int row = first; row < last; ++row) {
        const auto k = static_cast<std::size_t>(row);
        if (linear->rows[k].p_W.z() < lowest_m || taken.contains(candidates.cluster_of[k]))
          continue;
        gains[k] = contests.Gain(candidates, *linear, row);
      }
    });
    const auto best = std::max_element(gains.begin(), gains.end());
    if (*best < kLeastGain) break;
    if (!design.untold.empty()) design.gain += *best;
    const auto k = static_cast<std::size_t>(best - gains.begin());
    const auto row = static_cast<int>(k);
    design.poses.push_back({candidates.table.rows[k].q, candidates.table.rows[k].payload_kg,
                            contests.Apart(candidates, *linear, row)});
    taken.insert(candidates.cluster_of[k]);
    contests.Measure(candidates, *linear, row);
    for (std::size_t j = 1; j < explanations.size(); ++j) {
      if (contests.Told(j)) design.untold.erase(j);
    }
    if (contests.AllTold()) contests.Forget();
    const Conditions here = candidates.conditions[k];
    ComeFrom(here, candidates);
  }
  return design;
}

/// The payloads seen, and none: that a load can be taken off is all that is known of others.
std::vector<double> PayloadsBeside(const Dataset& data, const std::vector<double>& seen) {
  if (!data.cell.payload_cog_F || !data.table.recorded.payload) return seen;
  std::set<double> all(seen.begin(), seen.end());
  all.insert(0.0);
  return {all.begin(), all.end()};
}

std::string Kilograms(const std::vector<double>& payloads_kg) {
  std::vector<std::string> texts;
  texts.reserve(payloads_kg.size());
  for (const double payload_kg : payloads_kg) texts.push_back(fmt::format("{:.4g}", payload_kg));
  return Listed(texts) + " kg";
}

/// The effects in which two explanations differ: "payload mass from tool stiffness".
std::string Pair(const Pool& pool, const Explanation& answer, const Explanation& rival) {
  const auto names = [&](const Explanation& of, const Explanation& beside) {
    const std::vector<EffectKey> others = EffectKeys(pool, beside);
    std::vector<std::string> texts;
    for (const EffectKey& key : EffectKeys(pool, of)) {
      if (std::find(others.begin(), others.end(), key) == others.end())
        texts.push_back(EffectName(key.id, key.word, {}));
    }
    return Listed(texts);
  };
  return names(rival, answer) + " from " + names(answer, rival);
}

}  // namespace

void AddNextPoses(const Pool& pool, const Model& model, const std::vector<double>& weights,
                  const Explanation& answer, const std::vector<Explanation>& rivals,
                  const DiagnosisOptions& options, Diagnosis& diagnosis) {
  if (rivals.empty() || options.next_poses <= 0) return;
  std::vector<Explanation> all = {answer};
  all.insert(all.end(), rivals.begin(), rivals.end());
  const auto pairs = [&](const std::set<std::size_t>& which) {
    std::vector<std::string> texts;
    for (const std::size_t j : which) {
      const std::string text = Pair(pool, answer, all[j]);
      if (std::find(texts.begin(), texts.end(), text) == texts.end()) texts.push_back(text);
    }
    return Listed(texts, "or");
  };
  const Dataset& data = pool.problem().data();
  const std::vector<int> kept = Kept(weights);
  const std::vector<double> seen = PayloadsSeen(Thinned(data, kept));
  PoseDesign design = DesignAt(seen, pool, model, kept, all, options);
  const std::vector<double> more = PayloadsBeside(data, seen);
  if (!design.untold.empty() && more != seen) {
    PoseDesign with_more = DesignAt(more, pool, model, kept, all, options);
    if (with_more.gain > kWorthAnotherPayload * design.gain) {
      diagnosis.notes.push_back(fmt::format(
          "{} further poses at {} would not tell {}: the proposed poses include some without "
          "payload; any clearly different payload does as well",
          options.next_poses, Kilograms(seen), pairs(design.untold)));
      design = std::move(with_more);
    }
  }
  if (!design.untold.empty()) {
    diagnosis.notes.push_back(fmt::format(
        "{} further poses near those measured would not surely tell {}: record a signal "
        "in which they differ, or measure where the robot has not been",
        options.next_poses, pairs(design.untold)));
  }
  diagnosis.next_poses_tell_all = design.untold.empty();
  diagnosis.next_poses = std::move(design.poses);
}

}  // namespace plumbline
