#include "drivers/display/background_pass.h"

#include <algorithm>
#include <cmath>

namespace plumbline::display {
namespace {

constexpr float kEmpty = 0.13F;  ///< grey level without an image

constexpr const char* kBackgroundFragment = R"(
uniform vec4 u_pinhole;    // 1/fx, 1/fy, -(cx + 1/2)/fx, -(cy + 1/2)/fy
uniform vec4 u_image;      // fx/width, fy/height, (cx + 1/2)/width, (cy + 1/2)/height
uniform vec3 u_radial;     // k1, k2, k3
uniform vec3 u_below;      // k4, k5, k6
uniform vec2 u_tangential; // p1, p2
uniform vec4 u_prism;      // s1, s2, s3, s4
uniform bool u_fisheye;    // k1..k4 are those of a fisheye
uniform float u_r2_max;
uniform float u_empty;
uniform sampler2D u_pixels;
out vec4 colour;
void main() {
  vec2 n = gl_FragCoord.xy * u_pinhole.xy + u_pinhole.zw;
  float r2 = dot(n, n);
  float radial = 1.0 + r2 * (u_radial.x + r2 * (u_radial.y + r2 * u_radial.z));
  radial /= 1.0 + r2 * (u_below.x + r2 * (u_below.y + r2 * u_below.z));
  if (u_fisheye && r2 > 1e-8) {
    float r = sqrt(r2), theta = atan(r), t2 = theta * theta;
    float bent = u_radial.y + t2 * (u_radial.z + t2 * u_below.x);
    radial = theta / r * (1.0 + t2 * (u_radial.x + t2 * bent));
  }
  vec2 d = n * (radial + 2.0 * dot(u_tangential.yx, n)) + u_tangential.yx * r2 +
           r2 * (u_prism.xz + r2 * u_prism.yw);
  vec2 at = d * u_image.xy + u_image.zw;
  vec2 inside = step(abs(at - 0.5), vec2(0.5)) * step(r2, u_r2_max);
  colour = vec4(mix(vec3(u_empty), texture(u_pixels, at).rgb, inside.x * inside.y), 1.0);
}
)";

/// Lens that scales an image without a lens to fit into the picture.
lens::Lens FittingLens(image::ImageSize image, const lens::Lens& pinhole,
                       image::ImageSize picture) {
  const double scale = std::min(static_cast<double>(picture.width) / image.width,
                                static_cast<double>(picture.height) / image.height);
  // Picture pixel u sees image pixel (u - (W - 1)/2) / scale + (w - 1)/2.
  lens::Lens lens;
  lens.fx = pinhole.fx / scale;
  lens.fy = pinhole.fy / scale;
  lens.cx = (pinhole.cx - (picture.width - 1) / 2.0) / scale + (image.width - 1) / 2.0;
  lens.cy = (pinhole.cy - (picture.height - 1) / 2.0) / scale + (image.height - 1) / 2.0;
  return lens;
}

}  // namespace

double LargestRadiusSquared(const lens::Lens& lens) {
  constexpr double kMost = 100, kStep = 1.002;
  lens::Lens radial = lens;  // without the terms that depend on the direction
  radial.fx = radial.fy = 1;
  radial.cx = radial.cy = radial.p1 = radial.p2 = 0;
  radial.s1 = radial.s2 = radial.s3 = radial.s4 = 0;
  double r2 = 1e-3;
  while (r2 < kMost) {
    // d (r c(r)) / dr; along x the Jacobian is diagonal.
    if (lens::PixelJacobian(radial, {std::sqrt(r2), 0})(0, 0) <= 0) return r2 / kStep;
    r2 *= kStep;
  }
  return kMost;
}

Result<BackgroundPass> BackgroundPass::Create() {
  auto program = GlProgram::Build(kWholePictureVertex, kBackgroundFragment);
  if (!program) return program.failure();
  BackgroundPass pass;
  pass.program_ = std::move(program).value();
  return pass;
}

void BackgroundPass::Load(const scene::Background& background, Image& image) {
  const image::LumaView& luma = background.luma;
  const bool colour = background.bgr != nullptr;
  const bool fits = luma.size() == image.size && colour == image.colour;
  if (fits && image.sequence == background.sequence) return;
  glBindTexture(GL_TEXTURE_2D, *image.texture);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, colour ? 0 : static_cast<GLint>(luma.stride));
  const GLenum format = colour ? GL_RGB : GL_RED;
  const void* pixels = colour ? background.bgr : luma.data;
  if (fits) {
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, luma.width, luma.height, format, GL_UNSIGNED_BYTE,
                    pixels);
  } else {
    glTexImage2D(GL_TEXTURE_2D, 0, colour ? GL_RGB8 : GL_R8, luma.width, luma.height, 0, format,
                 GL_UNSIGNED_BYTE, pixels);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_SWIZZLE_R, colour ? GL_BLUE : GL_RED);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_SWIZZLE_G, colour ? GL_GREEN : GL_RED);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_SWIZZLE_B, GL_RED);
  }
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  image.size = luma.size();
  image.colour = colour;
  image.sequence = background.sequence;
}

Result<void> BackgroundPass::Draw(const scene::Background& background, const lens::Lens& pinhole,
                                  image::ImageSize size, std::size_t view) {
  glClearColor(kEmpty, kEmpty, kEmpty, 1);
  glClear(GL_COLOR_BUFFER_BIT);
  const image::LumaView& luma = background.luma;
  if (luma.data == nullptr) return {};
  GLint most = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
  if (luma.width < 1 || luma.height < 1 || luma.width > most || luma.height > most ||
      luma.stride < luma.width) {
    return Error{"the camera image has a size that cannot be drawn"};
  }
  const lens::Lens lens = background.lens.value_or(FittingLens(luma.size(), pinhole, size));
  if (images_.size() <= view) images_.resize(view + 1);
  Load(background, images_[view]);
  const auto f = [](double value) { return static_cast<GLfloat>(value); };
  program_.Use();
  glUniform4f(program_.UniformLocation("u_pinhole"), f(1 / pinhole.fx), f(1 / pinhole.fy),
              f(-(pinhole.cx + 0.5) / pinhole.fx), f(-(pinhole.cy + 0.5) / pinhole.fy));
  glUniform4f(program_.UniformLocation("u_image"), f(lens.fx / luma.width),
              f(lens.fy / luma.height), f((lens.cx + 0.5) / luma.width),
              f((lens.cy + 0.5) / luma.height));
  glUniform3f(program_.UniformLocation("u_radial"), f(lens.k1), f(lens.k2), f(lens.k3));
  glUniform3f(program_.UniformLocation("u_below"), f(lens.k4), f(lens.k5), f(lens.k6));
  glUniform2f(program_.UniformLocation("u_tangential"), f(lens.p1), f(lens.p2));
  glUniform4f(program_.UniformLocation("u_prism"), f(lens.s1), f(lens.s2), f(lens.s3), f(lens.s4));
  glUniform1i(program_.UniformLocation("u_fisheye"), lens.fisheye ? 1 : 0);
  glUniform1f(program_.UniformLocation("u_r2_max"), f(LargestRadiusSquared(lens)));
  glUniform1f(program_.UniformLocation("u_empty"), kEmpty);
  glUniform1i(program_.UniformLocation("u_pixels"), 0);
  glBindTexture(GL_TEXTURE_2D, *images_[view].texture);
  glBindVertexArray(*empty_array_);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  return {};
}

}  // namespace plumbline::display
