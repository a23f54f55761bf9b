// A sink that stores a decoder's output. Memory is reserved, so that storing does not allocate.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <vector>

#include "proto/frame/sink.hpp"

namespace posed::test {

class CollectSink final : public Sink {
 public:
  explicit CollectSink(std::size_t room = 4096) {
    frames.reserve(room);
    bodies.reserve(room);
    described.reserve(kMaxDescription);
    samples.reserve(room);
    sample_bodies.reserve(room);
  }
  void frame(std::size_t body, Frame& frame) noexcept override {
    frames.push_back(frame);
    bodies.push_back(body);
  }
  void sample(std::size_t body, Sample& sample) noexcept override {
    samples.push_back(sample);
    sample_bodies.push_back(body);
  }
  void description(std::span<const std::byte> bytes) noexcept override {
    ++descriptions;
    described.assign(bytes.begin(), bytes.end());
  }
  void outcome(Outcome outcome) noexcept override { ++outcomes[static_cast<std::size_t>(outcome)]; }

  [[nodiscard]] int count(Outcome outcome) const {
    return outcomes[static_cast<std::size_t>(outcome)];
  }
  void clear() {
    frames.clear();
    bodies.clear();
    samples.clear();
    sample_bodies.clear();
    outcomes.fill(0);
  }

  std::vector<Frame> frames;
  std::vector<std::size_t> bodies;  // [frame]
  std::vector<Sample> samples;
  std::vector<std::size_t> sample_bodies;  // [sample]
  int descriptions = 0;
  std::vector<std::byte> described;  // the newest description
  std::array<int, kOutcomes> outcomes{};
};

// Bitwise equality, so that a missing angle (NaN) equals itself.
inline bool same_bits(const std::array<float, kMaxChannels>& a,
                      const std::array<float, kMaxChannels>& b) {
  return std::bit_cast<std::array<std::uint32_t, kMaxChannels>>(a) ==
         std::bit_cast<std::array<std::uint32_t, kMaxChannels>>(b);
}

// Bitwise equality of the poses, whatever their times are.
inline bool same_pose(const Frame& a, const Frame& b) {
  return a.skeleton == b.skeleton && a.joint_count == b.joint_count &&
         a.angle_count == b.angle_count && a.valid == b.valid && a.quality == b.quality &&
         a.source == b.source && a.root_position_m == b.root_position_m &&
         a.rotation_xyzw == b.rotation_xyzw && same_bits(a.angle_rad, b.angle_rad);
}

inline bool same_values(const Sample& a, const Sample& b) {
  return a.value_count == b.value_count && a.valid == b.valid && a.value == b.value;
}

// Every valid value is finite, and every valid rotation has unit length.
inline bool is_valid(const Frame& frame) {
  for (std::size_t j = 0; j < frame.joint_count; ++j) {
    double squared = 0.0;
    for (const float x : frame.rotation_xyzw[j]) squared += static_cast<double>(x) * x;
    if (!(std::abs(squared - 1.0) < 1e-5)) return false;
  }
  for (const float x : frame.root_position_m) {
    if (!std::isfinite(x)) return false;
  }
  return frame.joint_count <= kMaxJoints && frame.angle_count <= kMaxChannels;
}

inline bool is_valid(const Sample& sample) {
  for (std::size_t i = 0; i < sample.value_count; ++i) {
    if (sample.valid[i] && !std::isfinite(sample.value[i])) return false;
  }
  return sample.value_count <= kMaxSampleValues;
}

}  // namespace posed::test
