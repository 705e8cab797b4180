#include "app/display/view_process/drawing.h"

#include <malloc.h>

#include <algorithm>
#include <map>

#include "app/display/view_process/view_entries.h"

namespace plumbline::display {

void Drawing::Release(const std::string& why) {
  renderer_.reset();
  context_.reset();
  scene_.reset();
  numbers_.clear();
  drawn_.reset();
  if (problem_ != why) sink_(ViewFault(why));
  problem_ = why;
}

bool Drawing::Ready(double now_s) {
  if (renderer_) return true;
  if (now_s - tried_s_ < kRetry_s) return false;
  tried_s_ = now_s;
  auto context = display::GlContext::Create();
  if (!context) {
    Release("cannot draw: " + context.error());
    return false;
  }
  context_ = std::move(context).value();
  auto renderer = display::Renderer::Create(*context_);
  if (!renderer) {
    Release("cannot draw: " + renderer.error());
    return false;
  }
  renderer_ = std::move(renderer).value();
  problem_.clear();
  sink_(ViewNote("drawing with " + context_->description()));
  return true;
}

const std::vector<int>& Drawing::Meshes(const std::shared_ptr<const cell::SceneSnapshot>& scene) {
  if (!renderer_ || scene == scene_) return numbers_;
  std::map<const scene::CheckedMesh*, int> known;
  for (std::size_t k = 0; k < numbers_.size(); ++k) {
    if (numbers_[k] != 0) known[scene_->meshes[k].get()] = numbers_[k];
  }
  const std::map<const scene::CheckedMesh*, int> before = known;
  std::vector<int> numbers;
  for (const cell::MeshOfObject& mesh : scene->meshes) {
    if (!mesh) {
      numbers.push_back(0);
      continue;
    }
    const auto found = known.find(mesh.get());
    if (found != known.end()) {
      numbers.push_back(found->second);
      continue;
    }
    const Result<int> loaded = renderer_->LoadMesh(mesh->mesh);
    if (!loaded) sink_(ViewFault("a mesh cannot be drawn: " + loaded.error()));
    numbers.push_back(loaded ? *loaded : 0);
    known[mesh.get()] = numbers.back();
  }
  for (const auto& [mesh, number] : before) {
    if (std::find(numbers.begin(), numbers.end(), number) == numbers.end()) {
      renderer_->DropMesh(number);
    }
  }
  malloc_trim(0);  // return the copies that were uploaded to the GPU
  scene_ = scene;
  numbers_ = std::move(numbers);
  return numbers_;
}

bool Drawing::Draw(const scene::DisplayList& list) {
  if (!renderer_) return false;
  drawn_.reset();
  const display::DrawResult result = renderer_->Draw(list);
  for (const std::string& remark : renderer_->TakeRemarks()) sink_(ViewNote(remark));
  if (result == display::DrawResult::kDrawn) {
    refused_.clear();
    drawn_ = list;
    return true;
  }
  if (result == display::DrawResult::kContextLost) {
    Release("the GPU was reset; meshes and images are loaded again");
    tried_s_ = -1e300;
    return false;
  }
  if (refused_ != renderer_->problem())
    sink_(ViewFault("a picture was not drawn: " + renderer_->problem()));
  refused_ = renderer_->problem();
  return false;
}

display::TextWidth Drawing::text_width() {
  return [this](const std::string& text, float height_px) {
    return renderer_ ? renderer_->TextWidth(text, height_px)
                     : 0.5F * height_px * static_cast<float>(text.size());
  };
}

}  // namespace plumbline::display
