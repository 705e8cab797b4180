#include "tests/virtual_cell/virtual_cell.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace virtual_cell {
namespace {

bool SameInputs(const WorldInputs& a, const WorldInputs& b) {
  return a.q.size() == b.q.size() && a.q == b.q && a.payload_kg == b.payload_kg &&
         a.temperature_C == b.temperature_C && std::abs(a.time_s - b.time_s) < 0.1;
}

std::vector<double> Numbers(std::istringstream& text) {
  std::vector<double> numbers;
  for (double number = 0; text >> number;) numbers.push_back(number);
  return numbers;
}

}  // namespace

VirtualCell::VirtualCell(World world, MotionProgram program, VirtualCellOptions options)
    : options_(std::move(options)),
      world_(std::move(world)),
      controller_(world_.cell(), program.home, options_.limits),
      runner_(std::move(program), options_.hold_at),
      robot_bank_(LayoutOf(options_.profile).size),
      tracker_(options_.tracker_noise_mm, options_.reflectors_T,
               options_.tracker_noise_of_standstill, options_.tracker_seed),
      commands_(options_.profile, runner_.program()),
      robot_server_(options_.address, options_.port, robot_bank_,
                    LayoutOf(options_.profile).first_open, LayoutOf(options_.profile).last_open),
      tracker_server_(options_.address, options_.tracker_port, tracker_.bank(), 1, 0),
      replaying_(!options_.replay.empty()) {}

void VirtualCell::Step(double now_s, double wait_s, int extra_socket) {
  if (!started_s_) started_s_ = now_s;
  fd_set readable;
  FD_ZERO(&readable);
  int highest = -1;
  const LinkFaults no_faults;
  robot_server_.Watch(readable, highest, wall_s_, faults_);
  tracker_server_.Watch(readable, highest, wall_s_, no_faults);
  if (extra_socket >= 0) {
    FD_SET(extra_socket, &readable);
    highest = std::max(highest, extra_socket);
  }
  timeval timeout{0, static_cast<suseconds_t>(wait_s * 1e6)};
  if (::select(highest + 1, &readable, nullptr, nullptr, &timeout) < 0) FD_ZERO(&readable);

  const double before = wall_s_;
  wall_s_ = now_s - *started_s_;
  Advance((wall_s_ - before) * options_.time_scale);
  robot_server_.Serve(readable, wall_s_, faults_);
  LinkFaults none;
  tracker_server_.Serve(readable, wall_s_, none);
}

void VirtualCell::Advance(double dt) {
  time_s_ += dt;
  if (replaying_) {
    PlayRows();
  } else {
    controller_.Advance(dt);
    if (!options_.idle) runner_.Advance(dt, controller_);
    commands_.Serve(Remote(), controller_, robot_bank_);
  }
  const WorldInputs now{controller_.q(), controller_.last_move(), controller_.payload_kg(),
                        Temperature(), time_s_};
  if (!SameInputs(now, last_)) {
    truth_ = world_.Settle(now);
    last_ = now;
  }
  ++cycle_;
  ReportedState reported = Reported();
  faults_.Corrupt(reported);
  WriteState(options_.profile, reported, robot_bank_);
  tracker_.Measure(truth_, last_, !controller_.Moving());
}

void VirtualCell::PlayRows() {
  const auto last = options_.replay.size() - 1;
  const auto index = static_cast<std::size_t>(time_s_ * options_.row_rate_hz);
  const ReplayRow& row = options_.replay[std::min(index, last)];
  controller_.SetJoints(row.q);
  if (row.payload_kg) controller_.AttachPayload(*row.payload_kg);
  if (row.temperature_C) console_temperature_C_ = row.temperature_C;
}

double VirtualCell::Temperature() const {
  if (console_temperature_C_) return *console_temperature_C_;
  const auto& curve = options_.temperature;
  if (curve.empty()) return world_.cell().reference_temperature_C;
  const auto after = std::find_if(curve.begin(), curve.end(),
                                  [this](const auto& knot) { return knot.first > time_s_; });
  if (after == curve.begin()) return curve.front().second;
  if (after == curve.end()) return curve.back().second;
  const auto before = after - 1;
  const double share = (time_s_ - before->first) / (after->first - before->first);
  return before->second + share * (after->second - before->second);
}

ReportedState VirtualCell::Reported() const {
  const Motion tip = controller_.NominalTipPose();
  const bool loaded = controller_.payload_kg() > 0;
  return {.q = controller_.q(),
          .speed = controller_.speed(),
          .tip_B = tip.translation(),
          .tip_rotation = VectorFromRotation(tip.linear()),
          .tcp_offset_F = controller_.cell().tip_F,
          .payload_kg = controller_.payload_kg(),
          .payload_cog_F = controller_.cell().payload_cog_F,
          .tool_number = loaded ? runner_.program().tool_number : 0,
          .temperature_C = last_.temperature_C,
          .moving = controller_.Moving(),
          .sequence = cycle_};
}

std::string VirtualCell::Execute(const std::string& line) {
  std::istringstream text(line);
  std::string verb;
  text >> verb;
  if (verb == "quit") {
    quit_ = true;
    return "ok";
  }
  if (verb == "fault") {
    std::string words;
    std::getline(text >> std::ws, words);
    const std::string wrong = SetFault(words, wall_s_, faults_);
    return wrong.empty() ? "ok" : "error: " + wrong;
  }
  const std::vector<double> numbers = Numbers(text);
  if (verb == "payload" && numbers.size() == 1 && numbers[0] >= 0) {
    controller_.AttachPayload(numbers[0]);
    return "ok";
  }
  if (verb == "temperature" && numbers.size() == 1) {
    console_temperature_C_ = numbers[0];
    return "ok";
  }
  MoveAnswer answer = MoveAnswer::kUnreachable;
  if (verb == "home") {
    answer = controller_.MoveToJoints(runner_.program().home);
  } else if (verb == "joints" && numbers.size() == static_cast<std::size_t>(world_.cell().size())) {
    Joints q(world_.cell().size());
    for (int i = 0; i < q.size(); ++i) q[i] = RadFromDeg(numbers[static_cast<std::size_t>(i)]);
    answer = controller_.MoveToJoints(q);
  } else if (verb == "move" && numbers.size() == 6) {
    const Vec3 xyz(numbers[0], numbers[1], numbers[2]);
    const Vec3 turn_deg(numbers[3], numbers[4], numbers[5]);
    answer = controller_.MoveToPose(MotionFromXyzVector(xyz * 1e-3, turn_deg * RadFromDeg(1)));
  } else {
    return fmt::format(
        "error: '{}' is none of: move X Y Z RX RY RZ (mm, deg), joints DEG.., home, payload KG, "
        "temperature C, fault .., quit",
        line);
  }
  if (answer == MoveAnswer::kAccepted) return "ok";
  return answer == MoveAnswer::kUnreachable ? "error: unreachable" : "error: outside limits";
}

}  // namespace virtual_cell
