// Disturbances of a capture by the part that they belong to: fixed in the image, fixed on the
// board, of one view, in the course of time, or of the detector. Their size is random, from
// harmless to gross.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tests/lens_captures/kinds.h"

namespace plumbline::lens_captures {
namespace {

using Expected = Kind::Expected;
using Views = std::vector<vision::BoardView>;

// Words of which a refusal contains one if it names the part.
constexpr const char* kInImage = "fixed in the image|distort|window|fisheye";
constexpr const char* kOnBoard = "board|print|flat|glass";
constexpr const char* kOfView =
    "rame to frame|rolling shutter|not fit|cannot be used|two states|pixels are not square|fy / fx "
    "is";
constexpr const char* kInTime = "changed|moved|bent|from the first|rame to frame|two states";
constexpr const char* kOfDetector = "rame to frame|not fit|cannot be used";

constexpr double kPi = std::numbers::pi;

/// Log-uniform.
double Size(Random& random, double low, double high) {
  return low * std::pow(high / low, Uniform(random, 0, 1));
}

Random OfView(std::uint64_t seed, std::size_t j) {
  Random own(seed + 7919 * static_cast<std::uint64_t>(j));
  own.discard(3);
  return own;
}

/// A sum of a few plane waves of random directions and phases; values of about one.
struct Waves {
  std::array<Vector2d, 6> along;
  std::array<double, 6> phase{};
  /// @param shortest  wavelength, in units of the argument
  Waves(Random& random, double shortest) {
    for (std::size_t k = 0; k < along.size(); ++k) {
      const double angle = Uniform(random, 0, 2 * kPi);
      along[k] = 2 * kPi / Size(random, shortest, 2.5 * shortest) *
                 Vector2d(std::cos(angle), std::sin(angle));
      phase[k] = Uniform(random, 0, 2 * kPi);
    }
  }
  double At(const Vector2d& at) const {
    double sum = 0;
    for (std::size_t k = 0; k < along.size(); ++k) sum += std::sin(along[k].dot(at) + phase[k]);
    return 0.5 * sum;
  }
};

/// Displacement at (x / width, y / width) from the middle of the image, for a size of 1.
using Shape = std::function<Vector2d(const Vector2d&)>;
using ShapeMaker = std::function<Shape(Random&)>;

ShapeMaker Waving(double shortest) {
  return [shortest](Random& random) -> Shape {
    const Waves x(random, shortest), y(random, shortest);
    return [=](const Vector2d& q) { return Vector2d(x.At(q), y.At(q)); };
  };
}

/// A drop that pulls towards its middle. @param reach  its radius, share of the image's width
ShapeMaker Drop(double least_reach, double most_reach, double off_centre = 0.35) {
  return [=](Random& random) -> Shape {
    const double reach = Uniform(random, least_reach, most_reach);
    const Vector2d at(off_centre * Uniform(random, -1, 1),
                      0.6 * off_centre * Uniform(random, -1, 1));
    return [=](const Vector2d& q) {
      const double r = (q - at).norm() / reach;
      return r < 1 ? Vector2d(-2.6 * (q - at) / reach * (1 - r * r)) : Vector2d(0, 0);
    };
  };
}

Shape ShapeOfStep(double angle, double off, const Vector2d& size) {
  const Vector2d across(std::cos(angle), std::sin(angle));
  return [=](const Vector2d& q) { return q.dot(across) > off ? size : Vector2d(0, 0); };
}

std::function<Vector2d(const Vector2d&)> FieldOf(const Shape& shape, double size_px, int width,
                                                 int height) {
  const Vector2d middle(0.5 * width, 0.5 * height);
  return [=](const Vector2d& pixel) { return Vector2d(size_px * shape((pixel - middle) / width)); };
}

void AddFields(std::vector<Kind>& kinds) {
  const auto add = [&](const char* name, double least_px, double most_px, ShapeMaker make) {
    kinds.push_back({std::string("image: ") + name, Expected::kEither, kInImage,
                     [=](Conditions& c, Random& random) {
                       const double size_px = Size(random, least_px, most_px);
                       c.camera.field = FieldOf(make(random), size_px, c.width, c.height);
                     }});
  };
  add("drop", 0.5, 4, Drop(0.04, 0.1));
  add("large drop", 0.3, 3, Drop(0.1, 0.25));
  add("drop in the middle", 0.5, 4, Drop(0.05, 0.1, 0.05));
  add("two drops", 0.5, 4, [](Random& random) -> Shape {
    const Shape a = Drop(0.03, 0.08)(random), b = Drop(0.03, 0.08)(random);
    return [=](const Vector2d& q) { return Vector2d(a(q) + b(q)); };
  });
  add("smear", 0.3, 3, [](Random& random) -> Shape {
    const double y0 = Uniform(random, -0.2, 0.2), size = EitherSign(random, 0.7, 1);
    return [=](const Vector2d& q) {
      return Vector2d(0, size * std::exp(-std::pow((q.y() - y0) / 0.03, 2)));
    };
  });
  add("windscreen", 0.1, 2, Waving(0.6));
  add("wavy window", 0.1, 1.5, Waving(0.25));
  add("ripples", 0.05, 1, Waving(0.1));
  add("seam of the sensor", 0.1, 2, [](Random& random) {
    return ShapeOfStep(0, Uniform(random, -0.2, 0.2), {0, EitherSign(random, 0.7, 1)});
  });
  add("missing columns", 0.2, 2, [](Random& random) {
    return ShapeOfStep(0, Uniform(random, -0.2, 0.2), {EitherSign(random, 0.7, 1), 0});
  });
  add("missing rows", 0.2, 2, [](Random& random) {
    return ShapeOfStep(kPi / 2, Uniform(random, -0.15, 0.15), {0, EitherSign(random, 0.7, 1)});
  });
  add("edge of the glass", 0.3, 4, [](Random& random) -> Shape {
    const double side = EitherSign(random, 1, 1);
    return [=](const Vector2d& q) {
      return Vector2d(std::exp((side * q.x() - 0.5) / 0.07),
                      0.3 * std::exp((side * q.x() - 0.5) / 0.1));
    };
  });
  add("ring of the lens", 0.2, 2, [](Random& random) -> Shape {
    const double at = Uniform(random, 0.2, 0.4);
    return [=](const Vector2d& q) {
      const double r = q.norm();
      return Vector2d(q / std::max(r, 1e-6) * std::exp(-std::pow((r - at) / 0.05, 2)));
    };
  });
  add("high order distortion", 0.3, 4, [](Random&) -> Shape {
    return [](const Vector2d& q) { return Vector2d(q / 0.57 * std::pow(q.norm() / 0.57, 10)); };
  });
  add("half of the image scaled", 0.3, 3, [](Random& random) -> Shape {
    const double side = EitherSign(random, 1, 1);
    return [=](const Vector2d& q) {
      return Vector2d(side * q.x() > 0 ? 2 * q.x() : 0, side * q.x() > 0 ? 2 * q.y() : 0);
    };
  });
  add("plume of warm air, steady", 0.1, 1.5, [](Random& random) -> Shape {
    const Waves x(random, 0.2), y(random, 0.2);
    return [=](const Vector2d& q) {
      const double w = 1 / (1 + std::exp(-q.y() / 0.05));
      return Vector2d(w * x.At(q), w * y.At(q));
    };
  });
}

/// Displacement of a board's point at (x, y) / half width, for a size of 1: shares of half width.
using Form = std::function<Vector3d(const Vector2d&)>;

void AddBoards(std::vector<Kind>& kinds) {
  const auto add = [&](const char* name, double least, double most,
                       const std::function<Form(Random&)>& make) {
    kinds.push_back({std::string("board: ") + name, Expected::kEither, kOnBoard,
                     [=](Conditions& c, Random& random) {
                       const double half = c.board.Centre().x(), size = Size(random, least, most);
                       const Form form = make(random);
                       c.deform = [=](int, const Vector3d& p) {
                         return Vector3d(p + half * size * form(Vector2d(p.x(), p.y()) / half));
                       };
                     }});
  };
  const auto always = [](Form form) { return [form](Random&) { return form; }; };
  add("flat in the middle, bent at the ends", 1e-3, 2e-2,
      always([](const Vector2d& q) { return Vector3d(0, 0, std::pow(q.x(), 4)); }));
  add("twisted unevenly", 1e-3, 2e-2,
      always([](const Vector2d& q) { return Vector3d(0, 0, q.x() * q.x() * q.y()); }));
  add("one corner off by a step", 1e-3, 1e-2,
      always([](const Vector2d& q) { return Vector3d(q.x() > 0.5 && q.y() > 0.2 ? 1 : 0, 0, 0); }));
  add("trapezoid print", 2e-4, 5e-3,
      always([](const Vector2d& q) { return Vector3d(q.x() * q.y(), 0, 0); }));
  add("progressive print", 2e-4, 5e-3,
      always([](const Vector2d& q) { return Vector3d(q.x() * q.x(), 0, 0); }));
  add("print stretched", 1e-4, 2e-2,
      always([](const Vector2d& q) { return Vector3d(q.x(), 0, 0); }));
  add("print sheared", 1e-4, 1e-2, always([](const Vector2d& q) { return Vector3d(q.y(), 0, 0); }));
  add("periodic paper feed", 2e-4, 4e-3,
      always([](const Vector2d& q) { return Vector3d(0, std::sin(9 * q.y()), 0); }));
  add("half sheet turned", 2e-4, 5e-3, always([](const Vector2d& q) {
        return q.x() > 0.1 ? Vector3d(-q.y(), q.x() - 0.1, 0) : Vector3d(0, 0, 0);
      }));
  add("wet paper", 1e-3, 2e-2, [](Random& random) -> Form {
    const Waves z(random, 0.8);
    return [=](const Vector2d& q) { return Vector3d(0, 0, z.At(q)); };
  });
  add("crumpled paper", 1e-3, 1e-2, [](Random& random) -> Form {
    const Waves z(random, 0.3), x(random, 0.5);
    return [=](const Vector2d& q) { return Vector3d(0.2 * x.At(q), 0, z.At(q)); };
  });
  add("two plates with a kink", 1e-3, 2e-2,
      always([](const Vector2d& q) { return Vector3d(0, 0, std::max(0.0, q.x() - 0.1)); }));
  add("two plates with a step", 1e-3, 2e-2,
      always([](const Vector2d& q) { return Vector3d(0, 0, q.x() > 0.1 ? 1 : 0); }));
  kinds.push_back({"board: one point printed wrongly", Expected::kEither, kOnBoard,
                   [](Conditions& c, Random& random) {
                     const double size = Size(random, 1e-4, 3e-3), square = c.board.square_m;
                     const lens::Vec2 at =
                         c.board.Corner(static_cast<int>(random() % c.board.corners())) -
                         c.board.Centre();
                     c.deform = [=](int, const Vector3d& p) {
                       const bool here = (p.head<2>() - at).norm() < 0.3 * square;
                       return Vector3d(p + Vector3d(here ? size : 0, 0, 0));
                     };
                   }});
  kinds.push_back(
      {"board: points printed with errors", Expected::kEither, kOnBoard,
       [](Conditions& c, Random& random) { c.print_noise_m = Size(random, 1e-5, 3e-4); }});
  kinds.push_back(
      {"board: thin glass on it", Expected::kEither, kOnBoard, [](Conditions& c, Random& random) {
         c.board_glass.thickness_m = Size(random, 5e-4, 8e-3);
       }});
}

/// A displacement of the corners of each view, after they have been projected, in pixels.
Kind OfEachView(const char* name, const char* words,
                const std::function<std::function<void(std::size_t j, vision::BoardView&)>(
                    const Conditions&, Random&)>& make) {
  return {name, Expected::kEither, words, [make](Conditions& c, Random& random) {
            const auto change = make(c, random);
            c.change_views = [change](Views& views) {
              for (std::size_t j = 0; j < views.size(); ++j) change(j, views[j]);
            };
          }};
}

/// The camera turns while a frame is read out: pixels move with the row, times (row / height -
/// 1/2).
/// @param variation  of the speed from frame to frame, at most
Kind CameraTurns(
    const char* name, double least_px, double most_px, double variation,
    const std::function<Vector2d(const Vector2d& q, std::size_t j, Random& own)>& speed) {
  return OfEachView(name, kOfView, [=](const Conditions& c, Random& random) {
    const double size_px = Size(random, least_px, most_px);
    const double varies = variation > 0 ? Size(random, 0.1 * variation, variation) : 0;
    const auto seed = random();
    const int width = c.width, height = c.height;
    return [=](std::size_t j, vision::BoardView& view) {
      Random faster = OfView(seed + 1, j);
      const double of_view_px = size_px * (1 + Uniform(faster, -varies, varies));
      for (auto& p : view.corners_px) {
        Random own = OfView(seed, j);
        const Vector2d q((p.x() - 0.5 * width) / width, (p.y() - 0.5 * height) / width);
        p += (p.y() / height - 0.5) * of_view_px * speed(q, j, own);
      }
    };
  });
}

ShapeMaker Haze(double shortest) {
  return Waving(shortest);
}

Kind HazeKind(const char* name, double shortest, double least_px, double most_px,
              std::size_t every) {
  return OfEachView(name, kOfView, [=](const Conditions& c, Random& random) {
    const double size_px = Size(random, least_px, most_px);
    const auto seed = random();
    const int width = c.width, height = c.height;
    return [=](std::size_t j, vision::BoardView& view) {
      if (j % every != 0) return;
      Random own = OfView(seed, j);
      const auto field = FieldOf(Haze(shortest)(own), size_px, width, height);
      for (auto& p : view.corners_px) p += field(p);
    };
  });
}

void AddMotions(std::vector<Kind>& kinds) {
  kinds.push_back(
      CameraTurns("view: camera tilts steadily", 0.3, 15, 0,
                  [](const Vector2d&, std::size_t, Random&) { return Vector2d(0, 1); }));
  kinds.push_back(
      CameraTurns("view: camera tilts back steadily", 0.3, 15, 0.2,
                  [](const Vector2d&, std::size_t, Random&) { return Vector2d(0, -1); }));
  kinds.push_back(
      CameraTurns("view: camera pans steadily", 0.3, 15, 0.2,
                  [](const Vector2d&, std::size_t, Random&) { return Vector2d(1, 0); }));
  kinds.push_back(CameraTurns(
      "view: camera rolls steadily", 0.3, 15, 0.2,
      [](const Vector2d& q, std::size_t, Random&) { return Vector2d(-2 * q.y(), 2 * q.x()); }));
  kinds.push_back(CameraTurns(
      "view: camera tilts in some frames", 0.5, 15, 0,
      [](const Vector2d&, std::size_t j, Random&) { return Vector2d(0, j % 4 == 1 ? 1 : 0); }));
  kinds.push_back(CameraTurns("view: camera pans to and fro", 0.3, 10, 0,
                              [](const Vector2d&, std::size_t j, Random&) {
                                return Vector2d(std::sin(1.7 * static_cast<double>(j)), 0);
                              }));
  kinds.push_back(CameraTurns(
      "view: hand-held camera", 0.3, 10, 0, [](const Vector2d& q, std::size_t, Random& own) {
        const double roll = Uniform(own, -2, 2);
        return Vector2d(Uniform(own, -1, 1) - roll * q.y(), Uniform(own, -1, 1) + roll * q.x());
      }));
  kinds.push_back(
      CameraTurns("view: board comes closer while it is read", 0.5, 15, 0.5,
                  [](const Vector2d& q, std::size_t, Random&) { return Vector2d(2 * q); }));
  kinds.push_back(
      OfEachView("view: camera vibrates", kOfView, [](const Conditions& c, Random& random) {
        const double size_px = Size(random, 0.05, 2), periods = Uniform(random, 1, 8);
        const auto seed = random();
        const int height = c.height;
        return [=](std::size_t j, vision::BoardView& view) {
          Random own = OfView(seed, j);
          const double phase = Uniform(own, 0, 2 * kPi);
          for (auto& p : view.corners_px)
            p +=
                size_px * std::sin(2 * kPi * periods * p.y() / height + phase) * lens::Vec2(0.4, 1);
        };
      }));
  kinds.push_back(HazeKind("view: haze, wide", 0.5, 0.05, 1, 1));
  kinds.push_back(HazeKind("view: haze, fine", 0.08, 0.05, 0.6, 1));
  kinds.push_back(HazeKind("view: haze in some frames", 0.25, 0.1, 2, 3));
  kinds.push_back(OfEachView("view: glare", kOfDetector, [](const Conditions&, Random& random) {
    const double size_px = Size(random, 0.5, 12);
    const auto seed = random();
    return [=](std::size_t j, vision::BoardView& view) {
      Random own = OfView(seed, j);
      const auto n = view.corners_px.size();
      const std::size_t first = own() % n;
      for (std::size_t k = first; k < std::min(n, first + 5); ++k)
        view.corners_px[k] += size_px * lens::Vec2(Uniform(own, -1, 1), Uniform(own, -1, 1));
    };
  }));
  kinds.push_back(
      OfEachView("view: edge of a shadow", kOfDetector, [](const Conditions& c, Random& random) {
        const double size_px = Size(random, 0.1, 2);
        const auto seed = random();
        const double width = c.width;
        return [=](std::size_t j, vision::BoardView& view) {
          Random own = OfView(seed, j);
          const double at = Uniform(own, 0.3, 0.7) * width;
          for (auto& p : view.corners_px)
            p.x() += size_px * std::exp(-std::pow((p.x() - at) / (0.03 * width), 2));
        };
      }));
  kinds.push_back(
      {"view: paper flutters", Expected::kEither, kOfView, [](Conditions& c, Random& random) {
         const double size = Size(random, 0.03, 2);
         const auto seed = random();
         c.deform = [=](int j, const Vector3d& p) {
           Random own = OfView(seed, static_cast<std::size_t>(j));
           const double a = Uniform(own, -1, 1), b = Uniform(own, -1, 1);
           return Vector3d(p + Vector3d(0, 0, size * (a * p.x() * p.x() + b * p.y() * p.x())));
         };
       }});
}

/// A change of the camera in view j of n, by a size with sign.
using CameraCourse = std::function<void(CameraModel&, double when, double size)>;

void AddCourses(std::vector<Kind>& kinds) {
  const auto add = [&](const char* name, double least, double most, const CameraCourse& change) {
    kinds.push_back({std::string("time: ") + name, Expected::kEither, kInTime,
                     [=](Conditions& c, Random& random) {
                       const double size = Size(random, least, most) * EitherSign(random, 1, 1);
                       const int views = c.views;
                       c.change_camera = [=](int j, CameraModel& camera) {
                         change(camera, static_cast<double>(j) / (views - 1), size);
                       };
                     }});
  };
  const auto zoom = [](CameraModel& c, double ratio) { c.fx *= 1 + ratio, c.fy *= 1 + ratio; };
  const auto before = [](double when, double at) { return when < at ? 1.0 : 0.0; };
  const auto edge2 = [](const CameraModel& c) {
    return std::pow((c.cx * c.cx + c.cy * c.cy) / (c.fx * c.fx), 1);
  };
  add("distortion changes halfway", 2e-4, 1e-2, [=](CameraModel& c, double when, double size) {
    c.k[0] += size * before(when, 0.5) / edge2(c);
  });
  add("distortion drifts", 2e-4, 1e-2,
      [=](CameraModel& c, double when, double size) { c.k[0] += size * (1 - when) / edge2(c); });
  add("aspect changes halfway", 2e-4, 1e-2,
      [=](CameraModel& c, double when, double size) { c.fy *= 1 + size * before(when, 0.5); });
  add("centre drifts", 0.3, 40, [](CameraModel& c, double when, double size) {
    c.cx += size * (1 - when), c.cy += 0.6 * size * (1 - when);
  });
  add("centre sags to and fro", 0.3, 20, [](CameraModel& c, double when, double size) {
    c.cy += size * std::sin(9 * when) - size * std::sin(9.0);
  });
  add("warm-up of the focal length", 3e-4, 2e-2, [=](CameraModel& c, double when, double size) {
    zoom(c, size * (std::exp(-4 * when) - std::exp(-4.0)));
  });
  add("warm-up of lens and sensor", 3e-4, 2e-2, [=](CameraModel& c, double when, double size) {
    const double left = std::exp(-4 * when) - std::exp(-4.0);
    zoom(c, size * left), c.cx += 500 * size * left, c.k[0] += size * left / edge2(c);
  });
  add("focal length drifts early", 3e-4, 2e-2,
      [=](CameraModel& c, double when, double size) { zoom(c, size * std::max(0.0, 0.5 - when)); });
  add("focal length oscillates", 3e-4, 1e-2, [=](CameraModel& c, double when, double size) {
    zoom(c, size * (std::sin(20 * when) - std::sin(20.0)));
  });
  add("another lens halfway", 1e-3, 3e-2, [=](CameraModel& c, double when, double size) {
    const double b = before(when, 0.5);
    zoom(c, size * b), c.cx += 300 * size * b, c.cy -= 400 * size * b,
        c.k[0] -= size * b / edge2(c);
  });
  add("jump before the last quarter", 3e-4, 1e-2,
      [=](CameraModel& c, double when, double size) { zoom(c, size * before(when, 0.77)); });
  add("knock and back", 1e-3, 2e-2, [=](CameraModel& c, double when, double size) {
    if (when > 0.4 && when < 0.6) zoom(c, size), c.cx += 400 * size;
  });
  add("sensor tilts halfway", 1e-4, 1e-2,
      [=](CameraModel& c, double when, double size) { c.tilt += size * before(when, 0.5); });
  kinds.push_back({"time: a drop falls halfway", Expected::kEither,
                   "fixed in the image|changed|moved", [](Conditions& c, Random& random) {
                     const auto field =
                         FieldOf(Drop(0.05, 0.12)(random), Size(random, 0.5, 4), c.width, c.height);
                     c.camera.field = field;
                     const int half = c.views / 2;
                     c.change_camera = [=](int j, CameraModel& camera) {
                       if (j < half) camera.field = nullptr;
                     };
                   }});
  kinds.push_back({"time: a drop dries", Expected::kEither, "fixed in the image|changed|moved",
                   [](Conditions& c, Random& random) {
                     const auto field =
                         FieldOf(Drop(0.05, 0.12)(random), Size(random, 0.5, 4), c.width, c.height);
                     const int half = c.views / 2;
                     c.change_camera = [=](int j, CameraModel& camera) {
                       if (j < half) camera.field = field;
                     };
                   }});
  const auto board =
      [&](const char* name, double least, double most,
          const std::function<Vector3d(const Vector3d&, double when, double size)>& deform) {
        kinds.push_back({std::string("time: ") + name, Expected::kEither, kInTime,
                         [=](Conditions& c, Random& random) {
                           const double size = Size(random, least, most) * EitherSign(random, 1, 1);
                           const int views = c.views;
                           c.deform = [=](int j, const Vector3d& p) {
                             return deform(p, static_cast<double>(j) / (views - 1), size);
                           };
                         }});
      };
  board("board bends slowly", 0.01, 1, [](const Vector3d& p, double when, double size) {
    return Vector3d(p.x(), p.y(), p.z() + size * when * p.x() * p.x());
  });
  board("board bends halfway", 0.01, 1, [](const Vector3d& p, double when, double size) {
    return Vector3d(p.x(), p.y(), p.z() + (when < 0.5 ? 0 : size) * p.x() * p.x());
  });
  board("paper shrinks across", 1e-4, 5e-3, [](const Vector3d& p, double when, double size) {
    return Vector3d(p.x() * (1 + size * when), p.y(), p.z());
  });
  kinds.push_back(CameraTurns(
      "time: camera tilts in the second half", 0.5, 15, 0,
      [](const Vector2d&, std::size_t j, Random&) { return Vector2d(0, j > 11 ? 1 : 0); }));
}

void AddDetectors(std::vector<Kind>& kinds) {
  const auto each =
      [&](const char* name, double least, double most,
          const std::function<lens::Vec2(const lens::Vec2&, double size, Random&)>& error) {
        kinds.push_back(OfEachView(name, kOfDetector, [=](const Conditions&, Random& random) {
          const double size = Size(random, least, most);
          const auto seed = random();
          return [=](std::size_t j, vision::BoardView& view) {
            Random own = OfView(seed, j);
            for (auto& p : view.corners_px) p += error(p, size, own);
          };
        }));
      };
  each("detector: noise", 0.05, 0.5, [](const lens::Vec2&, double size, Random& own) {
    std::normal_distribution<double> N(0, size);
    return lens::Vec2(N(own), N(own));
  });
  each("detector: long tails", 0.02, 0.2, [](const lens::Vec2&, double size, Random& own) {
    std::student_t_distribution<double> T(2.2);
    return lens::Vec2(size * T(own), size * T(own));
  });
  each("detector: noise along the rows", 0.05, 0.5,
       [](const lens::Vec2&, double size, Random& own) {
         std::normal_distribution<double> N(0, size);
         return lens::Vec2(N(own), 0);
       });
  each("detector: one corner in thirty wrong", 0.5, 10,
       [](const lens::Vec2&, double size, Random& own) {
         const double x = Uniform(own, -size, size), y = Uniform(own, -size, size);
         return Uniform(own, 0, 1) < 1.0 / 30 ? lens::Vec2(x, y) : lens::Vec2(0, 0);
       });
  each("detector: rounded", 0.06, 1, [](const lens::Vec2& p, double size, Random&) {
    return lens::Vec2(size * std::round(p.x() / size) - p.x(),
                      size * std::round(p.y() / size) - p.y());
  });
  each("detector: locked to pixels", 0.02, 0.2, [](const lens::Vec2& p, double size, Random&) {
    return lens::Vec2(size * std::sin(2 * kPi * p.x()), size * std::sin(2 * kPi * p.y()));
  });
  each("detector: blocks of a codec", 0.02, 0.3, [](const lens::Vec2& p, double size, Random&) {
    return lens::Vec2(size * std::sin(kPi * p.x() / 4), size * std::sin(kPi * p.y() / 4));
  });
  each("detector: ghost image", 0.05, 0.6, [](const lens::Vec2& p, double size, Random& own) {
    return lens::Vec2(size * (Uniform(own, 0, 1) < 0.5 ? 1 : 0), 0.3 * size * std::sin(p.x()));
  });
  kinds.push_back(
      OfEachView("detector: corners missing", kOfDetector, [](const Conditions&, Random& random) {
        const double share = Uniform(random, 0.05, 0.4);
        const auto seed = random();
        return [=](std::size_t j, vision::BoardView& view) {
          Random own = OfView(seed, j);
          for (std::size_t k = 0; k < view.seen.size(); ++k)
            view.seen[k] = Uniform(own, 0, 1) > share;
        };
      }));
  kinds.push_back(OfEachView("detector: drawn outwards from the board's middle", kOnBoard,
                             [](const Conditions&, Random& random) {
                               const double size =
                                   EitherSign(random, 1, 1) * Size(random, 1e-5, 1e-3);
                               return [=](std::size_t, vision::BoardView& view) {
                                 lens::Vec2 middle = lens::Vec2::Zero();
                                 for (const auto& p : view.corners_px)
                                   middle += p / static_cast<double>(view.corners_px.size());
                                 for (auto& p : view.corners_px)
                                   p += size * std::abs(p.x() - middle.x()) * lens::Vec2(1, 0);
                               };
                             }));
  kinds.push_back(OfEachView("detector: board counted wrongly in some frames", kOfDetector,
                             [](const Conditions& c, Random&) {
                               const int columns = c.board.columns;
                               return [columns](std::size_t j, vision::BoardView& view) {
                                 if (j % 9 != 4) return;
                                 std::rotate(view.corners_px.begin(),
                                             view.corners_px.begin() + columns,
                                             view.corners_px.end());
                               };
                             }));
  kinds.push_back(
      {"detector: noise grows", Expected::kEither, kOfDetector, [](Conditions& c, Random& random) {
         const double size = Size(random, 0.05, 0.5);
         const auto seed = random();
         c.change_views = [=](Views& views) {
           Random own(seed);
           for (std::size_t j = 0; j < views.size(); ++j) {
             std::normal_distribution<double> N(
                 0, size * static_cast<double>(j + 1) / static_cast<double>(views.size()));
             for (auto& p : views[j].corners_px) p += lens::Vec2(N(own), N(own));
           }
         };
       }});
}

void AddConfounded(std::vector<Kind>& kinds) {
  kinds.push_back({"confounded: burst of one second", Expected::kEither,
                   "views|tilt|excluded|corners", [](Conditions& c, Random& random) {
                     c.max_tilt_rad = Size(random, 0.02, 0.2);
                     c.max_roll_rad = 0.05;
                     c.spread = 0.05;
                   }});
  kinds.push_back({"confounded: burst and a pane", Expected::kEither,
                   "views|tilt|excluded|window|corners", [](Conditions& c, Random& random) {
                     c.max_tilt_rad = Size(random, 0.05, 0.3);
                     c.max_roll_rad = 0.1;
                     c.spread = 0.1;
                     c.camera.pane.thickness_m = Size(random, 1e-3, 1e-2);
                     c.camera.pane.normal = {EitherSign(random, 0.1, 0.5), 0, 1};
                   }});
  kinds.push_back(
      {"confounded: focus follows the distance", Expected::kEither,
       "focal length|rame to frame|excluded|corners", [](Conditions& c, Random& random) {
         // A focal length that grows with the board's size in the image.
         const double size = EitherSign(random, 1, 1) * Size(random, 1e-4, 1e-2);
         const Vector2d centre(c.camera.cx, c.camera.cy);
         const auto span = [=](const vision::BoardView& view) {
           return (view.corners_px.back() - view.corners_px.front()).norm() / centre.x();
         };
         c.change_views = [=](Views& views) {
           const double last = span(views.back());
           for (auto& view : views) {
             const double zoom = 1 + size * (span(view) - last);
             for (auto& p : view.corners_px) p = centre + zoom * (p - centre);
           }
         };
       }});
  kinds.push_back({"confounded: pixels not square", Expected::kEither, "square|fy / fx is",
                   [](Conditions& c, Random& random) {
                     c.camera.fy *= 1 + EitherSign(random, 1, 1) * Size(random, 3e-4, 7e-2);
                   }});
  kinds.push_back(
      {"confounded: pane", Expected::kEither, "window|glass|excluded",
       [](Conditions& c, Random& random) {
         c.camera.pane.thickness_m = Size(random, 5e-4, 1.5e-2);
         c.camera.pane.normal = {Uniform(random, -0.5, 0.5), Uniform(random, -0.3, 0.3), 1};
       }});
}

}  // namespace

void AddKindsByPart(std::vector<Kind>& kinds) {
  AddFields(kinds);
  AddBoards(kinds);
  AddMotions(kinds);
  AddCourses(kinds);
  AddDetectors(kinds);
  AddConfounded(kinds);
}

}  // namespace plumbline::lens_captures
