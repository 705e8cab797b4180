// What the screen says in words: the paper's panels, for a cell that nobody operates.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "app/scene/object_table.h"
#include "app/view/carriers.h"
#include "app/view/measured.h"

namespace plumbline {

enum class Tone { kPlain, kGood, kAttention, kBad, kFaded };

struct PanelLine {
  std::string text;
  Tone tone = Tone::kPlain;
};

struct Panel {
  std::string title;
  std::vector<PanelLine> lines;  ///< the most important first; the last ones may not find room
};

/// What the viewer knows beside the daemon's state.
struct ViewFacts {
  const ViewState* state = nullptr;      ///< null: none came yet
  std::span<const Carriers> carriers;    ///< of each camera of the state; at least one
  std::vector<std::size_t> shown = {0};  ///< numbers of the cameras in the picture
  const ViewModel* model = nullptr;
  const ObjectTable* table = nullptr;
  const Measured* measured = nullptr;
  std::vector<PanelLine> objects;   ///< what is to be said of their files
  std::vector<ViewLine> own_lines;  ///< of the viewer's own log
  std::string link_problem;         ///< why no states come; empty: they do
  double now_s = 0;
  std::vector<double> frames_per_s;  ///< of each camera, as they arrived
};

/// The daemon's health; or, where it is worse, what was measured here and reaches the daemon a
/// moment later. An alarm while no daemon reports.
CellHealth ShownHealth(const ViewFacts& facts);

/// How a point is marked: good only where its radius holds as far as anybody knows.
Tone ToneOf(const ViewPoint& point, const ViewState& state);

/// The bar at the top: one word for everything, and why.
PanelLine Headline(const ViewFacts& facts);

/// Why the overlay over these cameras' images is not to be trusted now, each in words; empty: it
/// is.
std::vector<std::string> StaleBecause(const ViewFacts& facts, std::span<const std::size_t> cameras);
/// Of those that are shown.
inline std::vector<std::string> StaleBecause(const ViewFacts& facts) {
  return StaleBecause(facts, facts.shown);
}

/// In the order of the column.
std::vector<Panel> PanelsOf(const ViewFacts& facts);

/// The newest lines of the daemon's log and the viewer's, oldest first.
std::vector<PanelLine> MessagesOf(const ViewFacts& facts, std::size_t most);

}  // namespace plumbline
