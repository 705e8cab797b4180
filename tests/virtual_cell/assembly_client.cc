#include "tests/virtual_cell/assembly_client.h"

#include <fmt/core.h>

#include <chrono>
#include <stdexcept>
#include <thread>

namespace virtual_cell {
namespace {

// Register block of point k in the daemon's register map: 2000 + 20 k.
constexpr int kBlocks = 2000, kBlockSize = 20, kMaxBlocks = 500;
constexpr int kFreshRefreshes = 3;  ///< refreshes required after a move
constexpr int kResult = 100, kMonitoring = 400, kMonitoringSize = 18, kCommands = 1000,
              kCommandsSize = 40;
constexpr int kProbe = 6, kNoTrustedInput = 8, kPending = 11, kRobotMoving = 18;
constexpr int kRecording = 1, kAlarm = 2, kFailed = 32;  ///< bits of the monitoring register

using Clock = std::chrono::steady_clock;

void Sleep(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

Vec3 Floats(const RegisterBank& bank, int at) {
  return {bank.Float(at), bank.Float(at + 2), bank.Float(at + 4)};
}

}  // namespace

AssemblyClient::AssemblyClient(const AssemblyClientOptions& options, const MotionProgram& program)
    : options_(options),
      layout_(LayoutOf(options.profile)),
      robot_("robot", options.robot, options.unit, options.patience_s),
      tracker_("tracker", options.tracker, 1, options.patience_s),
      daemon_("daemon", options.daemon, options.unit, options.patience_s) {
  if (program.points.empty()) throw std::runtime_error("the program has no [[point]]");
}

void AssemblyClient::Command(int code, const Motion& X_BT) {
  const Vec3 p_mm = X_BT.translation() * 1e3, r = VectorFromRotation(X_BT.linear());
  std::vector<std::uint16_t> words =
      WordsFromFloats({p_mm.x(), p_mm.y(), p_mm.z(), r.x(), r.y(), r.z()});
  const int last = robot_.Read(layout_.command + kSequence, 1).Word(0);
  const auto next = static_cast<std::uint16_t>(last == 0xFFFF ? 1 : last + 1);
  words.push_back(static_cast<std::uint16_t>(code));
  words.push_back(0);
  robot_.Write(layout_.command, words);
  robot_.Write(layout_.command + kSequence, {next});

  const auto give_up = Clock::now() + std::chrono::duration<double>(options_.patience_s);
  while (Clock::now() < give_up) {
    const RegisterBank answer = robot_.Read(layout_.command + kSequence, 5);
    const bool ours = answer.Word(kEcho - kSequence) == next;
    if (ours && answer.Word(kFault - kSequence) != 0) {
      throw std::runtime_error(fmt::format("robot: command {} refused with fault {}", code,
                                           answer.Word(kFault - kSequence)));
    }
    if (ours && answer.Word(kDone - kSequence) == 1) return;
    Sleep(0.01);
  }
  throw std::runtime_error(fmt::format("robot: command {} did not complete", code));
}

int AssemblyClient::FindBlock(int id) {
  for (int k = 0; k < kMaxBlocks; ++k) {
    const std::optional<RegisterBank> block = daemon_.ReadIfThere(kBlocks + kBlockSize * k, 1);
    if (!block) return -1;
    if (block->Word(0) == id) return kBlocks + kBlockSize * k;
  }
  return -1;
}

AssemblyClient::Corrected AssemblyClient::AwaitCorrected(const TaughtPoint& point) {
  const int block = FindBlock(point.id);
  if (block < 0) throw std::runtime_error(fmt::format("daemon: no block for point {}", point.id));
  int refreshes = -1, last_sequence = -1, code = 0;
  const auto give_up = Clock::now() + std::chrono::duration<double>(options_.patience_s);
  while (Clock::now() < give_up) {
    const RegisterBank now = daemon_.Read(block, kBlockSize);
    const bool valid = (now.Word(1) & 1) != 0;
    code = now.Word(2);
    if (!valid) refreshes = -1;
    if (valid && now.Word(19) != last_sequence) ++refreshes;
    last_sequence = now.Word(19);
    if (refreshes >= kFreshRefreshes) {
      return {.X_BP = MotionFromXyzVector(Floats(now, 3) * 1e-3, Floats(now, 9) * RadFromDeg(1)),
              .correction_mm = now.Float(15),
              .uncertainty_mm = now.Float(17),
              .basis = (now.Word(1) >> 4) & 3,
              .extrapolated = (now.Word(1) & 2) != 0};
    }
    Sleep(0.005);
  }
  throw std::runtime_error(
      fmt::format("daemon: point {} did not become valid (result code {})", point.id, code));
}

Motion AssemblyClient::MeasureTip(int samples) {
  Sleep(options_.settle_s);
  Vec3 p_mm = Vec3::Zero(), rotation = Vec3::Zero();
  int taken = 0, last = -1;
  const auto give_up = Clock::now() + std::chrono::duration<double>(options_.patience_s);
  while (taken < samples && Clock::now() < give_up) {
    const RegisterBank seen = tracker_.Read(0, 16);
    const bool at_rest = seen.Word(13) == 1;
    if (at_rest && seen.Word(12) != last) {
      p_mm += Floats(seen, 0);
      rotation = Floats(seen, 6);
      ++taken;
    }
    last = seen.Word(12);
    Sleep(0.005);
  }
  if (taken < samples) throw std::runtime_error("tracker: the tip does not come to rest");
  return MotionFromXyzVector(p_mm * (1e-3 / taken), rotation);
}

/// Commands the tool point to X_BP. @return position measured by the tracker, in the work object
Motion AssemblyClient::Land(const TaughtPoint& point, const Motion& X_BP) {
  const Eigen::Translation3d to_tool_point(point.tool_point_T);
  Command(kMove, X_BP * to_tool_point.inverse());
  return point.X_BO.inverse() * MeasureTip(options_.samples) * to_tool_point;
}

Landing AssemblyClient::Visit(const TaughtPoint& point) {
  const auto turn_deg = [&point](const Motion& X_OP) {
    return DegFromRad(VectorFromRotation(point.X_OP.linear().transpose() * X_OP.linear()).norm());
  };
  Landing landing;
  landing.id = point.id;
  landing.name = point.name;
  landing.wanted_mm = point.X_OP.translation() * 1e3;
  const Motion uncorrected = Land(point, point.X_BO * point.X_OP);
  landing.uncorrected_mm = uncorrected.translation() * 1e3;
  landing.uncorrected_turn_deg = turn_deg(uncorrected);

  const Corrected answer = AwaitCorrected(point);
  landing.correction_mm = answer.correction_mm;
  landing.uncertainty_mm = answer.uncertainty_mm;
  landing.basis = answer.basis;
  landing.extrapolated = answer.extrapolated;
  const Motion corrected = Land(point, answer.X_BP);
  landing.corrected_mm = corrected.translation() * 1e3;
  landing.corrected_turn_deg = turn_deg(corrected);
  return landing;
}

/// Sends one command to the daemon. @return the result code
int AssemblyClient::SendProbe(const Vec3& tip_W_mm) {
  const int last = daemon_.Read(kResult, 2).Word(1);
  const auto next = static_cast<std::uint16_t>(last == 0xFFFF ? 1 : last + 1);
  std::vector<std::uint16_t> words = {kProbe, 0};
  for (const std::uint16_t word : WordsFromFloats({tip_W_mm.x(), tip_W_mm.y(), tip_W_mm.z()})) {
    words.push_back(word);
  }
  words.resize(kCommandsSize);
  words.back() = next;
  daemon_.Write(kCommands, words);
  const auto give_up = Clock::now() + std::chrono::duration<double>(options_.patience_s);
  while (Clock::now() < give_up) {
    const RegisterBank answer = daemon_.Read(kResult, 3);
    if (answer.Word(1) == next) return answer.Word(2);
    Sleep(0.005);
  }
  throw std::runtime_error("daemon: no response to a probe");
}

/// Right after start-up or a reload, the daemon refuses probes until its journal is open.
void AssemblyClient::AwaitRecording() {
  const auto give_up = Clock::now() + std::chrono::duration<double>(options_.patience_s);
  while ((daemon_.Read(kMonitoring, kMonitoringSize).Word(0) & kRecording) == 0) {
    if (Clock::now() > give_up) throw std::runtime_error("daemon: probes are not recorded");
    Sleep(0.005);
  }
}

ProbeAnswer AssemblyClient::Probe(const TaughtPoint& point) {
  Command(kMove, point.TipInBase());
  const Vec3 tip_W_mm = MeasureTip(1).translation() * 1e3;
  AwaitRecording();
  const auto recorded = [this] { return daemon_.Read(kMonitoring, kMonitoringSize).Long(4); };
  const auto before = recorded();
  const auto give_up = Clock::now() + std::chrono::duration<double>(options_.patience_s);
  int code = SendProbe(tip_W_mm);
  const auto later = [&code] {
    return code == kNoTrustedInput || code == kPending || code == kRobotMoving;
  };
  while (later() && Clock::now() < give_up) {
    Sleep(options_.settle_s);
    code = SendProbe(tip_W_mm);
  }
  if (code != 0) {
    throw std::runtime_error(
        fmt::format("daemon: the probe at {} was refused (result code {})", point.name, code));
  }
  while (recorded() == before) {
    if (Clock::now() > give_up) throw std::runtime_error("daemon: a probe was not recorded");
    Sleep(0.005);
  }
  const RegisterBank loop = daemon_.Read(kMonitoring, kMonitoringSize);
  return {.residual_W_mm = Floats(loop, 8), .alarm = (loop.Word(0) & kAlarm) != 0};
}

int AssemblyClient::AwaitProposal(double patience_s) {
  const auto give_up = Clock::now() + std::chrono::duration<double>(patience_s);
  while (Clock::now() < give_up) {
    const RegisterBank loop = daemon_.Read(kMonitoring, kMonitoringSize);
    if (loop.Word(2) != 0) return loop.Word(2);
    if ((loop.Word(0) & kFailed) != 0) {
      throw std::runtime_error("daemon: the diagnosis or the journal failed; see its log");
    }
    Sleep(0.05);
  }
  throw std::runtime_error(fmt::format("daemon: no proposal within {} s", patience_s));
}

}  // namespace virtual_cell
