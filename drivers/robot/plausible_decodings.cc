#include <algorithm>
#include <cmath>

#include "drivers/robot/decoding_parts.h"

namespace plumbline::robot {
namespace {

constexpr double kOpenLimit = 2 * kWholeTurn;  // of a joint whose limits the cell does not declare

}  // namespace

std::vector<Encoding> Encodings() {
  std::vector<Encoding> all;
  for (const RegisterType type : {RegisterType::kFloat32, RegisterType::kInt32}) {
    for (const modbus::WordOrder order : {modbus::WordOrder::kAbcd, modbus::WordOrder::kCdab,
                                          modbus::WordOrder::kBadc, modbus::WordOrder::kDcba}) {
      all.push_back({type, order});
    }
  }
  all.push_back({RegisterType::kInt16, modbus::WordOrder::kAbcd});
  all.push_back({RegisterType::kUint16, modbus::WordOrder::kAbcd});
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
  return std::max(chain.lower()[joint], -kOpenLimit) - kLimits.limit_margin_rad;
}
double Upper(const kinematics::Chain& chain, int joint) {
  return std::min(chain.upper()[joint], kOpenLimit) + kLimits.limit_margin_rad;
}

bool CanBe(const kinematics::Chain& chain, int joint, double q, bool unsigned_words) {
  if (!std::isfinite(q)) return false;
  const double size = std::abs(q);
  if (size > 0 && size < kLimits.least_magnitude) return false;
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
    if (std::abs(q[j]) > kOffZero * PendantUnit(chain, j)) ++off_zero;
  }
  return off_zero >= (q.size() >= 4 ? 2 : 1);
}

double PendantUnit(const kinematics::Chain& chain, int joint) {
  return chain.type(joint) == model::JointType::kRevolute ? kRadPerDeg : kMetrePerMm;
}

PlausibleDecodings FindPlausible(const kinematics::Chain& chain, const DecodingEvidence& evidence,
                                 const SearchBounds& bounds) {
  PlausibleDecodings found;
  const RegisterImage& image = evidence.images.front();
  const int n = chain.size();
  const bool must_change = evidence.moving || !evidence.moves.empty();
  for (const Encoding& encoding : Encodings()) {
    const bool no_sign = encoding.type == RegisterType::kUint16;
    std::vector<RawValues> raw;
    for (const RegisterImage& one : evidence.images) raw.emplace_back(one, encoding);
    for (const JointUnit& unit : JointUnits()) {
      if (!Uses(encoding, unit)) continue;
      model::JointVector si(n);
      for (int j = 0; j < n; ++j)
        si[j] = chain.type(j) == model::JointType::kRevolute ? unit.rad : unit.m;
      const auto possible = [&](std::size_t k, int first, int stride, model::JointVector& q) {
        for (int j = 0; j < n; ++j) {
          q[j] = raw[k][first + j * stride] * si[j];
          if (!CanBe(chain, j, q[j], no_sign)) return false;
        }
        return IsPlausible(chain, q, no_sign);
      };
      int tried = 0;
      for (const auto& [first, word] : image.words) {
        if (++tried % 256 == 0 && bounds.stop && bounds.stop()) {
          found.complete = false;
          return found;
        }
        for (const int stride : kStrides) {
          if (stride < WordsOf(encoding.type)) continue;
          if (n == 1 && stride != WordsOf(encoding.type)) continue;
          model::JointVector q(n), q_first(n);
          if (!possible(0, first, stride, q_first)) continue;
          bool in_all = true, changes = false;
          for (std::size_t k = 1; k < raw.size() && in_all; ++k) {
            in_all = possible(k, first, stride, q);
            for (int j = 0; j < n; ++j) {
              changes = changes || std::abs(q[j] - q_first[j]) > kOffZero * PendantUnit(chain, j);
            }
          }
          if (!in_all) continue;
          ++found.plausible;
          if (must_change && !changes) continue;
          JointDecoding decoding{image.table, {}, encoding.type, encoding.order, &unit};
          for (int j = 0; j < n; ++j) decoding.addresses.push_back(first + j * stride);
          if (PendantMisfit(decoding, chain, evidence, false) > 1) continue;
          if (found.agreeing.size() >= bounds.max_decodings) {
            found.complete = false;
            continue;
          }
          found.agreeing.push_back(decoding);
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
