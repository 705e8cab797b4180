// Registers 660..677: corrections inside the motion.
#include <array>

#include "drivers/plc/register_values.h"

namespace plumbline::plc {
namespace {

using enum FieldType;

const status::MotionLinkStatus& Link(Source s) {
  return s.environment.motion_link;
}

double Ignored(Source s) {
  const status::MotionLinkStatus& link = Link(s);
  return static_cast<double>(link.foreign + link.malformed + link.out_of_order);
}

const std::array kMotionLinkFields = {
    MapField{660, kU16, "motion_link_state", "code",
             "0 off, 1 the controller sends nothing, 2 answering with an offset that is 0 or "
             "returns to 0, 3 correcting, 4 not answering until the stream ends, 5 UDP port not "
             "open",
             [](Source s) { return static_cast<double>(Link(s).state); }},
    MapField{661, kU16, "motion_link_obstacle", "code",
             "why it does not correct: motion.md, \"Why nothing is corrected\"; 0: it corrects",
             [](Source s) { return static_cast<double>(Link(s).obstacle); }},
    MapField{662, kFloat, "motion_link_offset", "mm", "size of the offset in the latest answer",
             [](Source s) { return kMmPerMetre * Link(s).offset_m; }},
    MapField{
        664, kFloat, "motion_link_wanted", "mm",
        "size of the offset that the model demands, also while it is not applied; 0: none is known",
        [](Source s) { return kMmPerMetre * Link(s).wanted_m; }},
    MapField{666, kU32, "motion_link_answered", "", "packets answered since the link started",
             [](Source s) { return static_cast<double>(Link(s).answered); }},
    MapField{668, kU32, "motion_link_lost", "", "packets that were missing before another one",
             [](Source s) { return static_cast<double>(Link(s).lost); }},
    MapField{670, kU32, "motion_link_ignored", "",
             "packets from another address, of another form, repeated or out of order", Ignored},
    MapField{672, kU32, "motion_link_late", "",
             "late answers as the controller counts them, if it sends the number",
             [](Source s) { return static_cast<double>(Link(s).late); }},
    MapField{674, kU32, "motion_link_longest", "us",
             "longest time from a packet's arrival to its answer",
             [](Source s) { return 1e6 * Link(s).longest_answer_s; }},
    MapField{676, kU32, "motion_link_streams", "",
             "streams of the controller that were answered since the link started",
             [](Source s) { return static_cast<double>(Link(s).streams); }},
};

}  // namespace

std::span<const MapField> registers::MotionLinkFields() {
  return kMotionLinkFields;
}

}  // namespace plumbline::plc
