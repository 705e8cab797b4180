#include "tests/motion_robots/hostile_wire.h"

#include <cmath>
#include <limits>
#include <utility>

namespace motion_robots {

HostileWire::HostileWire(Controller& controller, Client& client, WireOptions options)
    : controller_(controller), client_(client), options_(options), random_(options.seed) {
  client_.Restart(now_s_);
  Pause(500);
}

void HostileWire::Run(long cycles, int only) {
  for (long k = 0; k < cycles; ++k) Cycle(only);
}

void HostileWire::Pause(int cycles) {
  pause_ = cycles;
  late_packets_.clear();
  late_answers_.clear();
  held_.clear();
  client_held_ = wire_held_ = interrupted_ = answers_lost_ = inactive_ = 0;
  controller_.active = true;
}

void HostileWire::Cycle(int only) {
  ++cycle_;
  now_s_ += options_.cycle_s;
  if (pause_ > 0) {
    client_.Idle(now_s_);
    if (--pause_ > 0) return;
    if (renumber_) controller_.Renumber(static_cast<std::uint64_t>(Whole(1, 1 << 30)));
    renumber_ = false;
    controller_.Start();
    return;
  }
  const double phase = 0.0005 * static_cast<double>(cycle_);
  controller_.joints_deg = {8 * std::sin(phase),      20 + 8 * std::sin(1.3 * phase),
                            10 + 8 * std::sin(phase), 8 * std::sin(0.7 * phase),
                            45 + 8 * std::sin(phase), 8 * std::sin(0.9 * phase)};
  if (inactive_ > 0 && --inactive_ == 0) controller_.active = true;
  packet_ = controller_.BeginCycle();
  ++packets_;
  batches_ = {{{false, packet_}}};
  answers_ = 0;
  if (std::bernoulli_distribution(options_.trouble)(random_)) {
    const auto kind = static_cast<std::size_t>(only >= 0 ? only : Whole(0, kKinds - 1));
    ++happened_[kind];
    Disturb(kind);
    if (pause_ > 0) return;
  }
  while (!late_packets_.empty() && late_packets_.front().cycle <= cycle_) {
    const Later& late = late_packets_.front();
    batches_.insert(late.first ? batches_.begin() : batches_.end(),
                    std::vector<Client::Datagram>{{false, late.bytes}});
    late_packets_.pop_front();
  }
  if (wire_held_ > 0 || client_held_ > 0 || !held_.empty()) {
    for (const auto& batch : batches_) held_.insert(held_.end(), batch.begin(), batch.end());
    batches_.clear();
    if (wire_held_ > 0) --wire_held_;
    if (client_held_ > 0) --client_held_;
    if (wire_held_ == 0 && client_held_ == 0) batches_.push_back(std::exchange(held_, {}));
  }
  if (interrupted_ > 0) batches_.clear();
  for (const auto& batch : batches_) Deliver(batch);
  if (batches_.empty() && client_held_ == 0) client_.Idle(now_s_);
  while (!late_answers_.empty() && late_answers_.front().cycle <= cycle_) {
    if (interrupted_ == 0) controller_.Receive(late_answers_.front().bytes);
    late_answers_.pop_front();
  }
  if (interrupted_ > 0) --interrupted_;
  if (answers_lost_ > 0) --answers_lost_;
  controller_.EndCycle();
  if (controller_.offset().stopped()) Pause(Whole(12, 400));
}

void HostileWire::Deliver(const std::vector<Client::Datagram>& datagrams) {
  for (const std::string& answer : client_.Receive(datagrams, now_s_)) {
    if (answers_lost_ > 0) continue;
    if (answers_ == 1) {
      late_answers_.push_back({cycle_ + 1, answer});
      continue;
    }
    controller_.Receive(answer);
    if (answers_ == 2) controller_.Receive(answer);
    if (answers_ == 3) late_answers_.push_back({cycle_ + 1, answer});  // and once more, later
  }
}

void HostileWire::Disturb(std::size_t kind) {
  const auto number = controller_.number();
  const auto& joints = controller_.joints_deg;
  const auto replace = [&](const std::string& bytes) { batches_ = {{{false, bytes}}}; };
  const auto with_joints = [&](std::vector<double> other) {
    replace(controller_.Packet(other, number));
  };
  const auto add_first = [&](const std::string& bytes, bool foreign = false) {
    batches_.insert(batches_.begin(), std::vector<Client::Datagram>{{foreign, bytes}});
  };
  switch (kind) {
    case 0:
      return batches_.clear();
    case 1:
    case 2:
      batches_.clear();
      return late_packets_.push_back({cycle_ + (kind == 1 ? 1 : Whole(2, 8)), packet_, kind == 1});
    case 3:
      return batches_.push_back(batches_.front());
    case 4:
      batches_.clear();
      late_packets_.push_back({cycle_ + 1, packet_});
      return;
    case 5:
      wire_held_ = Whole(2, 15);
      return;
    case 6:
      return add_first("<Rob><IPOC>1</IPOC></Rob>", true);
    case 7:
      add_first(controller_.Packet(joints, number + controller_.step()), true);
      return batches_.push_back({{true, packet_}});
    case 8:
      return replace(packet_.substr(
          0, static_cast<std::size_t>(Whole(0, static_cast<int>(packet_.size()) - 1))));
    case 9:
      return replace(packet_ + std::string(60000, 'x'));
    case 10:
      return add_first(controller_.Packet(joints, number + 1000000));
    case 11:
      return add_first(controller_.Packet(
          joints, number + controller_.step() * static_cast<unsigned>(Whole(1, 4))));
    case 12:
      return replace(controller_.Packet(joints, number - controller_.step()));
    case 13:
      return replace(controller_.Packet(joints, number / 2));
    case 14: {
      std::vector<double> broken = joints;
      broken[static_cast<std::size_t>(Whole(0, 5))] =
          Whole(0, 1) == 0 ? std::numeric_limits<double>::quiet_NaN()
                           : -std::numeric_limits<double>::infinity();
      return with_joints(broken);
    }
    case 15:
      return with_joints({joints.begin(), joints.end() - 1});
    case 16:
      return with_joints({});
    case 17: {
      std::vector<double> turned = joints;
      for (double& joint : turned) joint = -joint;
      return with_joints(turned);
    }
    case 18:
      return with_joints({1e9, -1e12, 1e300, 0, 0, 0});
    case 19: {
      std::string bytes(static_cast<std::size_t>(Whole(1, 400)), ' ');
      for (char& c : bytes) c = static_cast<char>(Whole(0, 255));
      return replace(bytes);
    }
    case 20:
      return replace("");
    case 21:
      answers_lost_ = 1;
      return;
    case 22:
      answers_lost_ = Whole(2, 30);
      return;
    case 23:
    case 24:
    case 25:
      answers_ = static_cast<int>(kind) - 22;
      return;
    case 26:
      interrupted_ = Whole(2, 8);
      return;
    case 27:
      interrupted_ = Whole(12, 300);
      return;
    case 28:
    case 29:
      renumber_ = kind == 29;
      return Pause(Whole(8, Whole(0, 1) == 0 ? 16 : 400));
    case 30:
      return controller_.Renumber(0xFFFFFFFFU - controller_.step());
    case 31:
      client_held_ = Whole(2, 60);
      return;
    case 32:
      return client_.Restart(now_s_);
    case 33:
      inactive_ = Whole(1, 300);
      controller_.active = false;
      return replace(controller_.Packet(joints, number));
    case 34: {
      controller_.active = false;
      const std::string paused = controller_.Packet(joints, number);
      controller_.active = true;
      batches_ = {{{false, paused}, {false, controller_.BeginCycle()}}};
      return;
    }
    case 35: {
      controller_.Renumber(number + 5000000);
      const std::string second = controller_.BeginCycle(), third = controller_.BeginCycle();
      batches_ = {{{false, packet_}, {false, second}, {false, third}}};
      return;
    }
    default:
      return client_.Disturb(random_);
  }
}

}  // namespace motion_robots
