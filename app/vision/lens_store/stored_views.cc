#include "app/vision/lens_store/stored_views.h"

#include <fmt/format.h>

#include <cmath>

#include "app/base/text/json_integer.h"
#include "app/base/text/json_text.h"

namespace plumbline::vision {
namespace {

using Json = nlohmann::json;

constexpr double kMmPerMetre = 1e3, kPerPixel = 1e5;
constexpr double kMaxPixel = 1e6;

Json Point(const lens::Vec2& p) {
  return {std::round(kPerPixel * p.x()) / kPerPixel, std::round(kPerPixel * p.y()) / kPerPixel};
}

/// Throws on malformed input, as the JSON library does; DecodeViews() catches both.
target::Board BoardFrom(const Json& json) {
  target::Board board;
  const auto kind = target::BoardKindOfName(json.at("kind").get<std::string>());
  if (!kind) throw std::runtime_error("unknown kind of board");
  board.kind = *kind;
  board.columns = text::IntegerFromJson<int>(json.at("columns"));
  board.rows = text::IntegerFromJson<int>(json.at("rows"));
  board.square_m = json.at("square_mm").get<double>() / kMmPerMetre;
  board.marker_m = json.at("mark_mm").get<double>() / kMmPerMetre;
  board.family = json.at("family").get<std::string>();
  if (const auto fault = FaultOf(board)) {
    throw std::runtime_error(fmt::format("{}: {}", fault->key, fault->message));
  }
  return board;
}

BoardView ViewFrom(const Json& json, const target::Board& board, std::size_t number) {
  BoardView view;
  view.name = fmt::format("view {}", number);
  view.time_s = json.at("t_s").get<double>();
  view.blur_px = json.at("blur_px").get<double>();
  for (const Json& point : json.at("points_px")) {
    view.seen.push_back(!point.is_null());
    view.corners_px.emplace_back(0, 0);
    if (point.is_null()) continue;
    if (point.size() != 2) throw std::runtime_error("a point is not [u, v]");
    view.corners_px.back() = {point.at(0).get<double>(), point.at(1).get<double>()};
    if (!(view.corners_px.back().cwiseAbs().maxCoeff() <= kMaxPixel)) {
      throw std::runtime_error("a point is outside any image");
    }
  }
  if (view.seen.size() != static_cast<std::size_t>(board.corners())) {
    throw std::runtime_error("the number of points does not match the board");
  }
  return view;
}

}  // namespace

std::vector<std::uint8_t> EncodeViews(const StoredViews& stored) {
  const target::Board& board = stored.board;
  Json views = Json::array();
  for (const BoardView& view : stored.views) {
    Json points = Json::array();
    for (std::size_t k = 0; k < view.corners_px.size(); ++k) {
      points.push_back(view.seen[k] ? Point(view.corners_px[k]) : Json(nullptr));
    }
    views.push_back({{"t_s", view.time_s}, {"blur_px", view.blur_px}, {"points_px", points}});
  }
  const Json json = {{"schema", 1},
                     {"board",
                      {{"kind", NameOf(board.kind)},
                       {"columns", board.columns},
                       {"rows", board.rows},
                       {"square_mm", board.square_m * kMmPerMetre},
                       {"mark_mm", board.marker_m * kMmPerMetre},
                       {"family", board.family}}},
                     {"views", views}};
  const std::string text = text::JsonText(json);
  return {text.begin(), text.end()};
}

Result<StoredViews> DecodeViews(std::span<const std::uint8_t> bytes) {
  StoredViews stored;
  try {
    const auto read =
        text::JsonFromText({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    if (!read) return read.failure();
    const Json& json = *read;
    if (json.at("schema") != 1) return Error{"the schema is not 1"};
    stored.board = BoardFrom(json.at("board"));
    for (const Json& view : json.at("views")) {
      stored.views.push_back(ViewFrom(view, stored.board, stored.views.size() + 1));
    }
  } catch (const std::exception& error) {
    return Error{error.what()};
  }
  return stored;
}

}  // namespace plumbline::vision
