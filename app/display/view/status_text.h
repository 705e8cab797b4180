// Status texts of the display: messages and reasons for stale data.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/cell/scene/carriers.h"
#include "app/cell/scene/object_table.h"
#include "app/cell/view_link/scene_measurements.h"
#include "app/cell/view_link/view_state.h"

namespace plumbline::display {

// Validity of a state that the daemon no longer updates.

/// Age of the state at which a connected daemon hangs; if the connection is lost,
/// cell::kStateOld_s.
inline constexpr double kDaemonSilent_s = 2.0;

/// Whether the daemon has ended or hangs; nothing it reported may then be shown as current.
/// @param link_problem  why no states arrive; empty while connected
bool DaemonIsSilent(const cell::ViewState& state, const std::string& link_problem, double now_s);

/// The last state of a silent daemon as page and display may show it: health "no daemon", no point
/// valid, no lens known to be valid, and the present age of the robot reading.
/// @return  nullopt while the daemon reports, or if the state is already withdrawn
std::optional<cell::ViewState> WithdrawnState(const cell::ViewState& state,
                                              const std::string& link_problem, double now_s);

/// Whether the state is that of a silent daemon, as WithdrawnState() returns it.
inline bool WithoutDaemon(const cell::ViewState& state) {
  return state.health.reason == HealthReason::kNoDaemon;
}

/// Why a displayed point has no valid correction.
std::string InvalidReason(const cell::ViewPoint& point, const cell::ViewState& state);

enum class Tone { kPlain, kGood, kAttention, kBad, kFaded };

struct PanelLine {
  std::string text;
  Tone tone = Tone::kPlain;
};

/// Everything that the texts and the overlay are derived from.
struct ViewFacts {
  const cell::ViewState* state = nullptr;    ///< null if none was received yet
  std::span<const cell::Carriers> carriers;  ///< of each camera of the state; at least one
  std::vector<std::size_t> shown = {0};      ///< indices of the displayed cameras
  const cell::ViewModel* model = nullptr;
  const cell::ObjectTable* table = nullptr;
  const cell::SceneMeasurements* measured = nullptr;
  std::vector<PanelLine> objects;            ///< remarks on the object table and its mesh files
  std::vector<cell::ViewLine> viewer_lines;  ///< the viewer's own log
  std::string link_problem;                  ///< why no states arrive; empty if they do
  double now_s = 0;
  std::vector<double> frames_per_s;  ///< received frame rate of each camera
};

/// Severity shown in the headline: the daemon's health; an alarm while the daemon is silent.
CellHealth DisplayedHealth(const ViewFacts& facts);

/// "300 ms ago", "5 s ago", "3 min ago".
std::string AgeText(double age_s);

/// "side: " if the cameras have names, else empty.
std::string CameraPrefix(const cell::ViewCamera& camera);

Tone ToneOf(HealthSeverity severity);
/// Tone of a point: good only if nothing is known that invalidates its stated 95 % radius.
Tone ToneOf(const cell::ViewPoint& point, const cell::ViewState& state);

/// Why something shown is not current, and what to do.
struct StaleReason {
  std::string text, remedy;
};
std::vector<StaleReason> StaleReasonsOf(const ViewFacts& facts,
                                        std::span<const std::size_t> cameras);

/// Reasons why the overlay on these cameras' images must not be trusted; empty if it may be.
std::vector<std::string> StaleReasons(const ViewFacts& facts, std::span<const std::size_t> cameras);
/// The same for the displayed cameras.
inline std::vector<std::string> StaleReasons(const ViewFacts& facts) {
  return StaleReasons(facts, facts.shown);
}

/// The newest `count` log lines of the daemon, newest first; before the first state, the viewer's.
/// Later the viewer's own lines, such as faults of mesh files, are left to the page. Lines that
/// differ only in their numbers are folded into the newest of them, with their count.
std::vector<PanelLine> RecentMessages(const ViewFacts& facts, std::size_t count);

}  // namespace plumbline::display
