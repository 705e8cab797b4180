// The renderer with the meshes it was given, through losses of its context.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "app/log/log_entry.h"
#include "app/view/picture_layout.h"
#include "app/view_process/scene_stock.h"
#include "drivers/display/gl_context.h"
#include "drivers/display/renderer.h"

namespace plumbline {

/// Used by one thread.
class Drawing {
 public:
  static constexpr double kRetry_s = 10;

  explicit Drawing(LogSink sink) : sink_(std::move(sink)) {}

  /// Makes context and renderer where there are none and an attempt is due. What is missing is told
  /// once, until it is there. @return  whether Draw() may be called
  bool Ready(double now_s);

  /// Loads what is new and drops what is gone. @return  the number of each object's mesh
  const std::vector<int>& Meshes(const std::shared_ptr<const SceneNow>& scene);

  /// @return  whether there is a picture now
  bool Draw(const DisplayList& list);

  Renderer& renderer() { return *renderer_; }
  TextWidth text_width();
  const std::string& problem() const { return problem_; }

 private:
  void Lose(const std::string& why);

  const LogSink sink_;
  std::unique_ptr<GlContext> context_;
  std::unique_ptr<Renderer> renderer_;     ///< goes before its context
  std::shared_ptr<const SceneNow> scene_;  ///< that is loaded
  std::vector<int> numbers_;               ///< of its objects' meshes
  double tried_s_ = -1e300;
  std::string problem_, refused_;
};

}  // namespace plumbline
