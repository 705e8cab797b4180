#include <algorithm>
#include <cmath>

#include "drivers/robot/decoding_parts.h"

namespace plumbline::robot {
namespace {

constexpr double kLimitMargin = 0.02;          // that of the plausibility filter
constexpr double kOpenLimit = 2 * kWholeTurn;  // of a joint whose limits the cell does not declare

}  // namespace

std::vector<Encoding> Encodings() {
  std::vector<Encoding> all = {{RegisterType::kInt16, modbus::WordOrder::kAbcd},
                               {RegisterType::kUint16, modbus::WordOrder::kAbcd}};
  for (const RegisterType type : {RegisterType::kInt32, RegisterType::kFloat32}) {
    for (const modbus::WordOrder order : {modbus::WordOrder::kAbcd, modbus::WordOrder::kCdab,
                                          modbus::WordOrder::kBadc, modbus::WordOrder::kDcba}) {
      all.push_back({type, order});
    }
  }
  return all;
}

bool Uses(const Encoding& encoding, const JointUnit& unit) {
  if (encoding.type == RegisterType::kFloat32) return unit.real;
  if (unit.real) return false;
  if (WordsOf(encoding.type) == 2) return true;
  // Unsigned words are needed only where a turn has more counts than an int16.
  return unit.in16bits && (encoding.type == RegisterType::kInt16 || kWholeTurn / unit.rad > 32767);
}

double Lower(const kinematics::Chain& chain, int joint) {
  return std::max(chain.lower()[joint], -kOpenLimit) - kLimitMargin;
}
double Upper(const kinematics::Chain& chain, int joint) {
  return std::min(chain.upper()[joint], kOpenLimit) + kLimitMargin;
}

bool CanBe(const kinematics::Chain& chain, int joint, double q, bool unsigned_words) {
  if (!std::isfinite(q)) return false;
  const double size = std::abs(q);
  if (size > kZeroJoint && size < kTinyJoint) return false;
  const bool within = q >= Lower(chain, joint) && q <= Upper(chain, joint);
  const bool revolute = chain.type(joint) == model::JointType::kRevolute;
  if (unsigned_words && (!revolute || q > kWholeTurn + 1e-3)) return false;
  return within || (revolute && q > std::numbers::pi && q <= kWholeTurn + 1e-3 &&
                    q - kWholeTurn >= Lower(chain, joint));
}

bool IsPlausible(const kinematics::Chain& chain, const model::JointVector& q, bool unsigned_words) {
  int off_zero = 0;
  for (int j = 0; j < q.size(); ++j) {
    if (!CanBe(chain, j, q[j], unsigned_words)) return false;
    if (std::abs(q[j]) > kOffZero) ++off_zero;
  }
  return off_zero >= (q.size() >= 4 ? 2 : 1);
}

namespace {

bool FitsIn(const JointDecoding& decoding, const kinematics::Chain& chain,
            const std::vector<RegisterImage>& images) {
  return std::all_of(images.begin(), images.end(), [&](const RegisterImage& image) {
    const auto q = Decoded(decoding, chain, image);
    return q && IsPlausible(chain, *q, decoding.type == RegisterType::kUint16);
  });
}

}  // namespace

std::vector<JointDecoding> PlausibleDecodings(const kinematics::Chain& chain,
                                              const std::vector<RegisterImage>& images) {
  std::vector<JointDecoding> found;
  const RegisterImage& image = images.front();
  const int n = chain.size();
  for (const Encoding& encoding : Encodings()) {
    const RawValues raw(image, encoding);
    for (const JointUnit& unit : JointUnits()) {
      if (!Uses(encoding, unit)) continue;
      for (const auto& [first, word] : image.words) {
        for (const int stride : kStrides) {
          if (stride < WordsOf(encoding.type)) continue;
          if (n == 1 && stride != WordsOf(encoding.type)) continue;
          model::JointVector q(n);
          bool possible = true;
          for (int j = 0; j < n && possible; ++j) {
            const bool turns = chain.type(j) == model::JointType::kRevolute;
            q[j] = raw[first + j * stride] * (turns ? unit.rad : unit.m);
            possible = CanBe(chain, j, q[j], encoding.type == RegisterType::kUint16);
          }
          if (!possible || !IsPlausible(chain, q, encoding.type == RegisterType::kUint16)) continue;
          JointDecoding decoding{image.table, {}, encoding.type, encoding.order, &unit};
          for (int j = 0; j < n; ++j) decoding.addresses.push_back(first + j * stride);
          if (FitsIn(decoding, chain, images)) found.push_back(decoding);
        }
      }
    }
  }
  return found;
}

double StepOf(const JointDecoding& decoding, const kinematics::Chain& chain, int joint) {
  if (decoding.type == RegisterType::kFloat32) return 0;
  return chain.type(joint) == model::JointType::kRevolute ? decoding.unit->rad : decoding.unit->m;
}

double Difference(const kinematics::Chain& chain, int joint, double a, double b) {
  return chain.type(joint) == model::JointType::kRevolute ? std::remainder(a - b, kWholeTurn)
                                                          : a - b;
}

}  // namespace plumbline::robot
