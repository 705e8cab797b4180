// Boards that are not what they are declared to be, captures without information, frames that a
// driver spoils, and good captures.
#include <algorithm>
#include <cmath>

#include "tests/lens_captures/kinds.h"

namespace plumbline::lens_captures {
namespace {

using Expected = Kind::Expected;
using Views = std::vector<vision::BoardView>;

/// A board whose points are displaced, the same in all views. `half` is half the board's width [m].
Kind Deformed(const char* name, Expected expected, const char* words,
              const std::function<Vector3d(const Vector3d&, double half, double size)>& deform) {
  return {name, expected, words, [deform](Conditions& c, Random& random) {
            const double half = c.board.Centre().x(), size = EitherSign(random, 0.5, 1);
            c.deform = [=](int, const Vector3d& p) { return deform(p, half, size); };
          }};
}

void AddPrints(std::vector<Kind>& kinds) {
  const char* stretch = "stretched|aspect|square";
  kinds.push_back(Deformed("print stretched along its rows", Expected::kBad, stretch,
                           [](const Vector3d& p, double, double size) {
                             return Vector3d(p.x() * (1 + 0.015 * size), p.y(), p.z());
                           }));
  kinds.push_back(Deformed("print stretched slightly", Expected::kEither, stretch,
                           [](const Vector3d& p, double, double size) {
                             return Vector3d(p.x(), p.y() * (1 + 0.003 * size), p.z());
                           }));
  kinds.push_back(Deformed("print skewed", Expected::kBad, "stretched|skewed",
                           [](const Vector3d& p, double, double size) {
                             return Vector3d(p.x() + 0.01 * size * p.y(), p.y(), p.z());
                           }));
  kinds.push_back(Deformed("squares declared wrong: not square", Expected::kBad, stretch,
                           [](const Vector3d& p, double, double size) {
                             return Vector3d(p.x(), p.y() * (1 + 0.1 * size), p.z());
                           }));
  kinds.push_back(Deformed("printer's paper feed slips", Expected::kEither, "print|uneven",
                           [](const Vector3d& p, double half, double size) {
                             const double s = p.x() / half;
                             return Vector3d(p.x() + 0.0008 * size * s * s, p.y(), p.z());
                           }));
  kinds.push_back(Deformed("two sheets joined with a gap", Expected::kEither, "print|uneven",
                           [](const Vector3d& p, double, double size) {
                             return Vector3d(p.x() + (p.x() > 0 ? 0.0006 * size : 0), p.y(), p.z());
                           }));
  kinds.push_back(Deformed("print barrel-shaped", Expected::kEither, "print|uneven|distort",
                           [](const Vector3d& p, double half, double size) {
                             const double r2 = p.head<2>().squaredNorm() / (half * half);
                             return Vector3d(p * (1 + 0.006 * size * r2));
                           }));
  kinds.push_back({"corners printed with errors of 0.15 mm", Expected::kEither,
                   "print|uneven|match", [](Conditions& c, Random&) { c.print_noise_m = 1.5e-4; }});
  kinds.push_back({"corners printed with errors of 0.02 mm", Expected::kEither,
                   "print|uneven|match|views|corners",
                   [](Conditions& c, Random&) { c.print_noise_m = 2e-5; }});
  for (const double scale : {0.97, 1.5}) {
    kinds.push_back(Deformed(scale < 1 ? "printed at 97 %" : "wrong size of squares",
                             Expected::kGood, "",
                             [scale](const Vector3d& p, double, double) { return scale * p; }));
  }
}

/// Height over the plane, of an amplitude of 1 to 2.5 % of half the board's width.
Kind Curved(const char* name, const std::function<double(double x, double y)>& height) {
  return Deformed(
      name, Expected::kBad, "not flat|flat", [height](const Vector3d& p, double half, double size) {
        return Vector3d(p.x(), p.y(), 0.02 * half * size * height(p.x() / half, p.y() / half));
      });
}

void AddShapes(std::vector<Kind>& kinds) {
  kinds.push_back(Curved("board S-shaped", [](double x, double) { return x * x * x - x; }));
  kinds.push_back(Curved("board wavy", [](double x, double) { return std::sin(5 * x + 0.5); }));
  kinds.push_back(Curved("board wavy both ways",
                         [](double x, double y) { return std::sin(4 * x) * std::cos(5 * y); }));
  kinds.push_back(Curved("board folded", [](double x, double) { return std::abs(x - 0.2); }));
  kinds.push_back(Curved("board's corner curled", [](double x, double y) {
    const double s = std::max(0.0, x + y - 0.6);
    return 3 * s * s;
  }));
  kinds.push_back(Curved("board with a dent", [](double x, double y) {
    return std::exp(-8 * ((x - 0.3) * (x - 0.3) + y * y));
  }));
  kinds.push_back({"board bends halfway", Expected::kBad, "board bent|flexes|bends",
                   [](Conditions& c, Random& random) {
                     const int at = static_cast<int>(c.views * Uniform(random, 0.3, 0.7));
                     const double bend = EitherSign(random, 0.15, 0.4);
                     c.deform = [=](int j, const Vector3d& p) {
                       return j < at ? p : Vector3d(p.x(), p.y(), p.z() + bend * p.x() * p.x());
                     };
                   }});
  kinds.push_back({"paper held in the hand", Expected::kBad, "board bent|flexes|bends",
                   [](Conditions& c, Random& random) {
                     const auto seed = random();
                     c.deform = [=](int j, const Vector3d& p) {
                       Random own(seed + static_cast<std::uint64_t>(j));
                       const double a = Uniform(own, -0.6, 0.6), b = Uniform(own, -0.6, 0.6);
                       return Vector3d(p.x(), p.y(), p.z() + a * p.x() * p.x() + b * p.x() * p.y());
                     };
                   }});
  kinds.push_back(
      {"glass on the board", Expected::kEither, "glass", [](Conditions& c, Random& random) {
         c.board_glass.thickness_m = Uniform(random, 0.003, 0.006);
       }});
}

/// Reverses the order of the points in some views: the board was held the other way round.
void TurnSome(Conditions& c, Random& random) {
  const auto seed = random();
  c.change_views = [seed](Views& views) {
    Random own(seed);
    const double share = Uniform(own, 0, 0.5);
    for (std::size_t j = 0; j < views.size(); ++j) {
      if (j == 1 || Uniform(own, 0, 1) < share)
        std::reverse(views[j].corners_px.begin(), views[j].corners_px.end());
    }
  };
}

/// Boards of which the two halves differ, but which look the same after half a turn, held the other
/// way round in some views.
void AddTurned(std::vector<Kind>& kinds) {
  constexpr const char* kNames[] = {"printer's paper feed slips",
                                    "two sheets joined with a gap",
                                    "corners printed with errors of 0.15 mm",
                                    "corners printed with errors of 0.02 mm",
                                    "board S-shaped",
                                    "board wavy",
                                    "board folded",
                                    "board's corner curled",
                                    "board with a dent"};
  std::vector<Kind> whole;
  AddPrints(whole);
  AddShapes(whole);
  for (const Kind& kind : whole) {
    if (std::ranges::find(kNames, kind.name) == std::end(kNames)) continue;
    kinds.push_back({kind.name + ", turned in places", kind.expected, kind.words,
                     [prepare = kind.prepare](Conditions& c, Random& random) {
                       c.board = {17, 11, 0.2 / 17};
                       prepare(c, random);
                       TurnSome(c, random);
                     }});
  }
}

void AddPoorViews(std::vector<Kind>& kinds) {
  kinds.push_back({"board never tilted", Expected::kBad, "similar|tilt",
                   [](Conditions& c, Random&) { c.max_tilt_rad = 0.02; }});
  kinds.push_back({"board never off the centre", Expected::kEither, "corners|closer",
                   [](Conditions& c, Random&) {
                     c.spread = 0.02;
                     c.nearest = 1.6;
                   }});
  kinds.push_back(
      {"board far away", Expected::kEither, "closer|corners|views", [](Conditions& c, Random&) {
         c.nearest = 3;
         c.views = 12;
       }});
  kinds.push_back({"five views", Expected::kBad, "in 5 usable frames",
                   [](Conditions& c, Random&) { c.views = 5; }});
  kinds.push_back({"the same frame repeated", Expected::kBad, "repeat|similar|same|tilt|at least 6",
                   [](Conditions& c, Random&) {
                     c.change_views = [](Views& views) {
                       for (auto& view : views) view.corners_px = views[0].corners_px;
                     };
                   }});
  kinds.push_back({"every frame delivered three times", Expected::kEither, "repeat|views",
                   [](Conditions& c, Random&) {
                     c.change_views = [](Views& views) {
                       for (std::size_t j = 0; j < views.size(); ++j)
                         views[j].corners_px = views[j - j % 3].corners_px;
                     };
                   }});
  kinds.push_back({"a third of the frames detected wrongly", Expected::kEither,
                   "do not fit|detected|cannot be used", [](Conditions& c, Random& random) {
                     const auto seed = random();
                     c.change_views = [seed](Views& views) {
                       Random own(seed);
                       std::normal_distribution<double> N(0, 2.5);
                       for (std::size_t j = 0; j < views.size(); j += 3) {
                         for (auto& p : views[j].corners_px) p += lens::Vec2(N(own), N(own));
                       }
                     };
                   }});
  kinds.push_back({"heat haze", Expected::kEither, "hot air", [](Conditions& c, Random& random) {
                     const auto seed = random();
                     c.change_views = [seed](Views& views) {
                       Random own(seed);
                       for (auto& view : views) {
                         const double a = Uniform(own, 0, 6), b = Uniform(own, 0, 6);
                         for (auto& p : view.corners_px)
                           p += 0.15 *
                                lens::Vec2(std::sin(a + p.y() / 60), std::sin(b + p.x() / 70));
                       }
                     };
                   }});
}

}  // namespace

void AddKindsOfBoard(std::vector<Kind>& kinds) {
  AddPrints(kinds);
  AddShapes(kinds);
  AddTurned(kinds);
  AddPoorViews(kinds);
}

void AddGoodKinds(std::vector<Kind>& kinds) {
  const auto good = [&](const char* name, std::function<void(Conditions&, Random&)> prepare) {
    kinds.push_back({name, Expected::kGood, "", std::move(prepare)});
  };
  for (const char* name : {"good", "good again", "good once more"}) {
    good(name, [](Conditions&, Random&) {});
  }
  good("good, board bowed", [](Conditions& c, Random&) { c.bow_per_m = 0.3; });
  good("good, board always upright", [](Conditions& c, Random&) { c.max_roll_rad = 0.05; });
  good("good, mirrored image", [](Conditions& c, Random&) {
    c.camera.cx = c.width - 1 - c.camera.cx;
    c.camera.p[1] = -c.camera.p[1];
  });
  good("good, two frames detected wrongly", [](Conditions& c, Random& random) {
    const auto seed = random();
    c.change_views = [seed](Views& views) {
      Random own(seed);
      std::normal_distribution<double> N(0, 2.5);
      for (const std::size_t j : {std::size_t{3}, views.size() / 2})
        for (auto& p : views[j].corners_px) p += lens::Vec2(N(own), N(own));
    };
  });
  good("good, glare on some corners", [](Conditions& c, Random& random) {
    const auto seed = random();
    c.change_views = [seed](Views& views) {
      Random own(seed);
      for (auto& view : views) {
        const std::size_t n = view.corners_px.size(), first = own() % n;
        for (std::size_t k = first; k < std::min(first + 3, n); ++k)
          view.corners_px[k] += lens::Vec2(Uniform(own, -4, 4), Uniform(own, -4, 4));
      }
    };
  });
  good("good, turned by 180 degrees in places", [](Conditions& c, Random&) {
    c.change_views = [](Views& views) {
      for (std::size_t j = 0; j < views.size(); j += 4)
        std::reverse(views[j].corners_px.begin(), views[j].corners_px.end());
    };
  });
  good("good, 17 x 11 turned by 180 degrees in places", [](Conditions& c, Random& random) {
    c.board = {17, 11, 0.2 / 17};
    c.bow_per_m = 0.3;
    TurnSome(c, random);
  });
  good("good, frames out of order", [](Conditions& c, Random& random) {
    const auto seed = random();
    c.change_views = [seed](Views& views) {
      Random own(seed);
      std::shuffle(views.begin(), views.end(), own);
    };
  });
  good("good, no clock", [](Conditions& c, Random&) {
    c.change_views = [](Views& views) {
      for (auto& view : views) view.time_s = 0;
    };
  });
  good("good, noise of 0.1 px", [](Conditions& c, Random&) {
    c.noise_px = 0.1;
    c.views = 40;
  });
}

std::vector<Kind> AllKinds() {
  std::vector<Kind> kinds;
  AddGoodKinds(kinds);
  AddKindsOfLens(kinds);
  AddKindsOfBoard(kinds);
  AddKindsOfImage(kinds);
  AddKindsByPart(kinds);
  return kinds;
}

}  // namespace plumbline::lens_captures
