
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "app/measure/diagnosis/design/pose_design.h"
#include "app/measure/diagnosis/linear/robust.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/diagnosis/search/explained_effects.h"
#include "app/measure/diagnosis/shapes/periodic_search.h"

namespace plumbline::measure {
namespace {

constexpr double kWorthAnotherPayload = 1.5;  // required ratio of the gains

/// Lowest height in W that the tip reached, or that of the base if lower [m]; lower poses are
/// unsafe.
double LowestTip(const Linearisation& linear, const Model& model, const FitRows& rows) {
  double lowest_m = model.frames.back().X_WB.p.z();
  for (const RowIndex row : rows) lowest_m = std::min(lowest_m, linear.rows[row].p_W.z());
  return lowest_m;
}

/// Rows that the answer does not reject. The robot may never have been at a rejected joint reading.
FitRows AcceptedRows(const PerRow<double>& weights) {
  FitRows rows;
  for (const RowIndex row : weights.indices()) {
    if (weights[row] >= kOutlierWeight) rows.push_back(row);
  }
  return rows;
}

/// The measured payloads and zero: removing the payload is the one change known to be possible.
std::vector<double> PayloadsWithZero(const Dataset& data, const std::vector<double>& seen) {
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

/// The lines of one explanation that another lacks: "23 cycles per turn of q1".
std::vector<std::string> LinesText(const CandidateSet& candidate_set,
                                   const Explanation& explanation, const Explanation& beside) {
  std::vector<std::string> texts;
  for (const BlockIndex block : explanation.blocks) {
    const std::optional<PeriodicLine> line = LineOf(candidate_set.blocks()[block]);
    const bool shared = std::ranges::find(beside.blocks, block) != beside.blocks.end();
    if (!line || shared) continue;
    texts.push_back(
        fmt::format("{:.3g} cycles per turn of q{}", line->cycles_per_turn, line->joint + 1));
  }
  return texts;
}

/// What two explanations differ in, effects or else lines: "payload mass from tool stiffness".
std::string PairText(const CandidateSet& candidate_set, const Explanation& answer,
                     const Explanation& rival) {
  const auto names = [&](const Explanation& explanation, const Explanation& beside) {
    const std::vector<EffectKey> others = EffectKeys(candidate_set, beside);
    std::vector<std::string> texts;
    for (const EffectKey& key : EffectKeys(candidate_set, explanation)) {
      if (std::ranges::find(others, key) == others.end())
        texts.push_back(EffectName(key.id, key.word, {}));
    }
    return Listed(texts.empty() ? LinesText(candidate_set, explanation, beside) : texts);
  };
  return names(rival, answer) + " from " + names(answer, rival);
}

/// The distinct pairs of the answer with each of these rivals.
std::string PairsText(const DesignTask& task, const std::set<std::size_t>& rivals) {
  std::vector<std::string> texts;
  for (const std::size_t j : rivals) {
    const std::string text =
        PairText(task.candidate_set, task.explanations.front(), task.explanations[j]);
    if (std::ranges::find(texts, text) == texts.end()) texts.push_back(text);
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
  for (const BlockIndex block : used) blocks.push_back(&task.candidate_set.blocks()[block]);
  return blocks;
}

/// A measured pose with every joint displaced by up to a tenth of its range.
DesignPoint Beside(const DesignPoint& random_point, const MeasuredRow& row,
                   const DesignSpace& space, Random& random) {
  constexpr double kDisplacement = 0.1;
  DesignPoint point = random_point;  // the other design variables
  point.q = row.q;
  for (Eigen::Index joint = 0; joint < point.q.size(); ++joint) {
    const double range = space.high[joint] - space.low[joint];
    point.q[joint] += kDisplacement * range * (2 * random.Uniform() - 1);
  }
  return point;
}

/// At random poses within the measured range, and beside measured poses.
std::vector<RivalSeparation> SeparationsOf(const DesignTask& task, const DesignSpace& space) {
  constexpr std::size_t kRandom = 150;
  Random random(8191);
  std::vector<DesignPoint> points = RandomPoints(space);
  if (points.size() > kRandom) points.resize(kRandom);
  const std::size_t count = points.size();
  for (std::size_t k = 0; k < count; ++k) {
    const auto row = random.Below(task.rows.rows());
    points.push_back(Beside(points[k], task.rows.measured(RowIndex(row)), space, random));
  }
  return SequentialDesign(task, space).SeparationsAt(points);
}

}  // namespace

void AddNextPoses(const CandidateSet& candidate_set, const Model& model,
                  const PerRow<double>& weights, const Explanation& answer,
                  const std::vector<Explanation>& rivals, const DiagnosisOptions& options,
                  Diagnosis& diagnosis) {
  if (rivals.empty()) return;
  const Dataset& data = candidate_set.problem().data();
  const FitRows accepted = AcceptedRows(weights);
  if (accepted.empty()) return;
  DesignTask task{candidate_set, model, SelectRows(data, accepted), {answer}};
  task.explanations.insert(task.explanations.end(), rivals.begin(), rivals.end());
  task.lowest_m = LowestTip(candidate_set.problem().linear(), model, accepted);
  task.poses = options.next_poses;
  task.threads = options.threads;
  DesignSpace space = DesignSpaceOf(task.rows, BlocksOf(task));
  diagnosis.rival_separations = SeparationsOf(task, space);
  if (options.next_poses <= 0) return;
  if (!data.instrument_used()) {
    diagnosis.notes.emplace_back(
        "no next poses are proposed: these rows are on artefacts only, and a pose that separates "
        "the rivals must be reachable on one. Touch the artefacts in clearly different arm "
        "postures, or set them up in another part of the workspace");
    return;
  }
  const std::vector<double> seen = space.payloads_kg;
  PoseDesign design = SequentialDesign(task, space).Run();
  space.payloads_kg = PayloadsWithZero(data, seen);
  std::optional<std::string> without_payload;
  if (!design.unseparated.empty() && space.payloads_kg != seen) {
    PoseDesign with_more = SequentialDesign(task, space).Run();
    if (with_more.gain > kWorthAnotherPayload * design.gain) {
      without_payload = fmt::format(
          "{} further poses at {} would not separate {}: some of the proposed poses are without "
          "payload; any clearly different payload serves as well",
          options.next_poses, Kilograms(seen), PairsText(task, design.unseparated));
      design = std::move(with_more);
    }
  }
  // Differences below the noise of one axis decide nothing.
  const bool visible = std::ranges::any_of(
      design.poses, [&](const NextPose& pose) { return pose.separation_m >= diagnosis.sigma_m; });
  diagnosis.next_poses_searched = true;
  if (!visible) return;
  if (without_payload) diagnosis.notes.push_back(*without_payload);
  if (!design.unseparated.empty()) {
    diagnosis.notes.push_back(fmt::format(
        "further poses near those measured are not certain to separate {}: record a signal in "
        "which they differ, or measure in a new part of the workspace",
        PairsText(task, design.unseparated)));
  }
  diagnosis.next_poses_separate_all = design.unseparated.empty();
  diagnosis.next_poses = std::move(design.poses);
}

}  // namespace plumbline::measure
