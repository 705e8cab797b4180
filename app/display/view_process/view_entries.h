// Log entries of the viewer that have no event of their own; repeats are counted per text.
#pragma once

#include <string>

#include "app/base/log/log_entry.h"

namespace plumbline::display {

inline log::LogEntry ViewFault(const std::string& text) {
  return {log::Event::kViewFault, text, {{"ABOUT", text}}};
}

inline log::LogEntry ViewNote(const std::string& text) {
  return {log::Event::kViewNote, text, {{"ABOUT", text}}};
}

}  // namespace plumbline::display
