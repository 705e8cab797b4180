#include "app/diagnosis/next_poses.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "app/diagnosis/pose_design.h"
#include "app/diagnosis/robust.h"
#include "app/diagnosis/words.h"

namespace plumbline {
namespace {

constexpr double kWorthAnotherPayload = 1.5;  // in gain

/// Height in W that a tip has reached, or the base's if that is lower: nothing below was tried.
double LowestTip(const Linearisation& linear, const Model& model, const FitRows& rows) {
  double lowest_m = model.frames.back().X_WB.p.z();
  for (const RowIndex row : rows) lowest_m = std::min(lowest_m, linear.rows[row].p_W.z());
  return lowest_m;
}

/// Rows that the answer does not reject: at a wrong joint reading the robot has never been.
FitRows Kept(const PerRow<double>& weights) {
  FitRows rows;
  for (const RowIndex row : weights.indices()) {
    if (weights[row] >= kOutlierWeight) rows.push_back(row);
  }
  return rows;
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

/// The pairs of the answer and each of these rivals, each once.
std::string Pairs(const DesignTask& task, const std::set<std::size_t>& rivals) {
  std::vector<std::string> texts;
  for (const std::size_t j : rivals) {
    const std::string text = Pair(task.pool, task.explanations.front(), task.explanations[j]);
    if (std::find(texts.begin(), texts.end(), text) == texts.end()) texts.push_back(text);
  }
  return Listed(texts, "or");
}

std::vector<const Block*> BlocksOf(const DesignTask& task) {
  std::set<BlockIndex> used;
  for (const Explanation& explanation : task.explanations) {
    used.insert(explanation.blocks.begin(), explanation.blocks.end());
  }
  std::vector<const Block*> blocks;
  blocks.reserve(used.size());
  for (const BlockIndex block : used) blocks.push_back(&task.pool.blocks()[block]);
  return blocks;
}

}  // namespace

void AddNextPoses(const Pool& pool, const Model& model, const PerRow<double>& weights,
                  const Explanation& answer, const std::vector<Explanation>& rivals,
                  const DiagnosisOptions& options, Diagnosis& diagnosis) {
  if (rivals.empty() || options.next_poses <= 0) return;
  const Dataset& data = pool.problem().data();
  const FitRows kept = Kept(weights);
  if (kept.empty()) return;
  DesignTask task{pool, model, Thinned(data, kept), {answer}};
  task.explanations.insert(task.explanations.end(), rivals.begin(), rivals.end());
  task.lowest_m = LowestTip(pool.problem().linear(), model, kept);
  task.poses = options.next_poses;
  task.threads = options.threads;
  DesignSpace space = DesignSpaceOf(task.rows, BlocksOf(task));
  const std::vector<double> seen = space.payloads_kg;
  PoseDesign design = SequentialDesign(task, space).Run();
  space.payloads_kg = PayloadsBeside(data, seen);
  if (!design.unseparated.empty() && space.payloads_kg != seen) {
    PoseDesign with_more = SequentialDesign(task, space).Run();
    if (with_more.gain > kWorthAnotherPayload * design.gain) {
      diagnosis.notes.push_back(fmt::format(
          "{} further poses at {} would not separate {}: the proposed poses include some without "
          "payload; any clearly different payload does as well",
          options.next_poses, Kilograms(seen), Pairs(task, design.unseparated)));
      design = std::move(with_more);
    }
  }
  if (!design.unseparated.empty()) {
    diagnosis.notes.push_back(fmt::format(
        "{} further poses near those measured would not surely separate {}: record a signal "
        "in which they differ, or measure where the robot has not been",
        options.next_poses, Pairs(task, design.unseparated)));
  }
  diagnosis.next_poses_separate_all = design.unseparated.empty();
  diagnosis.next_poses = std::move(design.poses);
}

}  // namespace plumbline
