// What the tests of the Axis driver share: messages, and a decoder whose descriptions are used at
// once, as the daemon does a little later.
#pragma once

#include <catch2/catch.hpp>

#include <string_view>
#include <vector>

#include "drivers/axis/emulator.hpp"
#include "drivers/axis/protocol.hpp"
#include "tests/unit/drivers/decoder_of.hpp"

namespace posed::test {

using AxisBytes = std::vector<std::byte>;

inline AxisBytes axis_text_bytes(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

inline AxisBytes axis_bytes(const drivers::axis::Message& message,
                            drivers::axis::Form form = drivers::axis::Form::kBinary) {
  AxisBytes bytes(drivers::axis::kMaxText);
  if (form == drivers::axis::Form::kText) {
    const std::span room(reinterpret_cast<char*>(bytes.data()), bytes.size());
    bytes.resize(drivers::axis::encode_text(message, room));
  } else {
    bytes.resize(drivers::axis::encode_binary(message, form, bytes));
  }
  REQUIRE_FALSE(bytes.empty());
  return bytes;
}

// An avatar of default proportions that bends all its joints a little.
inline drivers::axis::Message axis_message(std::uint32_t avatar, std::string_view name,
                                           std::uint32_t frame_number,
                                           drivers::axis::Content content = {.displacement = true,
                                                                             .reference = false}) {
  namespace axis = drivers::axis;
  axis::Message message{.avatar = axis::make_avatar(avatar, name),
                        .content = content,
                        .frame_number = frame_number,
                        .values = {}};
  for (std::size_t b = 0; b < axis::kBones; ++b) {
    const std::size_t at = axis::rotations_at(content, b);
    for (std::size_t i = 0; i < 3; ++i) {
      message.values[at + i] = 0.25 * static_cast<double>(b + i);
      if (b != axis::kHips && !content.displacement) continue;
      message.values[at - 3 + i] = static_cast<double>(axis::default_proportions()[b][i]);
    }
  }
  return message;
}

struct AxisRig : DecoderRig {
  explicit AxisRig(const drivers::Options& options = {}) : DecoderRig("axis", options) {}

  std::int64_t now_ns = 0;

  void feed(const AxisBytes& bytes) { DecoderRig::feed(bytes, now_ns); }
  // The emulator's next record, at its own time.
  void step(drivers::axis::AxisEmulator& emulator) {
    now_ns = emulator.next_due_ns();
    AxisBytes bytes;
    emulator.emit(now_ns, bytes);
    feed(bytes);
  }
  // Introduces an avatar; its first frames, which come before its layout, are forgotten.
  void introduce(const drivers::axis::Message& message) {
    feed(axis_bytes(message));
    sink.clear();
  }
  // The one outcome of the bytes.
  Outcome outcome_of(const AxisBytes& bytes) {
    sink.clear();
    feed(bytes);
    int all = 0;
    Outcome found = Outcome::kCount;
    for (int i = 0; i < kOutcomes; ++i) {
      const auto outcome = static_cast<Outcome>(i);
      all += sink.count(outcome);
      if (sink.count(outcome) > 0) found = outcome;
    }
    CHECK(all == 1);
    CHECK(sink.frames.size() == (found == Outcome::kOk ? 1 : 0));
    return found;
  }
};

}  // namespace posed::test
