#include "drivers/motion/motion_codec.h"

#include "drivers/device_kinds.h"
#include "drivers/motion/egm_codec.h"
#include "drivers/motion/rsi_codec.h"

namespace plumbline::motion_link {
namespace {

Result<std::unique_ptr<MotionCodec>> MakeRsi(const CodecSettings& settings) {
  return std::unique_ptr<MotionCodec>(std::make_unique<RsiCodec>(settings.rsi));
}

Result<std::unique_ptr<MotionCodec>> MakeEgm(const CodecSettings& settings) {
  return std::unique_ptr<MotionCodec>(std::make_unique<EgmCodec>(settings.egm_needs_running));
}

constexpr DeviceKind<MotionCodec, CodecSettings> kKinds[] = {
    {"rsi", MakeRsi},
    {"egm", MakeEgm},
};

}  // namespace

Result<std::unique_ptr<MotionCodec>> MakeMotionCodec(std::string_view kind,
                                                     const CodecSettings& settings) {
  return MakeOfKind(kKinds, "motion interface", kind, settings);
}

}  // namespace plumbline::motion_link
