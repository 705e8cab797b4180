// The kinds of misbehaviour, one entry each.
#include <algorithm>
#include <utility>

#include "tests/evaluation/hostile/hostile_robot.h"

namespace hostile {
namespace {

using Emissions = std::vector<Emission>;

constexpr int kRare = 41, kOften = 5;

std::size_t CrcBytes(bool serial) {
  return serial ? 2 : 0;
}

Bytes Pdu(const Exchange& e, const Bytes& frame) {
  return {frame.begin() + static_cast<std::ptrdiff_t>(PduAt(e.serial)),
          frame.end() - static_cast<std::ptrdiff_t>(CrcBytes(e.serial))};
}

/// The frame of another PDU in response to the same request.
Bytes Reframed(const Exchange& e, const Bytes& pdu) {
  return Frame(e.serial, e.request, e.request[PduAt(e.serial) - 1], pdu);
}

Bytes Joined(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Bytes Noise(const Exchange& e, int bytes) {
  Bytes noise;
  for (int i = 0; i < bytes; ++i) noise.push_back(static_cast<std::uint8_t>(e.Below(256)));
  return noise;
}

std::pair<Bytes, Bytes> Halves(const Bytes& bytes) {
  const auto middle = bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() / 2);
  return {Bytes(bytes.begin(), middle), Bytes(middle, bytes.end())};
}

Behaviour Late(double timeouts, int one_in) {
  return [=](Exchange& e) {
    return Emissions{{e.Once(one_in) ? timeouts * kTimeout_s : 0, e.answer}};
  };
}

/// Replaces one answer in `one_in`.
Behaviour Replaced(int one_in, Bytes (*by)(const Exchange&)) {
  return [=](Exchange& e) { return Emissions{{0, e.Once(one_in) ? by(e) : e.answer}}; };
}

Behaviour Bytewise(double timeouts) {
  return [=](Exchange& e) {
    if (!e.Once(kOften)) return Emissions{{0, e.answer}};
    Emissions emissions;
    for (std::size_t i = 0; i < e.answer.size(); ++i) {
      const double share = static_cast<double>(i) / static_cast<double>(e.answer.size());
      emissions.push_back({timeouts * kTimeout_s * share, {e.answer[i]}});
    }
    return emissions;
  };
}

Bytes WithWord(Bytes bytes, std::size_t at, int word) {
  bytes[at] = static_cast<std::uint8_t>(word >> 8);
  bytes[at + 1] = static_cast<std::uint8_t>(word & 0xFF);
  return bytes;
}

Emissions BothHalvesSwapped(Exchange& e) {
  if (!e.Once(kOften)) return {{0, e.answer}};
  const auto [first, second] = Halves(e.answer);
  return {{0, second}, {0, first}};
}

/// Holds one answer back, and sends it after the next one.
Behaviour Swapped() {
  return [held = Bytes()](Exchange& e) mutable -> Emissions {
    if (!held.empty()) {
      const Bytes late = std::exchange(held, {});
      return {{0, e.answer}, {0, late}};
    }
    if (!e.Once(kOften)) return {{0, e.answer}};
    held = e.answer;
    return {};
  };
}

/// Each request is answered with the answer to the previous one, from some request on.
Emissions OneBehind(Exchange& e) {
  if (e.number % 1000 < 900) return {{0, e.answer}};
  return e.previous_answer.empty() ? Emissions{} : Emissions{{0, e.previous_answer}};
}

/// A copy of the last answer to the same request arrives before the answer.
Emissions TwinFirst(Exchange& e) {
  if (e.earlier_twin.empty() || !e.Once(kOften)) return {{0, e.answer}};
  return {{0, e.earlier_twin}, {0, e.answer}};
}

/// The second half follows the next request.
Behaviour SecondHalfLater() {
  return [rest = Bytes()](Exchange& e) mutable -> Emissions {
    Emissions emissions;
    if (!rest.empty()) emissions.push_back({0, std::exchange(rest, {})});
    const auto [first, second] = Halves(e.answer);
    if (e.Once(kOften)) {
      rest = second;
      emissions.push_back({0, first});
    } else {
      emissions.push_back({0, e.answer});
    }
    return emissions;
  };
}

Emissions OtherSlaveFirst(Exchange& e) {
  if (!e.Once(kOften)) return {{0, e.answer}};
  const Bytes request = Frame(e.serial, e.request, 2, Pdu(e, e.request));
  return {{0, Joined(request, e.other_unit)}, {0.3 * kTimeout_s, e.answer}};
}

Bytes FlippedBit(const Exchange& e) {
  Bytes bytes = e.answer;
  // Over TCP only the header, function and byte count: its checksum protects the rest.
  const int end = e.serial ? static_cast<int>(bytes.size()) : 9;
  bytes[static_cast<std::size_t>(e.Below(end))] ^= static_cast<std::uint8_t>(1 << e.Below(8));
  return bytes;
}

Bytes Burst(const Exchange& e) {
  Bytes bytes = e.answer;
  const int at = e.Below(static_cast<int>(bytes.size()) - 2);
  bytes[static_cast<std::size_t>(at)] ^= static_cast<std::uint8_t>(1 + e.Below(255));
  bytes[static_cast<std::size_t>(at) + 1] ^= static_cast<std::uint8_t>(1 + e.Below(255));
  return bytes;
}

Bytes WrongByteCount(const Exchange& e) {
  Bytes pdu = Pdu(e, e.answer);
  pdu.resize(pdu.size() - 2);
  pdu[1] = static_cast<std::uint8_t>(pdu[1] - 2);
  return Reframed(e, pdu);
}

Bytes ByteCountOnly(const Exchange& e) {
  Bytes pdu = Pdu(e, e.answer);
  pdu[1] = static_cast<std::uint8_t>(pdu[1] - 2);
  return Reframed(e, pdu);
}

Bytes OtherFunction(const Exchange& e) {
  Bytes pdu = Pdu(e, e.other_unit);
  pdu[0] = 4;
  return Reframed(e, pdu);
}

Bytes WriteEcho(const Exchange& e) {
  Bytes pdu = Pdu(e, e.request);
  pdu[0] = 16;
  return Reframed(e, pdu);
}

Bytes Exception(const Exchange& e) {
  return Reframed(e, {static_cast<std::uint8_t>(e.request[PduAt(e.serial)] | 0x80), 2});
}

Bytes OneShort(const Exchange& e) {
  return {e.answer.begin(), e.answer.end() - 1};
}

Bytes OtherRobotIn(const Exchange& e, int length_error) {
  Bytes bytes = Reframed(e, Pdu(e, e.other_unit));
  return WithWord(bytes, 4, (bytes[4] << 8 | bytes[5]) + length_error);
}

}  // namespace

std::vector<Kind> Kinds() {
  return {
      {"answers correctly", true, true, Late(0, 1)},
      {"pauses for 2.5 timeouts once in 41 requests", true, true, Late(2.5, kRare)},
      {"pauses for 12 timeouts once in 41 requests", true, true, Late(12, kRare)},
      {"always 1.2 timeouts late", true, true, Late(1.2, 1)},
      {"always 2.8 timeouts late", true, true, Late(2.8, 1)},
      {"0 to 3 timeouts late", true, true,
       [](Exchange& e) {
         return Emissions{{0.01 * e.Below(300) * kTimeout_s, e.answer}};
       }},
      {"a byte at a time, in time", true, true, Bytewise(0.5)},
      {"a byte at a time, too late", true, true, Bytewise(3)},
      {"two pieces", true, true,
       [](Exchange& e) {
         const auto [first, second] = Halves(e.answer);
         return Emissions{{0, first}, {0.1 * kTimeout_s, second}};
       }},
      {"twice at once", true, true,
       [](Exchange& e) {
         return Emissions{{0, e.Once(kOften) ? Joined(e.answer, e.answer) : e.answer}};
       }},
      {"twice, the copy 0.05 timeouts later", true, true,
       [](Exchange& e) {
         Emissions emissions = {{0, e.answer}};
         if (e.Once(kOften)) emissions.push_back({0.05 * kTimeout_s, e.answer});
         return emissions;
       }},
      {"twice, the copy just before the next answer", true, true,
       [](Exchange& e) {
         Emissions emissions;
         if (e.Once(kOften) && !e.previous_answer.empty())
           emissions.push_back({0, e.previous_answer});
         emissions.push_back({0, e.answer});
         return emissions;
       }},
      {"a copy of the last answer to the same request first", true, true, TwinFirst},
      {"half an answer", true, true,
       Replaced(kOften, [](const Exchange& e) { return Halves(e.answer).first; })},
      {"second half after the next request", true, true, SecondHalfLater()},
      {"halves swapped", true, true, BothHalvesSwapped},
      {"answers of two requests swapped", true, true, Swapped()},
      {"one request behind for a while", true, true, OneBehind},
      {"previous answer instead of the answer", true, true,
       Replaced(kOften,
                [](const Exchange& e) {
                  return e.previous_answer.empty() ? e.answer : e.previous_answer;
                })},
      {"no answer once in 5 requests", true, true,
       [](Exchange& e) {
         return e.Once(kOften) ? Emissions{} : Emissions{{0, e.answer}};
       }},
      {"answers of the robot with unit id 2", true, true,
       Replaced(kOften, [](const Exchange& e) { return e.other_unit; })},
      {"always the robot with unit id 2", true, true,
       Replaced(1, [](const Exchange& e) { return e.other_unit; })},
      {"unit id 2 first, then the answer", true, true,
       [](Exchange& e) {
         return e.Once(kOften) ? Emissions{{0, e.other_unit}, {0, e.answer}}
                               : Emissions{{0, e.answer}};
       }},
      {"request and answer of another slave first", false, true, OtherSlaveFirst},
      {"echo of the request first", false, true,
       [](Exchange& e) {
         return Emissions{{0, Joined(e.request, e.answer)}};
       }},
      {"unit id 0, as a broadcast", true, true,
       Replaced(
           kOften,
           [](const Exchange& e) { return Frame(e.serial, e.request, 0, Pdu(e, e.other_unit)); })},
      {"transaction id 0, other robot", true, false,
       Replaced(
           kOften,
           [](const Exchange& e) { return WithWord(Reframed(e, Pdu(e, e.other_unit)), 0, 0); })},
      {"previous transaction id", true, false,
       Replaced(kOften,
                [](const Exchange& e) {
                  return WithWord(e.other_unit, 0, (e.request[0] << 8 | e.request[1]) - 1);
                })},
      {"protocol id 1, other robot", true, false,
       Replaced(
           kOften,
           [](const Exchange& e) { return WithWord(Reframed(e, Pdu(e, e.other_unit)), 2, 1); })},
      {"header length 1 too small, other robot", true, false,
       Replaced(kOften, [](const Exchange& e) { return OtherRobotIn(e, -1); })},
      {"header length 2 too large, other robot", true, false,
       Replaced(kOften, [](const Exchange& e) { return OtherRobotIn(e, 2); })},
      {"header length 65535, other robot", true, false,
       Replaced(kOften, [](const Exchange& e) { return OtherRobotIn(e, 65000); })},
      {"one register less", true, true, Replaced(kOften, WrongByteCount)},
      {"byte count wrong, length right", true, true, Replaced(kOften, ByteCountOnly)},
      {"another function code, other robot", true, true, Replaced(kOften, OtherFunction)},
      {"answer to a write", true, true, Replaced(kOften, WriteEcho)},
      {"an exception", true, true, Replaced(kOften, Exception)},
      {"an exception 1.5 timeouts late", true, true,
       [](Exchange& e) {
         return e.Once(kOften) ? Emissions{{1.5 * kTimeout_s, Exception(e)}}
                               : Emissions{{0, e.answer}};
       }},
      {"noise of 1 to 20 bytes first", true, true,
       [](Exchange& e) {
         return Emissions{
             {0, e.Once(kOften) ? Joined(Noise(e, 1 + e.Below(20)), e.answer) : e.answer}};
       }},
      {"noise of 1 to 20 bytes afterwards", true, true,
       [](Exchange& e) {
         return Emissions{
             {0, e.Once(kOften) ? Joined(e.answer, Noise(e, 1 + e.Below(20))) : e.answer}};
       }},
      {"noise instead of the answer", true, true,
       Replaced(kOften, [](const Exchange& e) { return Noise(e, 1 + e.Below(250)); })},
      {"one bit wrong", true, true, Replaced(kOften, FlippedBit)},
      {"two bytes wrong", false, true, Replaced(kOften, Burst)},
      {"last byte missing", true, true, Replaced(kOften, OneShort)},
      {"one byte too many", true, true,
       Replaced(kOften, [](const Exchange& e) { return Joined(e.answer, {0x5A}); })},
      {"refreshes between two requests", true, true, Late(0, 1), Refresh::kSometimes},
      {"refreshes after every request", true, true, Late(0, 1), Refresh::kEachRead},
      {"never refreshes", true, true, Late(0, 1), Refresh::kNever},
      {"the last answer to the same request instead of it", false, true,
       Replaced(
           kOften,
           [](const Exchange& e) { return e.earlier_twin.empty() ? e.answer : e.earlier_twin; }),
       Refresh::kAtRequest, true},
  };
}

}  // namespace hostile
