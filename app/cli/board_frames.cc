#include "app/cli/board_frames.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <utility>

#include "app/cli/interruption.h"
#include "app/vision/lens/board_detection.h"
#include "app/vision/lens/chessboard_detection.h"
#include "drivers/camera/image_file.h"

namespace plumbline::cli {

BoardFrames DetectBoards(const std::string& folder, const std::vector<std::string>& names,
                         const target::Board& board, Progress& progress) {
  struct Found {
    vision::BoardView view;
    image::ImageSize size;
  };
  std::vector<Found> found;
  BoardFrames frames;
  std::map<std::pair<int, int>, int> sizes;
  for (std::size_t k = 0; k < names.size() && !Interruption::Requested(); ++k) {
    progress.ShowCount(k, names.size(), "images");
    const Result<camera::GreyImage> image =
        camera::ReadImage((std::filesystem::path(folder) / names[k]).string());
    if (!image) {
      frames.refused.push_back({names[k], image.error()});
      continue;
    }
    ++sizes[{image->width, image->height}];
    const Result<vision::BoardView> view = vision::DetectBoard(image->View(), board);
    if (!view) {
      frames.refused.push_back({names[k], view.error()});
      continue;
    }
    found.push_back({*view, {image->width, image->height}});
    found.back().view.name = names[k];
    found.back().view.time_s = static_cast<double>(k);
  }
  int most = 0;
  for (const auto& [size, count] : sizes) {
    if (count <= most) continue;
    most = count;
    frames.size = {size.first, size.second};
  }
  std::string tied;
  for (const auto& [size, count] : sizes) {
    if (count == most)
      tied += fmt::format("{}{} images are {} x {} px", tied.empty() ? "" : " and ", count,
                          size.first, size.second);
  }
  if (tied.find(" and ") != std::string::npos)
    frames.size_conflict = tied + ", but a lens belongs to one size; give images of one size";
  for (Found& one : found) {
    if (one.size == frames.size) {
      frames.views.push_back(std::move(one.view));
    } else {
      frames.refused.push_back(
          {one.view.name,
           fmt::format("{} x {} px, but the lens is calibrated for {} x {}", one.size.width,
                       one.size.height, frames.size.width, frames.size.height)});
    }
  }
  return frames;
}

std::string OtherBoardHint(const std::string& folder, const std::vector<std::string>& names,
                           const target::Board& board) {
  if (board.kind != target::BoardKind::kChessboard) return "";
  std::map<std::pair<int, int>, std::size_t> seen;
  std::size_t readable = 0;
  for (const std::string& name : names) {
    const auto image = camera::ReadImage((std::filesystem::path(folder) / name).string());
    if (!image || Interruption::Requested()) continue;
    ++readable;
    if (const auto size = vision::WholeChessboardIn(image->View())) ++seen[*size];
  }
  for (const auto& [size, count] : seen) {
    if (2 * count <= readable) continue;
    return fmt::format(
        "no image shows {} x {} inner corners, but {} of {} show {} x {}; try --board {}x{}",
        board.columns, board.rows, count, readable, size.first, size.second, size.first,
        size.second);
  }
  return "";
}

}  // namespace plumbline::cli
