#include "app/cli/registers_scan.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <iostream>
#include <memory>

#include "app/base/config/cell_reader.h"
#include "app/base/config/robot_profile_reader.h"
#include "app/base/terminal/terminal_output.h"
#include "app/base/text/json_text.h"
#include "app/cli/failure.h"
#include "app/cli/number_option.h"
#include "app/cli/output_file.h"
#include "app/cli/profile_text.h"
#include "app/cli/progress.h"
#include "drivers/robot/codec.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/plausibility_filter.h"

namespace plumbline::cli {
namespace {

using robot::DecodingVerdict;
using State = DecodingVerdict::State;

constexpr double kWatchPeriod_s = 0.5;
constexpr double kSearch_s = 20;  // time for the search in one table
constexpr std::size_t kMaxImages = 60;

struct ScanOptions {
  std::string address, cell, joints, output, name = "found by a scan";
  std::vector<std::string> ranges;
  int unit = -1;
  double timeout_ms = 1000, pause_ms = 10, limit_s = 15, step_deg = 10, watch_s = 0;
  bool confirm = false, json = false, quiet = false;
};

/// What is read from the options before anything is sent.
struct Scan {
  std::string host;
  int port = 502;
  robot::SurveyOptions survey{};
  std::optional<model::JointVector> pendant{};
  double pendant_tolerance = 0;  ///< [deg] or [mm]
};

bool ReadNumber(std::string_view text, int& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size();
}

/// HOST, HOST:PORT or [ADDRESS]:PORT. @return false if the port is none
bool ReadPlace(const std::string& address, Scan& scan) {
  scan.host = address;
  const auto colon = address.rfind(':');
  const bool bracket = address.starts_with('[') && address.find(']') != address.npos;
  if (bracket) {
    scan.host = address.substr(1, address.find(']') - 1);
    if (address.back() == ']') return true;
  } else if (colon == address.npos || address.find(':') != colon) {
    return true;  // a name, or an IPv6 address without port
  } else {
    scan.host = address.substr(0, colon);
  }
  return ReadNumber(std::string_view(address).substr(colon + 1), scan.port) && scan.port > 0 &&
         scan.port < 65536;
}

/// "12.5, -95.25, .." in degrees or mm. @return why not; empty if all is well
std::string ReadPendant(const std::string& text, const kinematics::Chain& chain, Scan& scan) {
  model::JointVector q(chain.size());
  int count = 0, decimals = 0;
  std::string_view rest = text;
  while (!rest.empty()) {
    const auto end = std::min(rest.find_first_of(", ;"), rest.size());
    const std::string_view word = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (word.empty()) continue;
    const auto number = FiniteNumberFromText(word);
    if (!number) return fmt::format("\"{}\" is not a number", word);
    if (count >= chain.size()) break;
    const auto point = word.find('.');
    if (point != word.npos)  // people leave out the zeros at the end of a number
      decimals = std::max(decimals, static_cast<int>(word.size() - point - 1));
    const bool turns = chain.type(count) == model::JointType::kRevolute;
    q[count++] = *number * (turns ? kRadPerDeg : kMetrePerMm);
  }
  if (count != chain.size() || !rest.empty())
    return fmt::format("{} values are needed, one per joint of the cell", chain.size());
  scan.pendant = q;
  // A display rounds or cuts off its last digit.
  scan.pendant_tolerance = std::max(0.02, 1.1 * std::pow(10.0, -decimals));
  return "";
}

/// A step of the dialogue with --confirm: how far the joint was moved; nullopt to stop.
std::optional<double> AskForMove(const ScanOptions& options, int joint, bool turns) {
  std::cerr << fmt::format(
      "Move joint {} alone by {:+g} {}, let it stand still, and press Enter; or type how far it "
      "moved, or q to stop: ",
      joint + 1, options.step_deg, turns ? "deg" : "mm");
  std::cerr.flush();
  std::string line;
  if (!std::getline(std::cin, line)) return std::nullopt;
  while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back())) != 0)
    line.pop_back();
  const double unit = turns ? kRadPerDeg : kMetrePerMm;
  if (line.empty()) return options.step_deg * unit;
  const auto moved = FiniteNumberFromText(line);
  if (!moved || *moved == 0) return std::nullopt;
  return *moved * unit;
}

/// Which registers a move changed: "2: 4660 -> 4834, 3: ..".
std::string ChangesText(const robot::RegisterImage& before, const robot::RegisterImage& after) {
  std::vector<std::string> changes;
  std::size_t count = 0;
  for (const auto& [address, word] : after.words) {
    const auto old = before.words.find(address);
    if (old == before.words.end() || old->second == word) continue;
    if (++count <= 8) changes.push_back(fmt::format("{}: {} -> {}", address, old->second, word));
  }
  if (count == 0) return "no register changed";
  return fmt::format("{} register{} changed: {}{}", count, count == 1 ? "" : "s",
                     fmt::join(changes, ", "), count > changes.size() ? ", .." : "");
}

/// The evidence of each table, in the order of the map's images.
struct Gathered {
  std::vector<robot::DecodingEvidence> tables{};
  std::string problem{};  ///< why the gathering ended early
};

class Gathering {
 public:
  Gathering(const ScanOptions& options, robot::RegisterClient& client, const robot::DeviceMap& map,
            const deflection::LoadedArm& arm)
      : options_(options), client_(client), map_(map), arm_(arm) {}

  Gathered Run(const Scan& scan) {
    for (int tool = 0; tool < arm_.tools(); ++tool) tools_.push_back(arm_.X_FT(tool));
    gathered_.tables.resize(map_.images.size());
    for (robot::DecodingEvidence& table : gathered_.tables) table.tools = tools_;
    // The survey may have taken a minute: joints and pose of a moving robot must be of one moment.
    if (!AddImages()) return gathered_;
    if (scan.pendant) {
      for (robot::DecodingEvidence& table : gathered_.tables)
        table.pendant.push_back({0, *scan.pendant, scan.pendant_tolerance});
    }
    if (options_.watch_s > 0) Watch();
    if (options_.confirm) Confirm();
    if (options_.watch_s <= 0 && !options_.confirm && !AddImages()) return gathered_;
    return gathered_;
  }

 private:
  bool AddImages() {
    for (std::size_t k = 0; k < map_.images.size(); ++k) {
      auto image = robot::ReadAgain(client_, map_, map_.images[k]);
      if (!image) {
        gathered_.problem = image.error();
        return false;
      }
      gathered_.tables[k].images.push_back(std::move(image).value());
    }
    return true;
  }

  void Watch() {
    for (robot::DecodingEvidence& table : gathered_.tables) table.moving = true;
    Progress progress(std::cerr, options_.quiet || options_.json);
    const double start_s = MonotonicSeconds();
    while (MonotonicSeconds() - start_s < options_.watch_s && !Interruption::Requested() &&
           gathered_.tables.front().images.size() < kMaxImages && AddImages()) {
      progress.Show((MonotonicSeconds() - start_s) / options_.watch_s, "watching the registers");
      SleepSeconds(std::max(kWatchPeriod_s, options_.watch_s / static_cast<double>(kMaxImages)));
    }
  }

  void Confirm() {
    for (int joint = 0; joint < arm_.chain().size(); ++joint) {
      const bool turns = arm_.chain().type(joint) == model::JointType::kRevolute;
      const auto moved = AskForMove(options_, joint, turns);
      if (!moved || Interruption::Requested()) {
        gathered_.problem = "stopped before every axis was moved";
        return;
      }
      if (!AddImages()) return;
      for (robot::DecodingEvidence& table : gathered_.tables) {
        const std::size_t last = table.images.size() - 1;
        table.moves.push_back({last - 1, joint, *moved});
        std::cerr << fmt::format("  {}: {}\n", robot::NameOf(table.images[last].table),
                                 ChangesText(table.images[last - 1], table.images[last]));
      }
    }
  }

  const ScanOptions& options_;
  robot::RegisterClient& client_;
  const robot::DeviceMap& map_;
  const deflection::LoadedArm& arm_;
  std::vector<Pose> tools_{};
  Gathered gathered_{};
};

/// The verdict of the table that the evidence decides; else the one with the most candidates.
std::pair<std::size_t, DecodingVerdict> VerdictOf(const kinematics::Chain& chain,
                                                  const Gathered& gathered) {
  std::vector<DecodingVerdict> verdicts;
  for (const robot::DecodingEvidence& evidence : gathered.tables) {
    robot::SearchBounds bounds;
    bounds.stop = [until_s = MonotonicSeconds() + kSearch_s] {
      return Interruption::Requested() || MonotonicSeconds() > until_s;
    };
    verdicts.push_back(robot::SearchDecoding(chain, evidence, bounds));
  }
  std::size_t best = 0, decided = 0;
  for (std::size_t k = 0; k < verdicts.size(); ++k) {
    if (verdicts[k].state == State::kDecided) ++decided;
    const auto rank = [&](std::size_t i) {
      return std::make_pair(verdicts[i].state, verdicts[i].plausible);
    };
    if (rank(k) > rank(best)) best = k;
  }
  if (decided > 1) {
    const robot::JointDecoding& one = verdicts[best].candidates.front().joints;
    for (std::size_t k = 0; k < verdicts.size(); ++k) {
      if (k == best || verdicts[k].state != State::kDecided) continue;
      const robot::JointDecoding& other = verdicts[k].candidates.front().joints;
      if (other.addresses == one.addresses && other.type == one.type) continue;  // mirrored
      verdicts[best].state = State::kUndecided;
      verdicts[best].open =
          "both register tables hold the joints, perhaps the commanded and the "
          "actual ones: see the controller's manual";
      verdicts[best].candidates.push_back(verdicts[k].candidates.front());
    }
  }
  return {best, verdicts[best]};
}

/// Why a profile decodes an image otherwise than the candidate that it was written from.
std::string Difference(const robot::RobotCodec& codec, const robot::DecodingCandidate& candidate,
                       const robot::RegisterImage& image, const deflection::LoadedArm& arm) {
  std::vector<std::uint16_t> words;
  for (const robot::RegisterBlock& block : codec.blocks()) {
    for (int k = 0; k < block.count; ++k) words.push_back(image.words.at(block.first + k));
  }
  model::RobotState state;
  codec.RobotStateFromRegisters(words, state);
  constexpr double kSame = 1e-6, kSame_m = 1e-4;
  if (state.q.size() != candidate.q.size() ||
      (state.q - candidate.q).cwiseAbs().maxCoeff() > kSame) {
    return "it decodes the same registers to other joints";
  }
  if (!candidate.pose) return "";
  kinematics::Posture posture;
  arm.chain().Evaluate(state.q, posture);
  std::vector<Pose> tips = {Pose()};
  for (int tool = 0; tool < arm.tools() && !state.tcp_is_flange; ++tool)
    tips.push_back(arm.X_FT(tool));
  const bool agrees =
      state.X_BT && std::any_of(tips.begin(), tips.end(), [&](const Pose& X_FT) {
        return ((posture.X_BF() * X_FT).p - state.X_BT->p).norm() < candidate.distance_m + kSame_m;
      });
  return agrees ? "" : "it decodes the same registers to another pose";
}

/// Decodes the last image and the present registers with the profile's text.
/// @return why it must not be used
std::string CheckProfile(const std::string& text, const FoundProfile& found,
                         const robot::RegisterImage& image, robot::RegisterClient& client,
                         const deflection::LoadedArm& arm) {
  config::FaultList faults;
  const auto profile = config::RobotProfileFromText(text, "profile", faults);
  if (!profile) return config::FaultsText(faults);
  const auto codec = robot::RobotCodec::Create(*profile);
  if (!codec) return codec.error();
  if (const std::string why = Difference(*codec, found.candidate, image, arm); !why.empty())
    return why;
  std::vector<std::uint16_t> words;
  for (const robot::RegisterBlock& block : codec->blocks()) {
    const robot::ReadOutcome answer = robot::ReadTwice(client, found.unit, block);
    if (!answer.ok()) {
      return fmt::format("the device does not give its {} registers from {}: {}", block.count,
                         block.first, answer.Text());
    }
    words.insert(words.end(), answer.words.begin(), answer.words.end());
  }
  model::RobotState state;
  codec->RobotStateFromRegisters(words, state);
  if (!arm.chain().WithinLimits(state.q, PlausibilityLimits{}.limit_margin_rad))
    return "read with it, a joint is outside its limits";
  return "";
}

nlohmann::ordered_json CandidateJson(const robot::DecodingCandidate& one,
                                     const kinematics::Chain& chain) {
  nlohmann::ordered_json joints = nlohmann::ordered_json::array();
  for (int j = 0; j < one.q.size(); ++j) {
    joints.push_back(one.q[j] *
                     (chain.type(j) == model::JointType::kRevolute ? kDegPerRad : kMmPerMetre));
  }
  nlohmann::ordered_json json = {{"text", TextOf(one.joints)},
                                 {"table", robot::NameOf(one.joints.table)},
                                 {"address", one.joints.addresses},
                                 {"type", robot::NameOf(one.joints.type)},
                                 {"word_order", robot::NameOf(one.joints.order)},
                                 {"unit", one.joints.unit->unit},
                                 {"scale", one.joints.unit->scale},
                                 {"joints", joints}};
  if (one.pose) {
    json["pose"] = TextOf(*one.pose);
    json["pose_distance_mm"] = kMmPerMetre * one.distance_m;
  }
  return json;
}

const char* StateText(State state) {
  return state == State::kDecided ? "decided" : state == State::kUndecided ? "undecided" : "none";
}

struct ScanReport {
  robot::DeviceMap map{};
  DecodingVerdict verdict{};
  std::string problem{}, profile{};
  int requests = 0;
  double seconds = 0;
};

std::string ReportJson(const ScanReport& report, const Scan& scan, const kinematics::Chain& chain) {
  nlohmann::ordered_json tables = nlohmann::ordered_json::array();
  for (const robot::RegisterImage& image : report.map.images) {
    tables.push_back(
        {{"table", robot::NameOf(image.table)}, {"registers", robot::RangesText(image)}});
  }
  nlohmann::ordered_json candidates = nlohmann::ordered_json::array();
  for (const robot::DecodingCandidate& one : report.verdict.candidates)
    candidates.push_back(CandidateJson(one, chain));
  nlohmann::ordered_json json = {{"schema", 1},
                                 {"host", scan.host},
                                 {"port", scan.port},
                                 {"tables", tables},
                                 {"max_count", report.map.max_count},
                                 {"complete", report.map.complete},
                                 {"notes", report.map.notes},
                                 {"verdict", StateText(report.verdict.state)},
                                 {"evidence", report.verdict.evidence},
                                 {"open", report.verdict.open},
                                 {"plausible", report.verdict.plausible},
                                 {"candidates", candidates},
                                 {"problem", report.problem},
                                 {"profile", report.profile},
                                 {"requests", report.requests},
                                 {"seconds", report.seconds}};
  if (report.map.unit) json["unit_id"] = *report.map.unit;
  return text::JsonText(json, 1) + "\n";
}

std::string ReportText(const ScanReport& report, const Scan& scan, const kinematics::Chain& chain) {
  std::string text = fmt::format("{}:{}", scan.host, scan.port);
  if (report.map.unit) text += fmt::format(", unit {}", *report.map.unit);
  text += fmt::format("; {} requests in {:.1f} s\n", report.requests, report.seconds);
  for (const robot::RegisterImage& image : report.map.images)
    text += fmt::format("{} registers: {}\n", robot::NameOf(image.table), robot::RangesText(image));
  for (const std::string& note : report.map.notes) text += "note: " + note + "\n";
  if (!report.map.complete)
    text +=
        "note: the survey ended before all registers were tried; --range limits it to some, "
        "--limit-s allows more time\n";
  const DecodingVerdict& verdict = report.verdict;
  if (verdict.state == State::kDecided) {
    const robot::DecodingCandidate& one = verdict.candidates.front();
    text += fmt::format("joints: {}\n        {}\n", TextOf(one.joints),
                        robot::JointsText(chain, one.q));
    if (one.pose) {
      text += fmt::format("pose:   {}; forward kinematics is within {:.2g} mm of it\n",
                          TextOf(*one.pose), kMmPerMetre * one.distance_m);
    }
    text += fmt::format("decided: {}\n", verdict.evidence);
  } else if (verdict.state == State::kUndecided) {
    text += fmt::format("NOT decided: {} decoding{} would give plausible joints, such as\n",
                        verdict.plausible, verdict.plausible == 1 ? "" : "s");
    for (const robot::DecodingCandidate& one : verdict.candidates)
      text += fmt::format("  {}: {}\n", TextOf(one.joints), robot::JointsText(chain, one.q));
    text += fmt::format("{}\nno profile is written\n", verdict.open);
  } else if (report.map.unit && report.problem.empty()) {
    text +=
        verdict.open.empty()
            ? "no decoding gives plausible joints: the robot may not be referenced (all "
              "zero), or its joints may lie outside these registers (--range) or behind another "
              "unit id (--unit)\n"
            : verdict.open + "\n";
  }
  if (!report.problem.empty()) text += report.problem + "\n";
  return text;
}

int RunScan(const ScanOptions& options) {
  Scan scan;
  const auto usage = [](const std::string& why) {
    return Fail("plumbline registers scan: " + why + "; see plumbline registers scan --help",
                kExitUsage);
  };
  if (!ReadPlace(options.address, scan))
    return usage("\"" + options.address + "\" is not HOST or HOST:PORT");
  for (const std::string& range : options.ranges) {
    const auto dash = range.find('-');
    int first = 0, last = 0;
    if (dash == range.npos || !ReadNumber(std::string_view(range).substr(0, dash), first) ||
        !ReadNumber(std::string_view(range).substr(dash + 1), last) || first < 0 || last < first ||
        last > 65535) {
      return usage("--range " + range + " is not FIRST-LAST within 0..65535");
    }
    scan.survey.ranges.emplace_back(first, last);
  }
  if (options.confirm && options.watch_s > 0)
    return usage("--confirm and --watch cannot be combined");
  config::FaultList faults;
  const auto cell = config::ReadCell(options.cell, faults);
  if (!cell) return Fail(config::FaultsText(faults));
  const deflection::LoadedArm arm(*cell);
  const kinematics::Chain& chain = arm.chain();
  if (!options.joints.empty()) {
    if (const std::string why = ReadPendant(options.joints, chain, scan); !why.empty())
      return usage("--joints: " + why);
  }
  if (!options.output.empty() && options.output != "-" &&
      !CanWriteOutput(options.output, "--output")) {
    return kExitUsage;
  }
  if (options.unit >= 0) scan.survey.unit = options.unit;
  scan.survey.joints = chain.size();
  scan.survey.max_s = options.limit_s;

  Interruption interruption;
  ScanReport report;
  const double start_s = MonotonicSeconds();
  robot::RegisterClient client(
      {scan.host, scan.port, 1e-3 * options.timeout_ms, 1e-3 * options.pause_ms, 20000});
  {
    Progress progress(std::cerr, options.quiet || options.json);
    scan.survey.progress = [&progress](double share, const std::string& doing) {
      progress.Show(share, doing);
      return !Interruption::Requested();
    };
    report.map = robot::Survey(client, scan.survey);
  }
  if (Interruption::Requested()) return Interrupted();
  std::size_t table = 0;
  robot::RegisterImage last;  // that the decoding was decided by
  if (!report.map.unit) {
    report.problem = "the device gives no registers, so nothing can be said about its joints";
  } else if (report.map.images.empty()) {
    report.problem = "the device answers, but gives no register of the ranges that were tried";
  } else {
    Gathered gathered = Gathering(options, client, report.map, arm).Run(scan);
    if (Interruption::Requested()) return Interrupted();
    if (!gathered.tables.front().images.empty())
      std::tie(table, report.verdict) = VerdictOf(chain, gathered);
    if (Interruption::Requested()) return Interrupted();
    if (report.verdict.state != State::kDecided) {
      report.problem = gathered.problem;
    } else {
      last = gathered.tables[table].images.back();
    }
  }
  if (report.verdict.state == State::kDecided) {
    FoundProfile found{options.name, scan.host,        report.verdict.evidence,
                       scan.port,    *report.map.unit, report.verdict.candidates.front()};
    found.blocks = BlocksOf(found.candidate, report.map.images[table], report.map.max_count);
    std::vector<bool> prismatic;
    for (int j = 0; j < chain.size(); ++j)
      prismatic.push_back(chain.type(j) == model::JointType::kPrismatic);
    report.profile = ProfileText(found, prismatic);
    const std::string why = CheckProfile(report.profile, found, last, client, arm);
    if (!why.empty()) {
      report.problem = "no profile is written: " + why;
      report.verdict.state = State::kUndecided;
      report.profile.clear();
    }
  }
  report.requests = client.requests();
  report.seconds = MonotonicSeconds() - start_s;
  const bool decided = report.verdict.state == State::kDecided;
  if (!interruption.Disarm()) return Interrupted();
  const bool to_out = options.output == "-" && !options.json;
  if (options.json) {
    std::cout << ReportJson(report, scan, chain);
  } else {
    (to_out ? std::cerr : std::cout) << ReportText(report, scan, chain);
  }
  if (!decided) return kExitFault;
  if (to_out) std::cout << report.profile;
  if (options.output.empty() || options.output == "-") return kExitOk;
  return WriteOutput(options.output, report.profile, "--output") ? kExitOk : kExitUsage;
}

}  // namespace

void AddRegistersScan(CLI::App& registers, int& exit_code) {
  auto options = std::make_shared<ScanOptions>();
  CLI::App* scan = registers.add_subcommand(
      "scan", "Find out how a controller's registers hold the joints, and write its profile");
  scan->add_option("host", options->address, "Modbus TCP server of the controller: HOST[:PORT]")
      ->required();
  scan->add_option("--cell", options->cell, "Cell file of the arm: joint limits and kinematics")
      ->required();
  scan->add_option("--output,--out", options->output,
                   "Profile to write if the evidence decides; - is standard output");
  scan->add_option("--joints", options->joints,
                   "All joints as the teach pendant shows them now, in deg (mm): 12.5,-95.25,..");
  scan->add_flag("--confirm", options->confirm,
                 "Ask for a move of each axis, and see which registers follow");
  scan->add_option("--step", options->step_deg, "Size of these moves in deg (mm)")
      ->capture_default_str()
      ->check(NumberWithin(-90, 90));
  scan->add_option("--watch", options->watch_s, "Follow a moving robot for so many seconds")
      ->check(NumberWithin(0, 600));
  scan->add_option("--unit", options->unit, "Unit id; without it 1, 255 and 0 are tried")
      ->check(WholeNumberWithin(0, 255));
  scan->add_option("--range", options->ranges,
                   "FIRST-LAST, registers to try, repeatable; without it 0-1023 and the first "
                   "registers of each further thousand")
      ->allow_extra_args(false);
  scan->add_option("--name", options->name, "Name of the controller in the profile")
      ->capture_default_str();
  scan->add_option("--limit-s", options->limit_s, "Time for the survey of the registers in s")
      ->capture_default_str()
      ->check(NumberWithin(1, 3600));
  scan->add_option("--pause-ms", options->pause_ms, "Pause before each request in ms")
      ->capture_default_str()
      ->check(NumberWithin(0, 1000));
  scan->add_option("--timeout-ms", options->timeout_ms, "Timeout of a request in ms")
      ->capture_default_str()
      ->check(NumberWithin(5, 10000));
  scan->add_flag("--json", options->json, "Print JSON");
  scan->add_flag("--quiet", options->quiet, "Show no progress");
  scan->footer(
      "Only reads: one request at a time, with a pause. Tries every address, type, word order and\n"
      "unit; keeps what the limits of the arm allow. A profile is written only if the evidence\n"
      "decides: the joints equal --joints, each axis moved alone with --confirm, or a pose in the\n"
      "registers followed the forward kinematics of the joints while the robot moved (--watch).\n"
      "Otherwise the candidates are listed, with what would decide. In every case one joint must\n"
      "have been below zero, unless none of the arm can be.\n\n"
      "A controller of Universal Robots needs no profile: transport = \"rtde\" in [robot] reads "
      "its\n"
      "joints without rounding (docs/rtde.md).\n\n"
      "Examples:\n"
      "  plumbline registers scan 192.168.0.2 --cell cell.toml --output robot.toml\n"
      "  plumbline registers scan 192.168.0.2:1502 --cell cell.toml \\\n"
      "      --joints=12.5,-95.25,88,-61.75,-90.5,170.12 --output robot.toml\n"
      "  plumbline registers scan 192.168.0.2 --cell cell.toml --confirm \\\n"
      "      --output robot.toml\n\n"
      "Exit codes: 0 the decoding is decided, 1 it is not, or faulty input, 2 wrong arguments or\n"
      "unwritable output.");
  scan->callback([options, &exit_code] { exit_code = RunScan(*options); });
}

}  // namespace plumbline::cli
