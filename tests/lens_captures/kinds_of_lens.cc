// Captures during which the lens, the camera or the shutter misbehaves, and lenses that the
// five-parameter model does not describe.
#include <cmath>

#include "tests/lens_captures/kinds.h"

namespace plumbline::lens_captures {
namespace {

using Expected = Kind::Expected;

void Zoom(CameraModel& camera, double factor) {
  camera.fx *= factor;
  camera.fy *= factor;
}

/// The camera that stays is the one after the change.
Kind ZoomBeforeLast(int frames) {
  return {"zoom jumps before the last " + std::to_string(frames), Expected::kBad, "focal length",
          [frames](Conditions& c, Random& random) {
            const double change = 1 + EitherSign(random, 0.005, 0.02);
            const int first = c.views - frames;
            c.change_camera = [=](int j, CameraModel& camera) {
              if (j < first) Zoom(camera, change);
            };
          }};
}

Kind ZoomAfterFirst(int frames) {
  return {"zoom jumps after the first " + std::to_string(frames), Expected::kEither, "focal length",
          [frames](Conditions& c, Random& random) {
            const double change = 1 + EitherSign(random, 0.005, 0.02);
            c.change_camera = [=](int j, CameraModel& camera) {
              if (j < frames) Zoom(camera, change);
            };
          }};
}

/// Change of the camera at a random time between a quarter and three quarters.
Kind Halfway(const char* name, const char* words,
             const std::function<void(CameraModel&, double)>& change) {
  return {name, Expected::kBad, words, [change](Conditions& c, Random& random) {
            const int at = static_cast<int>(c.views * Uniform(random, 0.25, 0.75));
            const double size = EitherSign(random, 0.5, 1);
            c.change_camera = [=](int j, CameraModel& camera) {
              if (j < at) change(camera, size);
            };
          }};
}

/// A factor on the focal length that depends on the share of the capture that has passed.
Kind ZoomCourse(const char* name, const std::function<double(double when, double size)>& factor) {
  return {name, Expected::kBad, "focal length", [factor](Conditions& c, Random& random) {
            const double size = EitherSign(random, 0.5, 1);
            const int views = c.views;
            c.change_camera = [=](int j, CameraModel& camera) {
              Zoom(camera, factor(static_cast<double>(j) / (views - 1), size));
            };
          }};
}

Kind EachFrame(const char* name, Expected expected, const char* words,
               const std::function<void(CameraModel&, Random&)>& change) {
  return {name, expected, words, [change](Conditions& c, Random& random) {
            const auto seed = random();
            c.change_camera = [=](int j, CameraModel& camera) {
              Random own(seed + static_cast<std::uint64_t>(j) * 7919);
              change(camera, own);
            };
          }};
}

void AddLensChanges(std::vector<Kind>& kinds) {
  for (const int frames : {1, 2, 3}) kinds.push_back(ZoomBeforeLast(frames));
  Kind head_on = ZoomBeforeLast(1);
  head_on.name = "zoom jumps before a last frame seen head-on";
  head_on.words = "focal length|head-on";
  head_on.prepare = [prepare = head_on.prepare](Conditions& c, Random& random) {
    prepare(c, random);
    c.last_head_on = true;
  };
  kinds.push_back(head_on);
  for (const int frames : {1, 3}) kinds.push_back(ZoomAfterFirst(frames));
  kinds.push_back(Halfway("zoom jumps halfway", "focal length",
                          [](CameraModel& c, double size) { Zoom(c, 1 + 0.012 * size); }));
  kinds.push_back(Halfway("principal point jumps", "principal point|camera changed",
                          [](CameraModel& c, double size) { c.cx += 25 * size; }));
  kinds.push_back(Halfway("digital zoom switched off", "focal length|camera changed",
                          [](CameraModel& c, double size) {
                            Zoom(c, 1.1 + 0.05 * size);
                            c.cx += 6 * size;
                          }));
  kinds.push_back(Halfway("crop window moves", "principal point|camera changed",
                          [](CameraModel& c, double size) {
                            c.cx += 32 * size;
                            c.cy -= 20 * size;
                          }));
  kinds.push_back(Halfway("lens touched: zoom and centre", "focal length|principal point",
                          [](CameraModel& c, double size) {
                            Zoom(c, 1 + 0.004 * size);
                            c.cx += 15 * size;
                            c.cy += 10 * size;
                          }));
  kinds.push_back(ZoomCourse(
      "zoom creeps", [](double when, double size) { return 1 + 0.01 * size * (when - 1); }));
  kinds.push_back(ZoomCourse("zoom creeps in the last quarter", [](double when, double size) {
    return 1 + 0.03 * size * (std::max(when, 0.75) - 1);
  }));
  kinds.push_back(ZoomCourse("focus hunts back and forth", [](double when, double size) {
    return 1 + 0.006 * size * (std::cos(12.6 * when) - 1);
  }));
  kinds.push_back(EachFrame(
      "autofocus breathes", Expected::kBad, "focal length",
      [](CameraModel& c, Random& random) { Zoom(c, 1 + Uniform(random, -0.008, 0.008)); }));
  kinds.push_back(EachFrame("image stabilisation shifts", Expected::kEither,
                            "principal point|camera changed", [](CameraModel& c, Random& random) {
                              c.cx += Uniform(random, -25, 25);
                              c.cy += Uniform(random, -25, 25);
                            }));
  kinds.push_back({"two cameras alternate", Expected::kBad, "focal length|principal point|camera",
                   [](Conditions& c, Random& random) {
                     const double change = 1 + EitherSign(random, 0.01, 0.03);
                     c.change_camera = [=](int j, CameraModel& camera) {
                       if (j % 2 == 1) return;
                       Zoom(camera, change);
                       camera.cx += 9;
                     };
                   }});
  kinds.push_back(
      {"zoom in and back", Expected::kBad, "focal length", [](Conditions& c, Random& random) {
         const double change = 1 + EitherSign(random, 0.006, 0.02);
         const int from = c.views / 3, to = 2 * c.views / 3;
         c.change_camera = [=](int j, CameraModel& camera) {
           if (j >= from && j < to) Zoom(camera, change);
         };
       }});
}

/// Effects close to what the corners' noise hides: they may be accepted if the stated uncertainty
/// covers them, and must not be taken for another cause.
void AddSlightEffects(std::vector<Kind>& kinds) {
  Kind zoom = Halfway("zoom by 0.1 to 0.2 % halfway", "focal length",
                      [](CameraModel& c, double size) { Zoom(c, 1 + 0.002 * size); });
  Kind centre = Halfway("principal point moves by 1 to 2 px", "principal point|camera changed",
                        [](CameraModel& c, double size) { c.cx += 2 * size; });
  for (Kind* slight : {&zoom, &centre}) {
    slight->expected = Expected::kEither;
    kinds.push_back(*slight);
  }
  kinds.push_back(EachFrame(
      "focal length varies by 0.2 %", Expected::kEither, "focal length",
      [](CameraModel& c, Random& random) { Zoom(c, 1 + Uniform(random, -0.002, 0.002)); }));
  kinds.push_back(
      {"pixels slightly anamorphic", Expected::kEither, "square|aspect",
       [](Conditions& c, Random& random) { c.camera.fy *= 1 + EitherSign(random, 0.001, 0.003); }});
  kinds.push_back(
      {"thin window pane", Expected::kEither, "window|glass", [](Conditions& c, Random& random) {
         c.camera.pane.thickness_m = Uniform(random, 0.002, 0.004);
         c.camera.pane.normal = {Uniform(random, -0.5, 0.5), 0.1, 1};
       }});
  kinds.push_back(
      {"sensor slightly tilted", Expected::kEither, "distort|tilt",
       [](Conditions& c, Random& random) { c.camera.tilt = EitherSign(random, 0.002, 0.008); }});
}

/// Motion during the read-out, in pixels per read-out of the whole sensor.
Kind Rolling(const char* name, const std::function<Vector3d(int j, Random&)>& px) {
  return {name, Expected::kBad, "rolling shutter", [px](Conditions& c, Random& random) {
            const double board_m = c.board.square_m * (c.board.columns + 1);
            const double m_per_px = board_m / (0.42 * c.width);
            const auto seed = random();
            c.velocity_of = [=](int j) -> Vector3d {
              Random own(seed);
              return m_per_px * px(j, own);
            };
          }};
}

void AddShutters(std::vector<Kind>& kinds) {
  kinds.push_back(Rolling("rolling shutter, board moves down", [](int, Random& random) {
    return Vector3d(0, std::exp(Uniform(random, -0.5, 2.2)), 0);
  }));
  kinds.push_back(Rolling("rolling shutter, board moves up", [](int, Random& random) {
    return Vector3d(0, -std::exp(Uniform(random, 0.5, 2.2)), 0);
  }));
  kinds.push_back(Rolling("rolling shutter, board moves sideways", [](int, Random& random) {
    return Vector3d(EitherSign(random, 3, 9), 0, 0);
  }));
  kinds.push_back(Rolling("rolling shutter, speeds differ", [](int j, Random& random) {
    Random own(random() + static_cast<std::uint64_t>(j));
    return Vector3d(Uniform(own, -6, 6), Uniform(own, -6, 6), 0);
  }));
  kinds.push_back(Rolling("rolling shutter, down at several speeds", [](int j, Random& random) {
    const double fastest = std::exp(Uniform(random, -0.5, 2.2));
    Random own(random() + static_cast<std::uint64_t>(j));
    return Vector3d(0, fastest * Uniform(own, 0.3, 1), 0);
  }));
  kinds.push_back(Rolling("rolling shutter, board comes closer", [](int, Random& random) {
    return Vector3d(0, 0, -Uniform(random, 10, 30));
  }));
  kinds.push_back(Rolling("rolling shutter, only some frames", [](int j, Random& random) {
    return j % 3 == 0 ? Vector3d(0, Uniform(random, 4, 9), 0) : Vector3d(0, 0, 0);
  }));
  kinds.push_back({"rolling shutter, board turns", Expected::kBad, "rolling shutter",
                   [](Conditions& c, Random& random) {
                     const auto seed = random();
                     c.spin_of = [=](int j) -> Vector3d {
                       Random own(seed + static_cast<std::uint64_t>(j));
                       return {0, 0, EitherSign(own, 0.01, 0.03)};
                     };
                   }});
  kinds.push_back({"rolling shutter, camera shakes", Expected::kBad, "rolling shutter",
                   [](Conditions& c, Random& random) {
                     const auto seed = random();
                     c.spin_of = [=](int j) -> Vector3d {
                       Random own(seed + static_cast<std::uint64_t>(j));
                       return {Uniform(own, -0.02, 0.02), Uniform(own, -0.02, 0.02), 0};
                     };
                   }});
}

void AddLenses(std::vector<Kind>& kinds) {
  const auto wide = [](Conditions& c) {
    c.camera.fx = c.camera.fy = 0.42 * c.width;
    for (double& k : c.camera.k) k = 0;
  };
  kinds.push_back({"fisheye, 130 degrees", Expected::kEither, "fisheye|wide-angle|distort",
                   [wide](Conditions& c, Random& random) {
                     wide(c);
                     c.camera.fisheye = true;
                     c.camera.k[0] = Uniform(random, -0.05, 0.05);
                   }});
  kinds.push_back({"fisheye, moderate", Expected::kEither, "fisheye|wide-angle|distort",
                   [](Conditions& c, Random& random) {
                     c.camera.fx = c.camera.fy = 0.6 * c.width;
                     for (double& k : c.camera.k) k = 0;
                     c.camera.fisheye = true;
                     c.camera.k[0] = Uniform(random, -0.03, 0.03);
                   }});
  kinds.push_back({"rational distortion", Expected::kEither, "fisheye|wide-angle|distort",
                   [](Conditions& c, Random& random) {
                     c.camera.fx = c.camera.fy = 0.55 * c.width;
                     c.camera.k[0] = 0.8;
                     c.camera.k[1] = Uniform(random, 0.02, 0.08);
                     c.camera.k[3] = 1.1;
                     c.camera.k[4] = 0.2;
                   }});
  kinds.push_back({"thin prism", Expected::kEither, "distort", [](Conditions& c, Random& random) {
                     c.camera.s[0] = EitherSign(random, 0.004, 0.01);
                     c.camera.s[1] = EitherSign(random, 0.01, 0.03);
                     c.camera.s[2] = EitherSign(random, 0.004, 0.01);
                   }});
  kinds.push_back(
      {"anamorphic pixels", Expected::kEither, "square|aspect",
       [](Conditions& c, Random& random) { c.camera.fy *= 1 + EitherSign(random, 0.01, 0.06); }});
  kinds.push_back(
      {"tilted sensor", Expected::kEither, "distort|tilt",
       [](Conditions& c, Random& random) { c.camera.tilt = EitherSign(random, 0.01, 0.04); }});
  kinds.push_back({"decentred lens", Expected::kEither, "distort|principal point",
                   [](Conditions& c, Random& random) {
                     c.camera.cx += 0.07 * c.width * (random() % 2 == 0 ? 1 : -1);
                     c.camera.p[1] = EitherSign(random, 0.002, 0.004);
                   }});
  kinds.push_back(
      {"window pane, tilted", Expected::kEither, "window|glass", [](Conditions& c, Random& random) {
         c.camera.pane.thickness_m = Uniform(random, 0.006, 0.012);
         c.camera.pane.normal = {EitherSign(random, 0.3, 0.6), 0.1, 1};
       }});
  kinds.push_back({"window pane, parallel", Expected::kEither, "window|glass",
                   [](Conditions& c, Random& random) {
                     c.camera.pane.thickness_m = Uniform(random, 0.008, 0.015);
                   }});
}

}  // namespace

void AddKindsOfLens(std::vector<Kind>& kinds) {
  AddLensChanges(kinds);
  AddShutters(kinds);
  AddLenses(kinds);
  AddSlightEffects(kinds);
}

}  // namespace plumbline::lens_captures
