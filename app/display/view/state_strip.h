// State strip: the state of the cell in one word, with a glyph, a colour and one reason.
#pragma once

#include <string>

#include "app/display/view/status_text.h"
#include "firmware-like/scene/display_list.h"

namespace plumbline::display {

// Messages about the health of the cell: what is wrong, with the names of the things, and what to
// do.

struct HealthMessage {
  std::string reason;  ///< "no correction at left bracket (point 3): joint limit, code 2"
  std::string remedy;  ///< the action; empty: none is needed
};

/// The message that strip, headline, panels and status.json show. It names the points, cameras,
/// tags and objects concerned where the state knows them; otherwise the texts of cell_health.h.
/// Never asks for an action that this process has already taken, such as starting it.
HealthMessage MessageOf(const CellHealth& health, const ViewFacts& facts);

/// "joint limit (code 2)".
std::string CodeText(correction::CorrectionCode code);

/// "learning the reference: 7 of 20 probes", while the drift monitor collects its reference.
std::string LearningText(const status::MonitoringStatus& monitoring);

/// Class of a state, from healthy to unknown. One table gives each its glyph and its colours, so
/// that display and page show the same state alike.
enum class StateClass { kHealthy, kAdvisory, kWarning, kAlarm, kUnknown };

struct StateMark {
  const char* name;         ///< class name in status.json and in the page's style sheet
  const char* glyph;        ///< UTF-8; differs in shape from the other classes'
  scene::Colour fill, ink;  ///< of the strip
};
const StateMark& MarkOf(StateClass state);

/// Class of a tone.
StateClass ClassOf(Tone tone);

struct StateStrip {
  StateClass state = StateClass::kUnknown;
  std::string word;    ///< "OK", "NOTE", "STALE", "ATTENTION", "ALARM", "NO DAEMON"
  std::string reason;  ///< empty: none is needed
  std::string remedy;  ///< what to do; empty: nothing

  /// "WORD: reason"
  std::string Text() const { return reason.empty() ? word : word + ": " + reason; }
};

/// The state as DisplayedHealth() and MessageOf() give it; below an alarm, stale data come first.
StateStrip StripOf(const ViewFacts& facts);

/// The strip as one line with its tone, for the page and the command line.
PanelLine Headline(const ViewFacts& facts);

}  // namespace plumbline::display
