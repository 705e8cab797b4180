#include "tests/renderer/scene.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

namespace plumbline::renderer {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kSamples = 8;        // per side, in a pixel that an edge may cross
constexpr int kMotionSteps = 8;    // exposures to average
constexpr double kUndefined = -1;  // outside all sheets

/// Direction (x, y, 1) in the camera frame.
struct Ray {
  double x, y;
};

/// The camera's ray through a pixel; the distortion is inverted by fixed-point iteration.
Ray RayOf(const Camera& c, double u, double v) {
  const double* k = c.distortion;
  const double xd = (u - c.cx) / c.fx, yd = (v - c.cy) / c.fy;
  double x = xd, y = yd;
  for (int i = 0; i < 60; ++i) {
    const double r2 = x * x + y * y;
    const double radial = 1 + ((k[4] * r2 + k[1]) * r2 + k[0]) * r2;
    const double dx = 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x);
    const double dy = k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y;
    const double nx = (xd - dx) / radial, ny = (yd - dy) / radial;
    const double change = std::abs(nx - x) + std::abs(ny - y);
    x = nx;
    y = ny;
    if (change < 1e-14) break;
  }
  return {x, y};
}

/// Rays through the corners of all pixels, interpolated bilinearly in between with an error below
/// 1e-6 px for the lenses used here.
class Rays {
 public:
  explicit Rays(const Camera& c) : camera_(c), width_(c.width + 1) {
    rays_.reserve(static_cast<std::size_t>(width_) * (c.height + 1));
    for (int v = 0; v <= c.height; ++v) {
      for (int u = 0; u <= c.width; ++u) rays_.push_back(RayOf(c, u - 0.5, v - 0.5));
    }
  }
  const Camera& camera() const { return camera_; }
  Ray At(int u, int v, double a, double b) const {
    const Ray* top = &rays_[static_cast<std::size_t>(v) * width_ + u];
    const Ray* low = top + width_;
    const double c = (1 - b) * (1 - a), d = (1 - b) * a, e = b * (1 - a), f = b * a;
    return {c * top[0].x + d * top[1].x + e * low[0].x + f * low[1].x,
            c * top[0].y + d * top[1].y + e * low[0].y + f * low[1].y};
  }

 private:
  Camera camera_;
  int width_;
  std::vector<Ray> rays_;
};

/// The rays of the camera that this thread used last are kept: they take as long as a whole image
/// with a few tags.
const Rays& RaysOf(const Camera& camera) {
  thread_local std::optional<Rays> last;
  if (!last || last->camera() != camera) last.emplace(camera);
  return *last;
}

/// The print where a ray meets the bent sheet. Scalars, since it is called up to 70 times a pixel.
class Meeting {
 public:
  Meeting(const Sheet& sheet, const Eigen::Isometry3d& X_CK)
      : sheet_(sheet),
        o_(X_CK.inverse().translation()),
        R_(X_CK.linear().transpose()),
        flat_(sheet.bow_x == 0 && sheet.bow_y == 0 && sheet.bow_xy == 0) {}

  double PrintAt(const Ray& ray) const {
    const double dx = R_(0, 0) * ray.x + R_(0, 1) * ray.y + R_(0, 2);
    const double dy = R_(1, 0) * ray.x + R_(1, 1) * ray.y + R_(1, 2);
    const double dz = R_(2, 0) * ray.x + R_(2, 1) * ray.y + R_(2, 2);
    const auto at = [&](double z) {
      const double t = (z - o_.z()) / dz;
      return Ray{o_.x() + t * dx, o_.y() + t * dy};
    };
    Ray p = at(0);
    double z = 0;
    for (int i = 1; i < 6 && !flat_; ++i) {
      const double next = SheetPoint(sheet_, p.x, p.y).z();
      if (std::abs(next - z) < 1e-12) break;
      z = next;
      p = at(z);
    }
    if (std::abs(p.x - sheet_.centre_x_m) > sheet_.half_width_m ||
        std::abs(p.y - sheet_.centre_y_m) > sheet_.half_height_m)
      return kUndefined;
    return sheet_.print(p.x, p.y);
  }

 private:
  const Sheet& sheet_;
  Eigen::Vector3d o_;  // the camera in frame K
  Eigen::Matrix3d R_;  // from C to K
  bool flat_;
};

struct Box {
  int u0, v0, u1, v1;
};

Box BoxOf(const Camera& camera, const Sheet& sheet, const Eigen::Isometry3d& X_CK) {
  Box box{camera.width, camera.height, 0, 0};
  constexpr int kEdge = 16;
  for (int i = 0; i <= kEdge; ++i) {
    for (int j = 0; j <= kEdge; ++j) {
      const double x = sheet.centre_x_m + sheet.half_width_m * (2.0 * i / kEdge - 1);
      const double y = sheet.centre_y_m + sheet.half_height_m * (2.0 * j / kEdge - 1);
      const Eigen::Vector2d p = PixelOf(camera, X_CK * SheetPoint(sheet, x, y));
      if (!p.allFinite()) continue;
      const auto clamp = [](double value, int most) {
        return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(most)));
      };
      box.u0 = std::min(box.u0, clamp(std::floor(p.x()) - 2, camera.width));
      box.v0 = std::min(box.v0, clamp(std::floor(p.y()) - 2, camera.height));
      box.u1 = std::max(box.u1, clamp(std::ceil(p.x()) + 3, camera.width));
      box.v1 = std::max(box.v1, clamp(std::ceil(p.y()) + 3, camera.height));
    }
  }
  return box;
}

using Plane = std::vector<float>;

void Blur(Plane& plane, int width, int height, double sigma) {
  if (sigma <= 0) return;
  const int reach = static_cast<int>(std::ceil(4 * sigma));
  std::vector<float> kernel(2 * reach + 1);
  float sum = 0;
  for (int i = -reach; i <= reach; ++i) {
    kernel[i + reach] = static_cast<float>(std::exp(-0.5 * i * i / (sigma * sigma)));
    sum += kernel[i + reach];
  }
  for (float& k : kernel) k /= sum;
  Plane half(plane.size());
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      float value = 0;
      for (int i = -reach; i <= reach; ++i) {
        value += kernel[i + reach] * plane[v * width + std::clamp(u + i, 0, width - 1)];
      }
      half[v * width + u] = value;
    }
  }
  std::fill(plane.begin(), plane.end(), 0.0F);
  for (int v = 0; v < height; ++v) {
    for (int i = -reach; i <= reach; ++i) {
      const float* row = &half[static_cast<std::size_t>(std::clamp(v + i, 0, height - 1)) * width];
      float* out = &plane[static_cast<std::size_t>(v) * width];
      for (int u = 0; u < width; ++u) out[u] += kernel[i + reach] * row[u];
    }
  }
}

/// A smooth random background.
void AddClutter(Plane& plane, const Camera& camera, double amplitude, std::mt19937_64& random) {
  if (amplitude <= 0) return;
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int wave = 0; wave < 12; ++wave) {
    const double a = 0.2 * uniform(random), b = 0.2 * uniform(random),
                 c = 2 * kPi * uniform(random);
    for (int v = 0; v < camera.height; ++v) {
      for (int u = 0; u < camera.width; ++u) {
        plane[v * camera.width + u] +=
            static_cast<float>(amplitude / 4 * std::sin(a * u + b * v + c));
      }
    }
  }
}

void Draw(Plane& plane, const Camera& camera, const Rays& rays, const Sheet& sheet,
          const Eigen::Isometry3d& X_CK, const Conditions& conditions) {
  const Box box = BoxOf(camera, sheet, X_CK);
  const Meeting meeting(sheet, X_CK);
  std::minstd_rand jitter(1);
  std::uniform_real_distribution<double> share(0, 1);
  const auto grey = [&](double print, float under) {
    return print < 0 ? under
                     : static_cast<float>(conditions.black +
                                          print * (conditions.white - conditions.black));
  };
  for (int v = box.v0; v < box.v1; ++v) {
    for (int u = box.u0; u < box.u1; ++u) {
      float& pixel = plane[v * camera.width + u];
      const double first = meeting.PrintAt(rays.At(u, v, 0.5, 0.5));
      bool edge = false;
      for (const auto& [a, b] : {std::pair{-0.1, -0.1},
                                 {0.5, -0.1},
                                 {1.1, -0.1},
                                 {-0.1, 0.5},
                                 {1.1, 0.5},
                                 {-0.1, 1.1},
                                 {0.5, 1.1},
                                 {1.1, 1.1}}) {
        edge = edge || meeting.PrintAt(rays.At(u, v, a, b)) != first;
      }
      if (!edge) {
        pixel = grey(first, pixel);
        continue;
      }
      double sum = 0;
      for (int i = 0; i < kSamples; ++i) {
        for (int j = 0; j < kSamples; ++j) {
          // Jittered within its part of the pixel: a fixed grid would shift edges parallel to it.
          const double a = (i + share(jitter)) / kSamples, b = (j + share(jitter)) / kSamples;
          sum += grey(meeting.PrintAt(rays.At(u, v, a, b)), pixel);
        }
      }
      pixel = static_cast<float>(sum / (kSamples * kSamples));
    }
  }
}

/// std::floor is a call into the C library.
int Floor(double x) {
  const int towards_zero = static_cast<int>(x);
  return towards_zero - (x < towards_zero ? 1 : 0);
}

/// A fraction `s` of a rigid motion.
Eigen::Isometry3d Part(const Eigen::Isometry3d& motion, double s) {
  const Eigen::AngleAxisd turn(motion.linear());
  Eigen::Isometry3d part = Eigen::Isometry3d::Identity();
  part.linear() = Eigen::AngleAxisd(s * turn.angle(), turn.axis()).toRotationMatrix();
  part.translation() = s * motion.translation();
  return part;
}

}  // namespace

Eigen::Vector2d PixelOf(const Camera& c, const Eigen::Vector3d& p) {
  const double* k = c.distortion;
  const double x = p.x() / p.z(), y = p.y() / p.z();
  const double r2 = x * x + y * y;
  const double radial = 1 + k[0] * r2 + k[1] * r2 * r2 + k[4] * r2 * r2 * r2;
  return {c.fx * (radial * x + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x)) + c.cx,
          c.fy * (radial * y + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y) + c.cy};
}

Camera Pinhole(int width, int height, double f) {
  return {width, height, f, f, (width - 1) / 2.0, (height - 1) / 2.0};
}

Camera ZoomLens(double f) {
  const double zoom = std::log(f / 1000) / std::log(12.0);  // 0 wide .. 1 long
  Camera camera;
  camera.fx = f;
  camera.fy = f * 1.0005;
  camera.cx += 14 * std::sin(3 * zoom) - 3;
  camera.cy += 9 * std::cos(2.5 * zoom) - 5;
  const double edge = 960 / f;  // normalised radius at the image's edge
  // About -1.5 % of barrel at the wide end to +0.6 % of pincushion at the long one.
  camera.distortion[0] = (-0.030 + 0.045 * zoom) / (2 * edge * edge);
  camera.distortion[1] = (0.010 - 0.012 * zoom) / (8 * edge * edge * edge * edge);
  camera.distortion[2] = 0.0004 * (zoom - 0.3);
  camera.distortion[3] = -0.0003 * (1 - zoom);
  return camera;
}

Print Chessboard(int columns, int rows, double square_m) {
  return [=](double x, double y) {
    const int i = Floor(x / square_m) + 1;  // square, from the first one
    const int j = Floor(y / square_m) + 1;
    const bool margin = i < 0 || j < 0 || i > columns || j > rows;
    return margin || (i + j) % 2 != 0 ? 1.0 : 0.0;
  };
}

Print SquareTag(int cells, const std::vector<bool>& white, double side_m) {
  return [=](double x, double y) {
    const double cell = side_m / cells;
    const int c = Floor(x / cell + 0.5 * cells);
    const int r = Floor(y / cell + 0.5 * cells);
    if (c < 0 || r < 0 || c >= cells || r >= cells) return 1.0;
    return white[static_cast<std::size_t>(r) * cells + c] ? 1.0 : 0.0;
  };
}

Print Circles(int columns, int rows, double spacing_m, double diameter_m) {
  return [=](double x, double y) {
    const double i = std::clamp(std::round(x / spacing_m), 0.0, columns - 1.0);
    const double j = std::clamp(std::round(y / spacing_m), 0.0, rows - 1.0);
    const double dx = x - i * spacing_m, dy = y - j * spacing_m;
    return dx * dx + dy * dy < 0.25 * diameter_m * diameter_m ? 0.0 : 1.0;
  };
}

Print Charuco(int columns, int rows, double square_m, double tag_m, int cells,
              const std::vector<std::vector<bool>>& tags, bool white_first) {
  const auto white = [=](int column, int row) {
    return (column + row) % 2 == (white_first ? 0 : 1);
  };
  std::vector<std::size_t> ids;  // of each square; of a black one, that of the next white one
  std::size_t next = 0;
  for (int j = 0; j <= rows; ++j) {
    for (int i = 0; i <= columns; ++i) {
      ids.push_back(next);
      next += white(i, j) ? 1 : 0;
    }
  }
  return [=](double x, double y) {
    const int i = Floor(x / square_m) + 1;  // square, from the first one
    const int j = Floor(y / square_m) + 1;
    if (i < 0 || j < 0 || i > columns || j > rows) return 1.0;
    if (!white(i, j)) return 0.0;
    const std::size_t id = ids[static_cast<std::size_t>(j) * (columns + 1) + i];
    const double cell = tag_m / cells;
    const int c = Floor((x - (i - 0.5) * square_m) / cell + 0.5 * cells);
    const int r = Floor((y - (j - 0.5) * square_m) / cell + 0.5 * cells);
    if (c < 0 || r < 0 || c >= cells || r >= cells) return 1.0;
    return tags.at(id)[static_cast<std::size_t>(r) * cells + c] ? 1.0 : 0.0;
  };
}

Print ShiftedCircles(int columns, int rows, double step_m, double diameter_m) {
  return [=](double x, double y) {
    // The nearest disc may be in the row above or below.
    const int nearest = static_cast<int>(std::round(y / step_m));
    for (int row = std::max(0, nearest - 1); row <= std::min(rows - 1, nearest + 1); ++row) {
      const double shift = row % 2;
      const double i = std::clamp(std::round((x / step_m - shift) / 2), 0.0, columns - 1.0);
      const double dx = x - (2 * i + shift) * step_m, dy = y - row * step_m;
      if (dx * dx + dy * dy < 0.25 * diameter_m * diameter_m) return 0.0;
    }
    return 1.0;
  };
}

Eigen::Vector3d SheetPoint(const Sheet& sheet, double x, double y) {
  const double u = x - sheet.centre_x_m, v = y - sheet.centre_y_m;
  return {x, y, sheet.bow_x * u * u + sheet.bow_y * v * v + sheet.bow_xy * u * v};
}

Image Render(const Camera& camera, const std::vector<Sheet>& sheets, const Conditions& conditions,
             std::uint64_t seed, const Eigen::Isometry3d& motion_C) {
  std::mt19937_64 random(seed);
  const Rays& rays = RaysOf(camera);
  const std::size_t size = static_cast<std::size_t>(camera.width) * camera.height;
  Plane plane(size, static_cast<float>(conditions.background));
  AddClutter(plane, camera, conditions.clutter, random);
  const bool still = motion_C.isApprox(Eigen::Isometry3d::Identity(), 1e-12);
  if (still) {
    for (const Sheet& sheet : sheets) Draw(plane, camera, rays, sheet, sheet.X_CK, conditions);
  } else {
    Plane sum(size, 0.0F);
    for (int step = 0; step < kMotionSteps; ++step) {
      Plane exposure = plane;
      const Eigen::Isometry3d moved = Part(motion_C, (step + 0.5) / kMotionSteps);
      for (const Sheet& sheet : sheets)
        Draw(exposure, camera, rays, sheet, moved * sheet.X_CK, conditions);
      for (std::size_t i = 0; i < size; ++i) sum[i] += exposure[i] / kMotionSteps;
    }
    plane = sum;
  }
  for (int v = 0; v < camera.height; ++v) {
    const double row = 1 + conditions.flicker * std::sin(2 * kPi * v / conditions.flicker_rows) +
                       conditions.shade_y * (static_cast<double>(v) / camera.height - 0.5);
    for (int u = 0; u < camera.width; ++u) {
      plane[v * camera.width + u] *= static_cast<float>(
          row + conditions.shade_x * (static_cast<double>(u) / camera.width - 0.5));
    }
  }
  Blur(plane, camera.width, camera.height, conditions.blur_px);
  Image image{camera.width, camera.height, std::vector<std::uint8_t>(size)};
  std::normal_distribution<float> noise(0, 1);
  for (std::size_t i = 0; i < size; ++i) {
    const double value = plane[i] + conditions.noise * noise(random);
    image.grey[i] = static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L));
  }
  return image;
}

}  // namespace plumbline::renderer
