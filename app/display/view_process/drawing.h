// Renderer with its loaded meshes, recreated after a GPU reset.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/base/log/log_entry.h"
#include "app/cell/scene/scene_worker.h"
#include "app/display/view/picture_layout.h"
#include "drivers/display/gl_context.h"
#include "drivers/display/renderer.h"

namespace plumbline::display {

/// Used by one thread.
class Drawing {
 public:
  static constexpr double kRetry_s = 10;

  explicit Drawing(log::LogSink sink) : sink_(std::move(sink)) {}

  /// Creates context and renderer if there are none and an attempt is due. A failure is logged
  /// once.
  /// @return  whether Draw() may be called
  bool Ready(double now_s);

  /// Loads new meshes and drops unused ones.
  /// @return  the renderer's mesh number of each object, 0 for none
  const std::vector<int>& Meshes(const std::shared_ptr<const cell::SceneSnapshot>& scene);

  /// Whether the last picture was drawn from an equal list, so that drawing it again changes
  /// nothing.
  bool Shows(const scene::DisplayList& list) const { return drawn_ && *drawn_ == list; }
  /// @return  whether a picture was drawn
  bool Draw(const scene::DisplayList& list);

  display::Renderer& renderer() { return *renderer_; }
  display::TextWidth text_width();
  const std::string& problem() const { return problem_; }

 private:
  void Release(const std::string& why);

  const log::LogSink sink_;
  std::unique_ptr<display::GlContext> context_;
  std::unique_ptr<display::Renderer> renderer_;       ///< destroyed before its context
  std::shared_ptr<const cell::SceneSnapshot> scene_;  ///< whose meshes are loaded
  std::vector<int> numbers_;                          ///< mesh numbers of its objects
  std::optional<scene::DisplayList> drawn_;           ///< its pointers are compared, never followed
  double tried_s_ = -1e300;
  std::string problem_, refused_;
};

}  // namespace plumbline::display
