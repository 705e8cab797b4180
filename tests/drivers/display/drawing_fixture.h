// Shared by the rendering tests: a renderer if EGL is available, and access to pixels.
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <vector>

#include "drivers/display/gl_context.h"
#include "drivers/display/renderer.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::test {

/// Context and renderer; `renderer` is nullptr if this computer has no EGL.
struct Drawing {
  std::unique_ptr<display::GlContext> context;
  std::unique_ptr<display::Renderer> renderer;

  explicit Drawing(const display::RendererOptions& options = {}) {
    auto made = display::GlContext::Create();
    if (!made) {
      std::printf("SKIPPED: %s\n", made.error().c_str());
      return;
    }
    context = std::move(made).value();
    auto with = display::Renderer::Create(*context, options);
    if (!with) {
      std::printf("the renderer cannot be made: %s\n", with.error().c_str());
      std::abort();
    }
    renderer = std::move(with).value();
  }
};

inline lens::Lens Pinhole(double f, image::ImageSize size) {
  lens::Lens lens;
  lens.fx = lens.fy = f;
  lens.cx = (size.width - 1) / 2.0;
  lens.cy = (size.height - 1) / 2.0;
  return lens;
}

inline scene::DisplayList EmptyList(image::ImageSize size, double f = 500) {
  scene::DisplayList list;
  list.size = size;
  list.pinhole = Pinhole(f, size);
  return list;
}

struct Pixel {
  int r = 0, g = 0, b = 0;
  bool operator==(const Pixel&) const = default;
};

inline Pixel At(const display::RgbImage& image, int u, int v) {
  const std::size_t i =
      3 * (static_cast<std::size_t>(v) * static_cast<std::size_t>(image.size.width) +
           static_cast<std::size_t>(u));
  return {image.rgb.at(i), image.rgb.at(i + 1), image.rgb.at(i + 2)};
}

/// A square in the plane z = 0 of its own frame, centred at the origin.
inline scene::TriangleMesh Square(float side_m) {
  const float h = side_m / 2;
  return {.vertices_O = {{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}},
          .triangles = {{0, 1, 2}, {0, 2, 3}}};
}

/// A round bar along z from 0 to `length_m`, with rings of `around` vertices.
inline scene::TriangleMesh Bar(double radius_m, double length_m, int rings, int around) {
  scene::TriangleMesh mesh;
  for (int i = 0; i <= rings; ++i) {
    for (int k = 0; k < around; ++k) {
      const double angle = 2 * 3.14159265358979 * k / around;
      mesh.vertices_O.push_back(
          Vec3(radius_m * std::cos(angle), radius_m * std::sin(angle), length_m * i / rings)
              .cast<float>());
    }
  }
  const auto index = [&](int i, int k) {
    return static_cast<std::uint32_t>(i * around + k % around);
  };
  for (int i = 0; i < rings; ++i) {
    for (int k = 0; k < around; ++k) {
      mesh.triangles.push_back({index(i, k), index(i, k + 1), index(i + 1, k + 1)});
      mesh.triangles.push_back({index(i, k), index(i + 1, k + 1), index(i + 1, k)});
    }
  }
  return mesh;
}

inline scene::DrawnMesh Placed(int mesh, const Vec3& p_C, const scene::Colour& colour) {
  scene::DrawnMesh drawn;
  drawn.mesh = mesh;
  drawn.X_CF.p = p_C;
  drawn.colour = colour;
  return drawn;
}

}  // namespace plumbline::test
