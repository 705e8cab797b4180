#include "drivers/zoom/visca_zoom.h"

#include <fmt/format.h>

#include <utility>

#include "drivers/os/serial_line.h"
#include "drivers/zoom/registry.h"

namespace plumbline::zoom {
namespace {

using visca::Reply;

using visca::Transport;

std::string BaudFault(ZoomConnection& to) {
  return to.visca.baud == 9600 || to.visca.baud == 38400 ? "" : "is not 9600 or 38400";
}

/// Of the key `device`, which is read before `transport`.
std::string DeviceFault(ZoomConnection& to) {
  if (to.visca.device.empty()) return "";  // reported as missing
  const auto address = visca::AddressFrom(to.visca.device, "");
  return address ? "" : address.error();
}

std::string TransportFault(ZoomConnection& to) {
  const ViscaOptions& visca = to.visca;
  if (visca.device.empty() || !visca::AddressFrom(visca.device, "")) return "";
  const auto address = visca::AddressFrom(visca.device, visca.transport);
  return address ? "" : fmt::format("does not suit device: {} {}", visca.device, address.error());
}

/// Faultless options only.
visca::Address AddressOf(const ViscaOptions& options) {
  const auto address = visca::AddressFrom(options.device, options.transport);
  return address ? *address : visca::Address{};
}

constexpr ZoomOption kViscaOptions[] = {
    {.key = "device",
     .value = [](ZoomConnection& to) -> std::string& { return to.visca.device; },
     .description = "for \"visca\", like the next five, and \"v4l2\": device, or the address of a "
                    "camera with VISCA over IP",
     .example = "\"/dev/serial/by-id/...\"",
     .default_text = "for \"v4l2\": the camera's",
     .required = true,
     .fault = DeviceFault},
    {.key = "transport",
     .value = [](ZoomConnection& to) -> std::string& { return to.visca.transport; },
     .description = "\"serial\"; for an address in the network \"udp\" or \"tcp\" (without header)",
     .example = "\"serial\"",
     .default_text = "\"serial\" for a path, \"udp\" for an address",
     .fault = TransportFault},
    {.key = "baud",
     .value = [](ZoomConnection& to) -> int& { return to.visca.baud; },
     .min = 9600,
     .max = 38400,
     .description = "9600 or 38400 bit/s",
     .fault = BaudFault},
    {.key = "address",
     .value = [](ZoomConnection& to) -> int& { return to.visca.address; },
     .min = 1,
     .max = visca::kMaxCameras,
     .description = "VISCA address of the camera"},
    {.key = "timeout_ms",
     .value = [](ZoomConnection& to) -> double& { return to.visca.timeout_s; },
     .min = 10,
     .max = 10000,
     .to_si = kSecondPerMs,
     .description = "timeout of one request, also for \"hid\""},
    {.key = "optical_max_counts",
     .value = [](ZoomConnection& to) -> int& { return to.visca.optical_max_counts; },
     .min = 1,
     .max = 1 << 24,
     .description = "end of the optical range; the digital zoom beyond it is never calibrated"},
};

}  // namespace

Result<std::unique_ptr<ZoomSensor>> ViscaZoom::Create(const ViscaOptions& options, Clock clock) {
  if (const std::string fault = os::FaultOf({.baud = options.baud}); !fault.empty()) {
    return Error{"visca: " + fault};
  }
  if (options.address < 1 || options.address > visca::kMaxCameras) {
    return Error{fmt::format("visca: address {} is outside 1..7", options.address)};
  }
  if (!(options.timeout_s >= 0.01 && options.timeout_s <= 10)) {
    return Error{fmt::format("visca: timeout {} s is outside 0.01..10", options.timeout_s)};
  }
  const auto address = visca::AddressFrom(options.device, options.transport);
  if (!address) return Error{fmt::format("visca: device {} {}", options.device, address.error())};
  return std::unique_ptr<ZoomSensor>(new ViscaZoom(options, *address, clock));
}

ViscaZoom::ViscaZoom(const ViscaOptions& options, const visca::Address& address, Clock clock)
    : options_(options),
      address_(address),
      clock_(clock),
      link_(MakeViscaLink(address, options.baud, clock)) {}

ZoomResult ViscaZoom::Fail(ZoomResult result, const std::string& why) {
  problem_ = fmt::format("{}: camera {}: {}", address_.Text(), options_.address, why);
  return result;
}

ZoomResult ViscaZoom::Disconnect(const std::string& why) {
  link_->Close();
  back_off_.Failed(clock_());
  return Fail(ZoomResult::kLost, why);
}

bool ViscaZoom::Open(double deadline_s) {
  if (!link_->Open(deadline_s)) {
    Disconnect(link_->problem());
    return false;
  }
  addressed_ = address_.transport != Transport::kSerial;
  has_block_ = has_focus_ = true;
  return true;
}

ZoomResult ViscaZoom::Read(lens::ZoomReading& reading) {
  const double deadline_s = clock_() + options_.timeout_s;
  if (!link_->is_open()) {
    if (!back_off_.Due(clock_())) return ZoomResult::kWaiting;
    if (!Open(deadline_s)) return ZoomResult::kLost;
  }
  ZoomResult result = Drain();
  if (result == ZoomResult::kOk && !addressed_) result = AssignAddresses(deadline_s);
  lens::ZoomReading found;
  if (result == ZoomResult::kOk) result = ReadLens(found, deadline_s);
  if (result != ZoomResult::kOk) {
    if (result != ZoomResult::kRefused) {
      addressed_ = address_.transport != Transport::kSerial;
      has_block_ = has_focus_ = true;  // another camera may answer next
    }
    return result;
  }
  back_off_.Well();
  if (*found.zoom_counts > options_.optical_max_counts) found.digital_zoom = true;
  found.time_s = clock_();
  reading = found;
  return ZoomResult::kOk;
}

/// Discards pending input, unless the link recognises what it answers; only a network change is
/// evaluated.
ZoomResult ViscaZoom::Drain() {
  if (link_->identifies_answers()) return ZoomResult::kOk;
  const double now_s = clock_();
  for (;;) {
    Reply reply;
    const Arrival arrival = link_->Receive(now_s, reply);
    if (arrival == Arrival::kLost) return Disconnect(link_->problem());
    if (arrival == Arrival::kNone) return ZoomResult::kOk;
    NoteNetworkChange(reply);
  }
}

void ViscaZoom::NoteNetworkChange(const Reply& reply) {
  if (reply.kind == Reply::Kind::kNetworkChange && address_.transport == Transport::kSerial) {
    addressed_ = false;
  }
}

ZoomResult ViscaZoom::AssignAddresses(double deadline_s) {
  Reply answer;
  const ZoomResult result = Query(visca::AddressSet(), 0, deadline_s, answer);
  if (result != ZoomResult::kOk) return result;
  if (answer.address < options_.address) {
    return Fail(ZoomResult::kRefused,
                fmt::format("only {} cameras answer on the line. Check camera.zoom.address and the "
                            "cable to the camera.",
                            answer.address));
  }
  addressed_ = has_block_ = has_focus_ = true;
  return ZoomResult::kOk;
}

ZoomResult ViscaZoom::ReadLens(lens::ZoomReading& reading, double deadline_s) {
  if (has_block_) {
    Reply answer;
    const ZoomResult result =
        Query(visca::LensBlock(options_.address), visca::kLensBlockBytes, deadline_s, answer);
    if (result == ZoomResult::kOk) {
      return visca::LensBlockFrom(answer, reading)
                 ? ZoomResult::kOk
                 : Fail(ZoomResult::kProtocol, "invalid lens block");
    }
    if (result != ZoomResult::kRefused || answer.error != 0x02) return result;
    has_block_ = false;
  }
  ZoomResult result =
      QueryPosition(visca::ZoomPosition(options_.address), deadline_s, reading.zoom_counts);
  if (result != ZoomResult::kOk) return result;
  reading.digital_zoom = *reading.zoom_counts > options_.optical_max_counts;
  if (!has_focus_) return ZoomResult::kOk;
  result = QueryPosition(visca::FocusPosition(options_.address), deadline_s, reading.focus_counts);
  if (result != ZoomResult::kRefused) return result;
  has_focus_ = false;
  return ZoomResult::kOk;
}

ZoomResult ViscaZoom::QueryPosition(const visca::Request& request, double deadline_s,
                                    std::optional<std::int32_t>& counts) {
  Reply answer;
  const ZoomResult result = Query(request, visca::kPositionBytes, deadline_s, answer);
  if (result != ZoomResult::kOk) return result;
  counts = visca::PositionFrom(answer);
  return counts ? ZoomResult::kOk : Fail(ZoomResult::kProtocol, "invalid position");
}

ZoomResult ViscaZoom::Query(const visca::Request& request, std::size_t length, double deadline_s,
                            Reply& answer) {
  if (!link_->Send(request, deadline_s)) return Disconnect(link_->problem());
  return Wait(length, deadline_s, answer);
}

ZoomResult ViscaZoom::Wait(std::size_t length, double deadline_s, Reply& answer) {
  int malformed = 0, other = 0;  // other: address of another camera that answered
  std::size_t unlike = 0;        // length of an answer that is none to this inquiry
  for (;;) {
    Reply reply;
    const Arrival arrival = link_->Receive(deadline_s, reply);
    if (arrival == Arrival::kLost) return Disconnect(link_->problem());
    if (arrival == Arrival::kNone) break;
    const bool mine = reply.address == options_.address;
    if (reply.kind == Reply::Kind::kMalformed) ++malformed;
    NoteNetworkChange(reply);
    if (length == 0 && reply.kind == Reply::Kind::kAddressed) {
      answer = reply;
      return ZoomResult::kOk;
    }
    if (!mine && reply.kind == Reply::Kind::kAnswer) other = reply.address;
    if (length == 0 || !mine) continue;
    if (reply.kind == Reply::Kind::kAnswer && reply.size == length) {
      answer = reply;
      return ZoomResult::kOk;
    }
    if (reply.kind == Reply::Kind::kAnswer) unlike = reply.size;
    if (reply.kind == Reply::Kind::kError) {
      answer = reply;
      return Fail(ZoomResult::kRefused, fmt::format("reports an error: {} ({:02X})",
                                                    visca::ErrorText(reply.error), reply.error));
    }
  }
  const std::string silence = link_->SilenceText(options_.timeout_s);
  link_->OnTimeout();
  if (!link_->is_open()) back_off_.Failed(clock_());
  if (malformed > 0) return Fail(ZoomResult::kProtocol, link_->GarbageText(malformed));
  if (other > 0) {
    problem_ =
        fmt::format("{}: camera {} does not answer, but camera {} does. Check camera.zoom.address.",
                    address_.Text(), options_.address, other);
    return ZoomResult::kTimeout;
  }
  if (unlike > 0) {
    return Fail(ZoomResult::kProtocol,
                fmt::format("answers, but not to this inquiry: {} bytes instead of {}. Its zoom is "
                            "not read. Check its model and firmware, and that no other controller "
                            "or converter shares the connection.",
                            unlike, length));
  }
  return Fail(ZoomResult::kTimeout, silence);
}

const ZoomKind kViscaKind{
    .name = "visca",
    .make = [](const ZoomConnection& to) { return ViscaZoom::Create(to.visca, to.clock); },
    .identity = [](const ZoomConnection& to) { return AddressOf(to.visca).Text(); },
    .device =
        [](const ZoomConnection& to) {
          const visca::Address address = AddressOf(to.visca);
          return Result<std::string>(address.transport == Transport::kSerial ? address.host : "");
        },
    .in_network =
        [](const ZoomConnection& to) {
          return AddressOf(to.visca).transport != Transport::kSerial;
        },
    .remedy = "plug in the adapter; add the user to the group dialout",
    .options = kViscaOptions};

}  // namespace plumbline::zoom
