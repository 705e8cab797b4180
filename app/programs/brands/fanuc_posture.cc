#include "app/programs/brands/fanuc_posture.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>

#include "app/programs/brands/arm_sides.h"
#include "app/programs/brands/source_cursor.h"

namespace plumbline::programs::fanuc {
namespace {

/// Angles and relative lengths below which a posture is at the limit between two letters: more than
/// the rounding of the file's 0.001 deg.
constexpr double kAtLimit = 1e-4;

constexpr std::array<std::array<int, 3>, 2> kTurningJoints = {{{0, 3, 5}, {3, 4, 5}}};

struct Config {
  struct Letter {
    std::size_t at = 0;
    char value = 0;
  };
  std::array<std::optional<Letter>, 3> letters;  ///< of F/N, U/D, T/B
  std::array<Span, 3> turn_spans{};
  std::array<int, 3> turns{};
  int turn_count = 0;
};

/// Place of a letter: F/N, U/D, T/B.
std::optional<std::size_t> PlaceOf(char letter) {
  constexpr std::string_view kLetters = "FNUDTB";
  const auto at = kLetters.find(letter);
  return at == std::string_view::npos ? std::nullopt : std::optional(at / 2);
}

Config Parsed(std::string_view text) {
  Config config;
  std::size_t at = 0;
  for (; at < text.size() && text[at] != ','; ++at) {
    if (const auto place = PlaceOf(text[at])) config.letters[*place] = {at, text[at]};
  }
  while (at < text.size() && config.turn_count < 3) {
    ++at;
    while (at < text.size() && IsBlank(text[at])) ++at;
    int value = 0;
    const char* const begin = text.data() + at;
    const auto [end, error] = std::from_chars(begin, text.data() + text.size(), value);
    if (error != std::errc()) break;
    const std::size_t after = at + static_cast<std::size_t>(end - begin);
    config.turn_spans[static_cast<std::size_t>(config.turn_count)] = {0, at, after};
    config.turns[static_cast<std::size_t>(config.turn_count++)] = value;
    at = text.find(',', after);
    if (at == std::string_view::npos) break;
  }
  return config;
}

/// How far a posture is on the side of F, U and T: J5 [rad], and lengths by the reach; nullopt for
/// arms without six joints.
std::optional<std::array<double, 3>> Sides(const kinematics::Chain& chain,
                                           const model::JointVector& q) {
  const auto arm = ArmSidesOf(chain, q);
  if (!arm) return std::nullopt;
  return std::array{q[4], arm->elbow_up, arm->front};
}

bool LetterAgrees(char letter, double side) {
  const bool first = letter == 'F' || letter == 'U' || letter == 'T';
  return std::abs(side) < kAtLimit || first == (side > 0);
}

int TurnsOf(double angle) {
  return static_cast<int>(std::round(angle / (2 * std::numbers::pi)));
}

/// Whether turn i may be that of a joint.
bool TurnAgrees(const Config& config, std::size_t i, double angle) {
  return std::abs(angle - 2 * std::numbers::pi * config.turns[i]) <= std::numbers::pi + kAtLimit;
}

/// The joints whose turns a string most likely states: those of which the fewest turns differ.
const std::array<int, 3>& TurningJoints(const Config& config, const model::JointVector& q) {
  const auto differing = [&](const std::array<int, 3>& joints) {
    int count = 0;
    for (std::size_t i = 0; i < 3; ++i) count += TurnAgrees(config, i, q[joints[i]]) ? 0 : 1;
    return count;
  };
  return *std::ranges::min_element(kTurningJoints, {}, differing);
}

bool TurnsAgree(const Config& config, const model::JointVector& q) {
  if (config.turn_count < 3) return true;
  const std::array<int, 3>& joints = TurningJoints(config, q);
  for (std::size_t i = 0; i < 3; ++i) {
    if (!TurnAgrees(config, i, q[joints[i]])) return false;
  }
  return true;
}

}  // namespace

bool ConfigAgrees(std::string_view text, const kinematics::Chain& chain,
                  const model::JointVector& q, bool with_turns) {
  const auto sides = Sides(chain, q);
  if (!sides) return true;
  const Config config = Parsed(text);
  for (std::size_t i = 0; i < 3; ++i) {
    if (config.letters[i] && !LetterAgrees(config.letters[i]->value, (*sides)[i])) return false;
  }
  return !with_turns || TurnsAgree(config, q);
}

std::string ConfigFor(std::string_view text, const kinematics::Chain& chain,
                      const model::JointVector& q) {
  std::string written(text);
  const auto sides = Sides(chain, q);
  if (!sides || ConfigAgrees(text, chain, q, true)) return written;
  const Config config = Parsed(text);
  if (!TurnsAgree(config, q)) {
    const std::array<int, 3>& joints = TurningJoints(config, q);
    for (std::size_t i = 3; i-- > 0;) {
      if (TurnAgrees(config, i, q[joints[i]])) continue;
      const Span& span = config.turn_spans[i];
      written.replace(span.begin, span.end - span.begin, std::to_string(TurnsOf(q[joints[i]])));
    }
  }
  constexpr std::array<std::array<char, 2>, 3> kLetters = {{{'F', 'N'}, {'U', 'D'}, {'T', 'B'}}};
  for (std::size_t i = 0; i < 3; ++i) {
    if (config.letters[i] && !LetterAgrees(config.letters[i]->value, (*sides)[i]))
      written[config.letters[i]->at] = kLetters[i][(*sides)[i] > 0 ? 0 : 1];
  }
  return written;
}

}  // namespace plumbline::programs::fanuc
