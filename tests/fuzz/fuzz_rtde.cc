// Fuzzer: arbitrary bytes from an RTDE controller are cut into messages, and every parser is given
// every payload.
#include <cstdint>
#include <cstdlib>

#include "drivers/robot/rtde_codec.h"

namespace {

using namespace plumbline::robot::rtde;  // NOLINT(google-build-using-namespace)

void Require(bool condition) {
  if (!condition) std::abort();
}

/// Fields of a layout chosen by the bits of a number.
OutputLayout LayoutOf(std::uint8_t bits, int version) {
  std::vector<Output> fields{Output::kTimestamp, Output::kJoints};
  for (std::size_t k = 2; k < kOutputs; ++k) {
    if ((bits >> (k % 8) & 1) != 0) fields.push_back(static_cast<Output>(k));
  }
  return OutputLayout(fields, version, bits);
}

void Judge(Bytes payload) {
  for (const int version : {1, 2}) {
    if (const auto text = TextFrom(payload, version)) {
      for (const char c : *text) Require(static_cast<unsigned char>(c) >= ' ' && c != 0x7F);
      Require(text->size() <= payload.size() + 2);
    }
    const auto reply = RecipeReplyFrom(payload, version == 2);
    if (reply) Require(reply->types.size() <= payload.size() + 1);
    const OutputLayout layout = LayoutOf(payload.empty() ? 0 : payload[0], version);
    if (!layout.Fits(payload)) continue;
    static_cast<void>(layout.Timestamp(payload));
    plumbline::model::RobotState state;
    layout.RobotStateFromPackage(payload, state);
    Require(state.q.size() == 6);
  }
  static_cast<void>(Accepted(payload));
  static_cast<void>(ControllerVersionFrom(payload));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes stream(data, size);
  Judge(stream);
  while (true) {
    const Frame frame = FirstFrame(stream);
    if (frame.state != Frame::State::kComplete) {
      Require(frame.state == Frame::State::kMalformed || stream.size() < kMaxFrameBytes);
      break;
    }
    Require(frame.size >= kHeaderBytes && frame.payload.size() == frame.size - kHeaderBytes);
    Judge(frame.payload);
    stream = stream.subspan(frame.size);
  }
  return 0;
}
