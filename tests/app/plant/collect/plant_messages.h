// Messages as a cell publishes them, made from the publisher's own functions.
#pragma once

#include <fmt/format.h>

#include <string>

#include "app/plant/broker/subscriber.h"
#include "app/plant/publish/change_detector.h"

namespace plumbline::test {

/// A cell of a plant. Not the product's model: numbers that suffice for rows.
struct PublishingCell {
  std::string node = "cell-1", line = "line-1", stream = "0000a001";

  plant::Received Message(plant::MessageKind kind, std::int64_t seq, std::int64_t utc_ms,
                          std::string body) const {
    return {fmt::format("plumblineV1/{}/{}/{}", line, plant::TopicTypeOf(kind), node),
            plant::MessageText(stream, {seq, {kind, utc_ms, std::move(body)}})};
  }
  plant::Received Probe(std::int64_t seq, std::int64_t utc_ms, double residual_m = 1e-4) const {
    plant::ProbeRow row;
    row.journal = 1'700'000'000;
    row.id = seq;
    row.session = "1";
    row.model_version = 3;
    row.measured_W = Vec3(1.2, -0.4, 0.9);
    row.predicted_W = Vec3(1.2 - residual_m, -0.4, 0.9);
    row.payload_kg = 60;
    return Message(plant::MessageKind::kProbe, seq, utc_ms, plant::ProbeBody(row, {}));
  }
  plant::Received Alarm(std::int64_t seq, std::int64_t utc_ms, bool begins = true) const {
    return Message(plant::MessageKind::kAlarm, seq, utc_ms,
                   plant::AlarmBody("alarms", 2, "robot stale", begins));
  }
  plant::Received State(std::int64_t seq, std::int64_t utc_ms) const {
    cell::ViewState state;
    state.model_version = 3;
    return Message(plant::MessageKind::kState, seq, utc_ms,
                   plant::StateBody(state, {line, node, "KR 210", {}, {}}));
  }
};

}  // namespace plumbline::test
