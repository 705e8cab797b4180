#include "app/diagnosis/pose_candidates.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "app/diagnosis/statistics.h"

namespace plumbline {
namespace {

constexpr int kPoses = 300;
constexpr double kWidened = 0.25;     // of the range that a joint was measured in, on either side
constexpr double kLeastTurn = 0.09;   // [rad]
constexpr double kLeastSlide = 0.05;  // [m]
constexpr double kLeastMove = 1e-6;   // [rad] or [m]: less is no move

struct PoseRange {
  JointVector low, high;
};

PoseRange RangeOf(const Dataset& data) {
  PoseRange range{data.table.rows.front().q, data.table.rows.front().q};
  for (const MeasuredRow& row : data.table.rows) {
    range.low = range.low.cwiseMin(row.q);
    range.high = range.high.cwiseMax(row.q);
  }
  for (int i = 0; i < data.cell.robot.size(); ++i) {
    const Joint& joint = data.cell.robot.joints[static_cast<std::size_t>(i)];
    const double least = joint.type == JointType::kPrismatic ? kLeastSlide : kLeastTurn;
    const double more = std::max(least, kWidened * (range.high[i] - range.low[i]));
    // Rows beyond the limits show that they are no limits.
    range.low[i] = std::min(range.low[i], std::max(range.low[i] - more, joint.min));
    range.high[i] = std::max(range.high[i], std::min(range.high[i] + more, joint.max));
  }
  return range;
}

}  // namespace

std::vector<double> PayloadsSeen(const Dataset& data) {
  std::set<double> distinct;
  for (const MeasuredRow& row : data.table.rows) {
    distinct.insert(data.table.recorded.payload ? row.payload_kg : 0.0);
  }
  std::vector<double> all(distinct.begin(), distinct.end());
  if (all.size() <= 3) return all;
  return {all.front(), all[all.size() / 2], all.back()};
}

Dataset PoseCandidates(const Dataset& data, const std::vector<double>& payloads_kg) {
  Dataset candidates = data;
  candidates.table.rows.clear();
  candidates.conditions.clear();
  candidates.payloads.clear();
  candidates.session_of.clear();
  candidates.cluster_of.clear();
  const PoseRange range = RangeOf(data);
  Random random(4242);
  for (int k = 0; k < kPoses; ++k) {
    MeasuredRow row = data.table.rows.back();
    Conditions moment = data.conditions.back();
    for (Eigen::Index i = 0; i < row.q.size(); ++i) {
      row.q[i] = range.low[i] + random.Uniform() * (range.high[i] - range.low[i]);
    }
    moment.q = row.q;
    moment.tau.resize(0);
    for (const double payload_kg : payloads_kg) {
      row.payload_kg = moment.payload_kg = payload_kg;
      Payload payload = data.payloads.back();
      payload.mass_kg = data.cell.payload_cog_F ? payload_kg : 0;
      candidates.payloads.push_back(payload);
      candidates.session_of.push_back(data.session_of.back());
      candidates.cluster_of.push_back(k);
      candidates.conditions.push_back(moment);
      candidates.table.rows.push_back(row);
    }
  }
  candidates.clusters = kPoses;
  // Signals of empirical terms stay those of a row that exists.
  for (RecordedSignal& signal : candidates.signals) {
    signal.values.assign(candidates.table.rows.size(), signal.values.back());
  }
  return candidates;
}

void ComeFrom(const Conditions& previous, Dataset& candidates) {
  for (Conditions& moment : candidates.conditions) {
    moment.last_move = moment.q - previous.q;
    moment.approach =
        previous.approach.size() > 0 ? previous.approach : JointVector::Zero(moment.q.size());
    for (Eigen::Index i = 0; i < moment.q.size(); ++i) {
      if (std::abs(moment.last_move[i]) > kLeastMove) {
        moment.approach[i] = moment.last_move[i] > 0 ? 1.0 : -1.0;
      }
    }
  }
}

}  // namespace plumbline
