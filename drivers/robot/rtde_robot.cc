#include "drivers/robot/rtde_robot.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "drivers/os/await.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline::robot {
namespace {

using rtde::Bytes;
using rtde::Message;
using rtde::Output;

constexpr std::size_t kMaxNotices_bytes = 800;  // that wait to be taken; a line each
constexpr double kLeastReply_s = 0.5;    // a setup takes the controller longer than a package
constexpr double kRateInterval_s = 60;   // over which packages are counted
constexpr double kLeastRateShare = 0.9;  // of the packages; fewer are reported
constexpr double kSilentPeriods = 5;     // without a package, until the link counts as lost

/// Name of a field of the recipe.
std::string RecipeName(Output field, const RtdeSettings& settings) {
  const auto name = std::string(rtde::OutputFields()[static_cast<std::size_t>(field)].name);
  if (field == Output::kToolNumber) return name + std::to_string(*settings.tool_number_register);
  if (field == Output::kPayloadItem) return name + std::to_string(*settings.payload_item_register);
  return name;
}

/// The fields that the settings ask for.
std::vector<Output> WantedOutputs(const RtdeSettings& settings) {
  std::vector<Output> wanted;
  for (const rtde::OutputField& field : rtde::OutputFields()) {
    const bool is_register =
        field.field == Output::kToolNumber || field.field == Output::kPayloadItem;
    const bool listed = std::find(settings.fields.begin(), settings.fields.end(), field.name) !=
                        settings.fields.end();
    const bool has_register =
        (field.field == Output::kToolNumber && settings.tool_number_register) ||
        (field.field == Output::kPayloadItem && settings.payload_item_register);
    if (is_register ? has_register : field.required || listed) wanted.push_back(field.field);
  }
  return wanted;
}

std::string RecipeNames(const std::vector<Output>& fields, const RtdeSettings& settings) {
  std::string names;
  for (const Output field : fields)
    names += (names.empty() ? "" : ",") + RecipeName(field, settings);
  return names;
}

LinkResult ResultOfSocketError(int error) {
  switch (error) {
    case ETIMEDOUT:
      return LinkResult::kTimeout;
    case ECONNREFUSED:
    case EHOSTUNREACH:
    case ENETUNREACH:
      return LinkResult::kRefused;
    default:
      return LinkResult::kLost;
  }
}

std::vector<std::string_view> SplitNames(std::string_view names) {
  std::vector<std::string_view> parts;
  for (std::size_t at = 0; at <= names.size();) {
    const std::size_t comma = std::min(names.find(',', at), names.size());
    parts.push_back(names.substr(at, comma - at));
    at = comma + 1;
  }
  return parts;
}

}  // namespace

std::vector<std::string_view> OptionalRtdeFields() {
  std::vector<std::string_view> names;
  for (const rtde::OutputField& field : rtde::OutputFields()) {
    if (!field.required) names.push_back(field.name);
  }
  return names;
}

double SampleTime::Note(double timestamp_s, double arrival_s) {
  const double offset_s = arrival_s - timestamp_s;
  if (least_offset_s_) {
    const double grown_s = *least_offset_s_ + kDrift * std::max(0.0, arrival_s - last_arrival_s_);
    least_offset_s_ = std::min(grown_s, offset_s);
  } else {
    least_offset_s_ = offset_s;
  }
  last_arrival_s_ = arrival_s;
  return timestamp_s + *least_offset_s_;
}

Result<std::unique_ptr<RobotDevice>> RtdeRobot::Create(const TcpAddress& address,
                                                       const RtdeSettings& settings,
                                                       double timeout_s, const PushLimits& limits,
                                                       int slots, Clock clock) {
  if (!(settings.frequency_hz > 0)) {
    return Error{fmt::format("RTDE: {} packages a second is not positive", settings.frequency_hz)};
  }
  const auto known = OptionalRtdeFields();
  for (const std::string& name : settings.fields) {
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      return Error{
          fmt::format("RTDE: field \"{}\" is not one of {}", name, fmt::join(known, ", "))};
    }
  }
  for (const int first :
       {settings.tool_number_register.value_or(0), settings.payload_item_register.value_or(0),
        settings.push.first_int, settings.push.first_double}) {
    if (first < 0 || first >= rtde::kInputRegisters)
      return Error{fmt::format("RTDE: register {} is outside 0..47", first)};
  }
  if (limits.enabled && slots > rtde::SlotsOf(settings.push)) {
    return Error{fmt::format("RTDE: {} points do not fit into the registers; {} do", slots,
                             rtde::SlotsOf(settings.push))};
  }
  return std::unique_ptr<RobotDevice>(
      new RtdeRobot(address, settings, timeout_s, limits, limits.enabled ? slots : 0, clock));
}

RtdeRobot::RtdeRobot(const TcpAddress& address, const RtdeSettings& settings, double timeout_s,
                     const PushLimits& limits, int slots, Clock clock)
    : address_(address),
      settings_(settings),
      timeout_s_(timeout_s),
      clock_(clock),
      peer_(fmt::format("{}:{}", address.host, address.port)),
      received_(2 * rtde::kMaxFrameBytes),
      can_push_(slots > 0),
      limits_(limits),
      gate_(slots, limits, PushGate::Writes::kEveryRequest),
      slots_(static_cast<std::size_t>(slots)),
      input_frame_(rtde::InputFrameBytes(static_cast<std::size_t>(slots))) {}

// Connection.

LinkResult RtdeRobot::Connect() {
  LinkResult result = OpenSocket();
  if (result == LinkResult::kOk) result = NegotiateVersion();
  if (result == LinkResult::kOk) result = NoteControllerVersion();
  if (result == LinkResult::kOk) result = SetUpOutputs();
  if (result == LinkResult::kOk && can_push_) result = SetUpInputs();
  if (result == LinkResult::kOk) result = StartOrPause(Message::kStart);
  if (result != LinkResult::kOk) return result;
  has_package_ = false;
  sample_time_.Reset();
  last_package_s_ = rate_since_s_ = clock_();
  packages_ = 0;
  gate_.Reset();
  return LinkResult::kOk;
}

LinkResult RtdeRobot::OpenSocket() {
  begin_ = end_ = 0;
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int failed =
      getaddrinfo(address_.host.c_str(), std::to_string(address_.port).c_str(), &hints, &found);
  if (failed != 0) {
    return Fail(LinkResult::kUnknownName,
                fmt::format("the name is not known ({}); check robot.host, or give the address",
                            gai_strerror(failed)));
  }
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> owned(found, freeaddrinfo);
  int error = EHOSTUNREACH;
  for (const addrinfo* a = found; a != nullptr && !socket_; a = a->ai_next) {
    os::Descriptor opened(
        socket(a->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, a->ai_protocol));
    if (!opened) {
      error = errno;
      continue;
    }
    error = connect(opened.get(), a->ai_addr, a->ai_addrlen) == 0 ? 0 : errno;
    if (error == EINPROGRESS) {
      socklen_t size = sizeof error;
      if (!os::Await(opened.get(), POLLOUT, MonotonicSeconds() + timeout_s_)) {
        error = ETIMEDOUT;
      } else if (getsockopt(opened.get(), SOL_SOCKET, SO_ERROR, &error, &size) != 0) {
        error = errno;
      }
    }
    if (error == 0) socket_ = std::move(opened);
  }
  if (!socket_) return FailWith(error);
  const int on = 1;
  setsockopt(socket_.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  return LinkResult::kOk;
}

LinkResult RtdeRobot::NegotiateVersion() {
  for (version_ = 2; version_ >= 1; --version_) {
    Bytes payload;
    const LinkResult result = Exchange(rtde::VersionRequest(static_cast<std::uint16_t>(version_)),
                                       Message::kVersion, payload);
    if (result != LinkResult::kOk) return result;
    if (rtde::Accepted(payload) == true) return LinkResult::kOk;
  }
  return Fail(LinkResult::kNotAccepted,
              "the controller accepts neither version 2 nor 1 of RTDE: update its software, or use "
              "transport \"tcp\"");
}

LinkResult RtdeRobot::NoteControllerVersion() {
  Bytes payload;
  const LinkResult result =
      Exchange(rtde::MessageOf(Message::kController), Message::kController, payload);
  if (result != LinkResult::kOk) return result;
  const auto version = rtde::ControllerVersionFrom(payload);
  if (!version) return Fail(LinkResult::kProtocol, "the controller's version is not four numbers");
  controller_ = *version;
  return LinkResult::kOk;
}

LinkResult RtdeRobot::SetUpOutputs() {
  std::vector<Output> fields = WantedOutputs(settings_);
  std::string left_out;
  // A recipe with an unknown field is refused as a whole: it is requested again without it.
  for (int attempt = 0; attempt < 2; ++attempt) {
    Bytes payload;
    const LinkResult result = Exchange(
        rtde::OutputsRequest(version_, settings_.frequency_hz, RecipeNames(fields, settings_)),
        Message::kOutputs, payload);
    if (result != LinkResult::kOk) return result;
    const auto reply = rtde::RecipeReplyFrom(payload, version_ >= 2);
    if (!reply || reply->types.size() != fields.size()) {
      return Fail(LinkResult::kProtocol,
                  fmt::format("the reply to {} output fields names {} types", fields.size(),
                              reply ? reply->types.size() : 0));
    }
    std::vector<Output> offered;
    for (std::size_t k = 0; k < fields.size(); ++k) {
      const rtde::OutputField& field = rtde::OutputFields()[static_cast<std::size_t>(fields[k])];
      const std::string& type = reply->types[k];
      const std::string name = RecipeName(fields[k], settings_);
      if (type == field.type) {
        offered.push_back(fields[k]);
      } else if (type != "NOT_FOUND") {
        return Fail(LinkResult::kProtocol, fmt::format("{} is of type \"{}\" instead of {}", name,
                                                       type.substr(0, 32), field.type));
      } else if (field.required) {
        return Fail(LinkResult::kNotAccepted,
                    fmt::format("the controller (software {}.{}) has no output field {}: {}",
                                controller_.major, controller_.minor, name,
                                fields[k] >= Output::kToolNumber
                                    ? "use another register in [robot]"
                                    : "update its software, or use transport \"tcp\""));
      } else {
        left_out += (left_out.empty() ? "" : ", ") + name;
      }
    }
    if (offered.size() == fields.size()) {
      if (version_ >= 2 && reply->id == 0)
        return Fail(LinkResult::kNotAccepted, "the controller refuses the output fields");
      layout_ = rtde::OutputLayout(fields, version_, reply->id);
      if (left_out != reported_fields_) {
        reported_fields_ = left_out;
        if (!left_out.empty()) {
          AddNotice(fmt::format("controller software {}.{} has no {}: read without",
                                controller_.major, controller_.minor, left_out));
        }
      }
      return LinkResult::kOk;
    }
    fields = std::move(offered);
  }
  return Fail(LinkResult::kProtocol, "the controller withdraws fields that it has offered");
}

LinkResult RtdeRobot::SetUpInputs() {
  const std::string names = rtde::InputNames(settings_.push, static_cast<int>(slots_.size()));
  inputs_id_ = 0;
  inputs_tried_s_ = clock_();
  Bytes payload;
  const LinkResult result = Exchange(rtde::InputsRequest(names), Message::kInputs, payload);
  if (result != LinkResult::kOk) return result;
  const auto reply = rtde::RecipeReplyFrom(payload, true);
  const std::vector<std::string_view> fields = SplitNames(names);
  if (!reply || reply->types.size() != fields.size())
    return Fail(LinkResult::kProtocol, "the reply to the input registers has another length");
  const auto refuse = [this](std::string_view why) {
    const auto written =
        fmt::format_to_n(inputs_problem_.begin(), inputs_problem_.size(), "{}", why);
    inputs_problem_size_ = std::min(written.size, inputs_problem_.size());
    return LinkResult::kOk;
  };
  for (std::size_t k = 0; k < fields.size(); ++k) {
    const std::string& type = reply->types[k];
    if (type == "IN_USE") {
      return refuse(fmt::format(
          "{} is in use by another client of the controller: stop it or its fieldbus, or set "
          "robot.rtde_first_int and rtde_first_double to free registers",
          fields[k]));
    }
    if (type == "NOT_FOUND") {
      return refuse(
          fmt::format("the controller has no {}: set robot.rtde_first_int and rtde_first_double to "
                      "registers that it has, or push fewer points",
                      fields[k]));
    }
    const bool is_int = fields[k].find("_int_") != std::string_view::npos;
    if (type != (is_int ? "INT32" : "DOUBLE")) {
      return Fail(LinkResult::kProtocol,
                  fmt::format("{} is of type \"{}\"", fields[k], type.substr(0, 32)));
    }
  }
  if (reply->id == 0) return refuse("the controller refuses the input registers");
  inputs_id_ = reply->id;
  return LinkResult::kOk;
}

LinkResult RtdeRobot::StartOrPause(Message message) {
  Bytes payload;
  const LinkResult result = Exchange(rtde::MessageOf(message), message, payload);
  if (result != LinkResult::kOk) return result;
  if (rtde::Accepted(payload) == true) return LinkResult::kOk;
  return Fail(LinkResult::kNotAccepted,
              message == Message::kStart
                  ? "the controller refuses to start sending: look at its log for the reason"
                  : "the controller refuses to pause");
}

LinkResult RtdeRobot::RetryInputs() {
  LinkResult result = StartOrPause(Message::kPause);
  if (result == LinkResult::kOk) result = SetUpInputs();
  if (result == LinkResult::kOk) result = StartOrPause(Message::kStart);
  last_package_s_ = clock_();
  gate_.Reset();
  return result;
}

LinkResult RtdeRobot::Exchange(Bytes request, Message type, Bytes& payload) {
  LinkResult result = Send(request);
  const double until_s = MonotonicSeconds() + std::max(timeout_s_, kLeastReply_s);
  while (result == LinkResult::kOk) {
    rtde::Frame frame;
    result = Next(frame);
    if (result != LinkResult::kOk) break;
    if (frame.state == rtde::Frame::State::kComplete) {
      if (frame.type == type) {
        payload = frame.payload;
        return LinkResult::kOk;
      }
      // Otherwise a text, or a package of before a pause.
      if (frame.type == Message::kText) NoteText(frame.payload);
      if (MonotonicSeconds() < until_s) continue;
    }
    if (MonotonicSeconds() >= until_s || !os::Await(socket_.get(), POLLIN, until_s)) {
      return Fail(LinkResult::kTimeout,
                  fmt::format("no reply to RTDE message '{}' in time: is robot.port that of RTDE "
                              "(30004)?",
                              static_cast<char>(type)));
    }
    std::size_t count = 0;
    result = Receive(count);
  }
  return result;
}

LinkResult RtdeRobot::Send(Bytes bytes) {
  const auto sent = send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
  if (sent == static_cast<ssize_t>(bytes.size())) return LinkResult::kOk;
  return FailWith(sent < 0 && errno != EAGAIN ? errno : ETIMEDOUT);
}

LinkResult RtdeRobot::Receive(std::size_t& count) {
  count = 0;
  if (begin_ > 0) {
    std::memmove(received_.data(), received_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  const auto got = recv(socket_.get(), received_.data() + end_, received_.size() - end_, 0);
  if (got > 0) {
    count = static_cast<std::size_t>(got);
    end_ += count;
    return LinkResult::kOk;
  }
  if (got < 0 && (errno == EAGAIN || errno == EINTR)) return LinkResult::kOk;
  return FailWith(got == 0 ? ECONNRESET : errno);
}

LinkResult RtdeRobot::Next(rtde::Frame& frame) {
  frame = rtde::FirstFrame(Bytes(received_).subspan(begin_, end_ - begin_));
  if (frame.state == rtde::Frame::State::kMalformed) {
    return Fail(LinkResult::kProtocol,
                fmt::format("a message of {} bytes is not RTDE: is robot.port that of RTDE "
                            "(30004)?",
                            frame.size));
  }
  if (frame.state == rtde::Frame::State::kComplete) begin_ += frame.size;
  return LinkResult::kOk;
}

// Reading.

LinkResult RtdeRobot::Read(model::RobotState& state) {
  if (!socket_) {
    if (!back_off_.Due(clock_())) return LinkResult::kWaiting;
    if (const LinkResult result = Connect(); result != LinkResult::kOk) return result;
  }
  const double silent_s = std::max(timeout_s_, kSilentPeriods / settings_.frequency_hz);
  const double until_s = MonotonicSeconds() + silent_s;
  std::size_t total = 0;
  fresh_ = false;
  while (true) {
    std::size_t count = 0;
    LinkResult result = Receive(count);
    rtde::Frame frame;
    while (result == LinkResult::kOk) {
      result = Next(frame);
      if (result != LinkResult::kOk || frame.state != rtde::Frame::State::kComplete) break;
      if (frame.type == Message::kData) NotePackage(frame.payload);
      if (frame.type == Message::kText) NoteText(frame.payload);
    }
    if (result != LinkResult::kOk) return result;
    total += count;
    if (count > 0 && total < kMaxBytesPerRead) continue;
    if (has_package_ || MonotonicSeconds() >= until_s) break;
    if (!os::Await(socket_.get(), POLLIN, until_s)) break;
  }
  const double now_s = clock_();
  if (!has_package_ || now_s - last_package_s_ > silent_s) {
    return Fail(LinkResult::kTimeout,
                fmt::format("no data package that fits its recipe for {:.2g} s: check the cable, "
                            "and that the controller is not overloaded",
                            now_s - last_package_s_));
  }
  if (fresh_) {
    back_off_.Well();
    ReportRate();
  }
  state = state_;
  return LinkResult::kOk;
}

void RtdeRobot::NotePackage(Bytes payload) {
  if (!layout_.Fits(payload)) return;
  const double now_s = clock_();
  const double timestamp_s = layout_.Timestamp(payload);
  if (has_package_ && timestamp_s < last_timestamp_s_) {
    AddNotice("the controller was restarted: its clock went back");
    sample_time_.Reset();
  }
  last_timestamp_s_ = timestamp_s;
  layout_.RobotStateFromPackage(payload, state_);
  // A faster package corrects the estimate, but time does not go back.
  state_.timestamp_s = std::max(state_.timestamp_s, sample_time_.Note(timestamp_s, now_s));
  state_.sequence = ++sequence_;
  last_package_s_ = now_s;
  ++packages_;
  has_package_ = fresh_ = true;
}

/// Reports once per interval that the controller sends fewer packages than it was asked for.
void RtdeRobot::ReportRate() {
  const double spent_s = last_package_s_ - rate_since_s_;
  if (spent_s < kRateInterval_s) return;
  const double wanted = spent_s * settings_.frequency_hz;
  if (static_cast<double>(packages_) < kLeastRateShare * wanted) {
    AddNotice(
        fmt::format("the controller sent {} of {:.0f} data packages in {:.0f} s: it is busy, "
                    "or robot.rtde_hz is more than it can",
                    packages_, wanted, spent_s));
  }
  rate_since_s_ = last_package_s_;
  packages_ = 0;
}

void RtdeRobot::NoteText(Bytes payload) {
  const auto text = rtde::TextFrom(payload, version_);
  if (text && !text->empty()) AddNotice("message of the controller: " + *text);
}

void RtdeRobot::AddNotice(std::string_view text) {
  if (notice_.size() + text.size() + 1 > kMaxNotices_bytes) return;
  if (notice_.find(text) != std::string::npos) return;
  notice_ += text;
  notice_ += '\n';
}

std::string_view RtdeRobot::TakeNotice() {
  const std::size_t end = notice_.find('\n');
  if (end == std::string::npos) return {};
  taken_notice_.assign(notice_, 0, end);
  notice_.erase(0, end + 1);
  return taken_notice_;
}

// Corrected points.

LinkResult RtdeRobot::Push(std::span<const PushPoint> points) {
  if (!can_push_) return Refuse(LinkResult::kPushRefused, "push is not enabled");
  if (!socket_) return LinkResult::kWaiting;
  const double now_s = clock_();
  if (inputs_id_ == 0) {
    if (now_s - inputs_tried_s_ >= kInputsRetry_s) {
      if (const LinkResult result = RetryInputs(); result != LinkResult::kOk) return result;
    }
    if (inputs_id_ == 0) {
      return Refuse(LinkResult::kPushRefused,
                    std::string_view(inputs_problem_.data(), inputs_problem_size_));
    }
  }
  const PushPoint* jumped = nullptr;
  double jump_m = 0;
  for (const PushPoint& point : points) {
    if (point.slot < 0 || point.slot >= static_cast<int>(slots_.size())) continue;
    rtde::InputSlot& slot = slots_[static_cast<std::size_t>(point.slot)];
    const Vec3& p = point.X_BT.p;
    const Vec3 turn = VectorFromRotation(point.X_BT.R);
    PushPoint usable = point;
    usable.valid = point.valid && p.allFinite() && turn.allFinite();
    const PushDecision decision = gate_.Next(std::span(&usable, 1), now_s);
    switch (decision.action) {
      case PushDecision::Action::kNothing:
        break;
      case PushDecision::Action::kHold:
        jumped = &point;
        jump_m = decision.step_m;
        [[fallthrough]];
      case PushDecision::Action::kWithdraw:
        slot.sequence = 0;
        gate_.Withdrawn(point.slot, now_s);
        break;
      case PushDecision::Action::kWrite: {
        slot.pose = {p.x(), p.y(), p.z(), turn.x(), turn.y(), turn.z()};
        slot.id = point.id;
        slot.radius_um = rtde::RadiusInMicrometres(point.radius_m);
        last_sequence_ =
            last_sequence_ == std::numeric_limits<std::int32_t>::max() ? 1 : last_sequence_ + 1;
        slot.sequence = last_sequence_;
        gate_.Written(point, now_s);
        break;
      }
    }
  }
  if (const LinkResult result = SendInputs(); result != LinkResult::kOk) return result;
  if (jumped == nullptr) return LinkResult::kOk;
  return Refuse(LinkResult::kPushRefused,
                fmt::format("point {} in slot {} moved by {:.3f} mm, more than {:.3f} mm: "
                            "withdrawn until it is steady",
                            jumped->id, jumped->slot, 1e3 * jump_m, 1e3 * limits_.max_step_m));
}

LinkResult RtdeRobot::SendInputs() {
  heartbeat_ = heartbeat_ == std::numeric_limits<std::int32_t>::max() ? 1 : heartbeat_ + 1;
  rtde::WriteInputFrame(inputs_id_, heartbeat_, slots_, input_frame_);
  return Send(input_frame_);
}

LinkResult RtdeRobot::WithdrawAll(double within_s) {
  if (!can_push_ || heartbeat_ == 0) return LinkResult::kOk;
  if (!socket_ || inputs_id_ == 0) return LinkResult::kWaiting;
  for (std::size_t k = 0; k < slots_.size(); ++k) {
    slots_[k].sequence = 0;
    gate_.Withdrawn(static_cast<int>(k), clock_());
  }
  LinkResult result = SendInputs();
  // The reply to a pause proves that the package before it was taken; a connection that is closed
  // while packages are still on their way is reset, and may lose it.
  if (result == LinkResult::kOk) result = Send(rtde::MessageOf(Message::kPause));
  const double until_s = MonotonicSeconds() + within_s;
  for (bool paused = false; result == LinkResult::kOk && !paused;) {
    rtde::Frame frame;
    result = Next(frame);
    paused = frame.state == rtde::Frame::State::kComplete && frame.type == Message::kPause;
    if (result != LinkResult::kOk || frame.state == rtde::Frame::State::kComplete) continue;
    std::size_t count = 0;
    result = MonotonicSeconds() < until_s && os::Await(socket_.get(), POLLIN, until_s)
                 ? Receive(count)
                 : Fail(LinkResult::kTimeout, "the controller does not confirm the withdrawal");
  }
  socket_.Reset();
  inputs_id_ = 0;
  return result;
}

// Failures.

LinkResult RtdeRobot::Refuse(LinkResult result, std::string_view text) {
  const auto written = fmt::format_to_n(problem_.begin(), problem_.size(), "{}", text);
  problem_size_ = std::min(written.size, problem_.size());
  return result;
}

LinkResult RtdeRobot::Fail(LinkResult result, std::string_view text) {
  const auto written = fmt::format_to_n(problem_.begin(), problem_.size(), "{}: {}", peer_, text);
  problem_size_ = std::min(written.size, problem_.size());
  socket_.Reset();
  inputs_id_ = 0;
  back_off_.Failed(clock_());
  return result;
}

LinkResult RtdeRobot::FailWith(int error) {
  return Fail(ResultOfSocketError(error), std::strerror(error));
}

}  // namespace plumbline::robot
