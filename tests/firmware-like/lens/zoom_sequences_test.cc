// Exhaustive test of all sequences of six events, and of five events after longer prefixes. The
// invariants are evaluated from the history of events alone, independently of the supervisor's
// state.
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "firmware-like/lens/zoom_supervisor.h"

namespace plumbline::zoom_sequences_test {

using namespace plumbline::lens;

namespace {

using Kind = ZoomEvent::Kind;

constexpr double kEps = 1e-9;
const ZoomSupervisorSettings kSettings{.zoom_band_counts = 2,
                                       .focus_band_counts = 4,
                                       .settle_s = 0.3,
                                       .lost_after_s = 1.0,
                                       .verify_patience_s = 1.5};

/// One symbol of the alphabet: event, time since the previous event, time of the observation.
struct Letter {
  const char* name;
  Kind kind;
  double after_s = 0.01;
  double about_before_s = 0;  ///< age of the observation
  ZoomReading reading{};
};

ZoomReading At(std::int32_t counts) {
  ZoomReading reading;
  reading.zoom_counts = counts;
  return reading;
}

ZoomReading With(LensMotion motion, bool moved, std::optional<bool> digital) {
  ZoomReading reading = At(1000);
  reading.motion = motion;
  reading.moved = moved;
  reading.digital_zoom = digital;
  return reading;
}

const std::vector<Letter>& Alphabet() {
  static const std::vector<Letter> letters = {
      {"at 1000, soon", Kind::kReading, 0.1, 0, At(1000)},
      {"at 1000, later", Kind::kReading, 0.4, 0, At(1000)},
      {"at 1002", Kind::kReading, 0.1, 0, At(1002)},
      {"at 1005", Kind::kReading, 0.4, 0, At(1005)},
      {"moving", Kind::kReading, 0.1, 0, With(LensMotion::kMoving, false, std::nullopt)},
      {"moved line", Kind::kReading, 0.1, 0, With(LensMotion::kUnknown, true, std::nullopt)},
      {"digital on", Kind::kReading, 0.1, 0, With(LensMotion::kSettled, false, true)},
      {"digital off", Kind::kReading, 0.1, 0, With(LensMotion::kSettled, false, false)},
      {"no answer", Kind::kLost, 0.6},
      {"lens known", Kind::kLensKnown},
      {"lens unknown", Kind::kLensUnknown},
      {"tags good", Kind::kTagsGood},
      {"marks good, old image", Kind::kTagsGood, 0.01, 0.35},
      {"tags bad", Kind::kTagsBad},
      {"tags hidden", Kind::kTagsNotVisible},
      {"board started", Kind::kBoardStarted},
      {"board accepted", Kind::kBoardAccepted},
      {"board refused", Kind::kBoardRefused},
      {"board cancelled", Kind::kBoardCancelled},
  };
  return letters;
}

class Walk {
 public:
  /// @return how often each state was reached
  std::array<long, 7> Count(const std::vector<std::string>& beginning, int length) {
    ZoomSupervisor machine(kSettings);
    for (const std::string& name : beginning) {
      for (const Letter& letter : Alphabet()) {
        if (letter.name == name) Step(machine, letter);
      }
    }
    REQUIRE(depth_ == static_cast<int>(beginning.size()));
    Descend(machine, length);
    return reached_;
  }

  const std::string& failure() const { return failure_; }

 private:
  struct Past {
    const Letter* letter;
    double time_s, observed_s;
  };

  void Descend(const ZoomSupervisor& machine, int left) {
    if (left == 0 || !failure_.empty()) return;
    for (const Letter& letter : Alphabet()) {
      ZoomSupervisor next = machine;
      Step(next, letter);
      Descend(next, left - 1);
      --depth_;
    }
  }

  void Step(ZoomSupervisor& machine, const Letter& letter) {
    const double before_s = depth_ == 0 ? 100 : Last().time_s;
    ZoomEvent event;
    event.kind = letter.kind;
    event.time_s = before_s + letter.after_s;
    event.observed_s = event.time_s - letter.about_before_s;
    event.reading = letter.reading;
    past_[static_cast<std::size_t>(depth_++)] = {&letter, event.time_s, event.observed_s};
    const ZoomState from = machine.state();
    const ZoomReason why = machine.reason();
    const auto transition = machine.Handle(event);
    ++reached_[static_cast<std::size_t>(machine.state())];
    const bool changed = machine.state() != from || machine.reason() != why;
    Must(transition.has_value() == changed, "exactly one transition per change");
    if (transition) {
      Must(transition->from == from && transition->to == machine.state() &&
               transition->why == machine.reason() && transition->time_s == event.time_s,
           "the transition describes the change");
    }
    Judge(machine.state(), from);
  }

  void Judge(ZoomState state, ZoomState from) {
    const int last = depth_ - 1;
    const double now_s = Last().time_s;
    const double heard_s = LastReadingBefore(depth_);
    if (now_s - heard_s > kSettings.lost_after_s + kEps) {
      Must(state == ZoomState::kUnknown, "a lost sensor leads to kUnknown");
    }
    if (Disturbs(last)) {
      Must(state == ZoomState::kMoving || state == ZoomState::kUnknown ||
               state == ZoomState::kRefused,
           "motion is detected in one event");
    }
    if (DigitalOn()) {
      Must(state == ZoomState::kRefused || state == ZoomState::kUnknown,
           "digital zoom leads to kRefused");
    }
    if (from == ZoomState::kValid && Last().letter->kind == Kind::kReading &&
        Spread(LastVerification() - kEps) > 2 * kSettings.zoom_band_counts) {
      Must(state != ZoomState::kValid, "a change is detected in one event");
    }
    if (state == ZoomState::kValid) JudgeValid();
    if (state == ZoomState::kCalibrating) {
      const int start = LastOf({Kind::kBoardStarted});
      Must(start >= 0 && WasStationary(At(start).time_s, depth_),
           "a board is captured only while the lens is stationary");
    }
  }

  void JudgeValid() {
    // It must be justified by a verification of a stationary lens with later images.
    for (int v = depth_ - 1; v >= 0; --v) {
      const Kind kind = At(v).letter->kind;
      if (kind != Kind::kTagsGood && kind != Kind::kBoardAccepted) continue;
      if (!WasStationary(At(v).observed_s, depth_) ||
          OneOf({Kind::kTagsBad, Kind::kLensKnown, Kind::kLensUnknown}, v + 1, depth_)) {
        continue;
      }
      if (kind == Kind::kBoardAccepted) {
        if (Accepted(v)) return;
        continue;
      }
      int lens = v;
      do {
        lens = LastOf({Kind::kLensKnown, Kind::kLensUnknown, Kind::kBoardAccepted}, lens);
      } while (lens >= 0 && At(lens).letter->kind == Kind::kBoardAccepted && !Accepted(lens));
      const int bad = LastOf({Kind::kTagsBad}, v);
      if (lens >= 0 && At(lens).letter->kind != Kind::kLensUnknown &&
          At(v).observed_s >= At(lens).time_s && WasStationary(At(lens).observed_s, depth_) &&
          (bad < 0 || At(v).observed_s >= At(bad).observed_s)) {
        return;
      }
    }
    Must(false, "valid requires a verification since the last motion");
  }

  /// The lens was settled at `since_s` and remained stationary until the end of the history.
  bool WasStationary(double since_s, int end) {
    const double from_s = since_s - kSettings.settle_s + kEps;
    double heard_s = -1e9;  // the latest reading before the gap is evaluated
    bool known_before = false;
    for (int i = 0; i < end; ++i) {
      const Past& past = At(i);
      if (past.letter->kind != Kind::kReading) continue;
      const double time_s = past.time_s;
      if (time_s > from_s && known_before && time_s - heard_s > kSettings.lost_after_s + kEps) {
        return false;
      }
      if (time_s <= since_s - kSettings.settle_s + kEps) known_before = true;
      heard_s = time_s;
      if (time_s > from_s && Disturbs(i)) return false;
    }
    return known_before && At(end - 1).time_s - heard_s <= kSettings.lost_after_s + kEps &&
           Spread(from_s) <= 2 * kSettings.zoom_band_counts;
  }

  /// Largest difference between positions reported after that time.
  int Spread(double from_s) {
    int low = 1 << 30, high = -(1 << 30);
    for (int i = 0; i < depth_; ++i) {
      if (At(i).letter->kind != Kind::kReading || At(i).time_s < from_s) continue;
      low = std::min(low, *At(i).letter->reading.zoom_counts);
      high = std::max(high, *At(i).letter->reading.zoom_counts);
    }
    return high < low ? 0 : high - low;
  }

  bool Disturbs(int i) const {
    const ZoomReading& reading = At(i).letter->reading;
    return At(i).letter->kind == Kind::kReading &&
           (reading.moved || reading.motion == LensMotion::kMoving ||
            reading.digital_zoom.value_or(false));
  }

  /// The latest reading of digital zoom was on, and the sensor has not been lost since.
  bool DigitalOn() const {
    for (int i = depth_ - 1; i >= 0; --i) {
      if (At(i).letter->kind != Kind::kReading) continue;
      const ZoomReading& reading = At(i).letter->reading;
      if (reading.digital_zoom) return *reading.digital_zoom;
      if (At(i).time_s - LastReadingBefore(i) > kSettings.lost_after_s + kEps) return false;
    }
    return false;
  }

  /// A calibration has been in progress since a start with a stationary lens.
  bool Accepted(int i) {
    const int start = LastOf(
        {Kind::kBoardStarted, Kind::kBoardRefused, Kind::kBoardCancelled, Kind::kBoardAccepted}, i);
    return start >= 0 && At(start).letter->kind == Kind::kBoardStarted &&
           WasStationary(At(start).time_s, i + 1);
  }

  double LastVerification() const {
    const int v = LastOf({Kind::kTagsGood, Kind::kBoardAccepted});
    return v < 0 ? 0 : At(v).observed_s;
  }

  double LastReadingBefore(int end) const {
    for (int i = end - 1; i >= 0; --i) {
      if (At(i).letter->kind == Kind::kReading) return At(i).time_s;
    }
    return 1e9;
  }

  int LastOf(std::initializer_list<Kind> kinds, int end = -1) const {
    for (int i = (end < 0 ? depth_ : end) - 1; i >= 0; --i) {
      for (const Kind kind : kinds) {
        if (At(i).letter->kind == kind) return i;
      }
    }
    return -1;
  }

  bool OneOf(std::initializer_list<Kind> kinds, int begin, int end) const {
    const int found = LastOf(kinds, end);
    return end > 0 && found >= begin;
  }

  const Past& At(int i) const { return past_[static_cast<std::size_t>(i)]; }
  const Past& Last() const { return At(depth_ - 1); }

  void Must(bool holds, const char* what) {
    if (holds || !failure_.empty()) return;
    failure_ = what;
    for (int i = 0; i < depth_; ++i) failure_ += std::string(" | ") + At(i).letter->name;
  }

  std::array<Past, 16> past_{};
  int depth_ = 0;
  std::array<long, 7> reached_{};
  std::string failure_;
};

}  // namespace

TEST_CASE("invariants hold for every sequence of six events, and of five after longer prefixes") {
  const std::vector<std::string> valid = {"at 1000, soon", "at 1000, later", "lens known",
                                          "tags good"};
  std::vector<std::string> calibrating = valid;
  calibrating.back() = "board started";
  std::vector<std::string> refused = calibrating;
  refused.emplace_back("board refused");
  std::vector<std::string> recalibrating = valid;
  recalibrating.emplace_back("board started");
  struct Case {
    std::vector<std::string> beginning;
    int length;
  };
  const Case cases[] = {{{}, 6},
                        {valid, 5},
                        {calibrating, 5},
                        {refused, 5},
                        {recalibrating, 5},
                        {{"digital on"}, 5},
                        {{"at 1000, soon", "at 1000, later"}, 5}};
  std::array<long, 7> total{};
  for (const Case& c : cases) {
    Walk walk;
    const auto reached = walk.Count(c.beginning, c.length);
    INFO(walk.failure());
    CHECK(walk.failure().empty());
    for (std::size_t i = 0; i < total.size(); ++i) total[i] += reached[i];
  }
  for (const long count : total) CHECK(count > 1000);  // every state is reached often
}

}  // namespace plumbline::zoom_sequences_test
