// A decoder of MVN's datagrams that uses each description at once, as the daemon does a little
// later, and tools to build datagrams.
#pragma once

#include <catch2/catch.hpp>

#include <memory>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/mvn/decoder.hpp"
#include "drivers/mvn/emulator.hpp"
#include "drivers/mvn/encode.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace posed::test {

using MvnBytes = std::vector<std::byte>;
using MvnLayouts = std::vector<std::unique_ptr<const drivers::SourceLayout>>;

struct MvnSession {
  drivers::mvn::MvnDecoder decoder;
  MvnLayouts layouts;
  CollectSink sink{64};
  std::int64_t now_ns = 0;

  explicit MvnSession(bool stream = false) : decoder(stream) {}

  void feed(std::span<const std::byte> bytes) {
    const int before = sink.descriptions;
    decoder.feed(bytes, now_ns, sink);
    if (sink.descriptions == before) return;
    auto layout = drivers::mvn::make_layout(sink.described);
    REQUIRE(layout);
    layouts.push_back(std::move(*layout));
    decoder.use(*layouts.back());
  }
  // The emulator's next datagram.
  MvnBytes step(drivers::mvn::MvnEmulator& emulator) {
    MvnBytes bytes;
    now_ns = emulator.next_due_ns();
    emulator.emit(now_ns, bytes);
    feed(bytes);
    return bytes;
  }
  // All datagrams that are due before this time.
  void run(drivers::mvn::MvnEmulator& emulator, std::int64_t until_ns) {
    while (emulator.next_due_ns() < until_ns) step(emulator);
  }
  [[nodiscard]] const std::vector<drivers::Body>& bodies() const { return layouts.back()->bodies; }
  [[nodiscard]] int damaged() const {
    int count = 0;
    for (int i = 1; i < kOutcomes; ++i) count += sink.count(static_cast<Outcome>(i));
    return count - sink.count(Outcome::kForeign);
  }
};

inline drivers::mvn::MvnEmulator mvn_emulator(std::vector<drivers::mvn::Type> types,
                                              std::size_t characters = 1,
                                              std::size_t longest = 4096) {
  return drivers::mvn::MvnEmulator(
      {.rate_hz = 100.0, .types = std::move(types), .characters = characters, .longest = longest});
}

// A head of version 2019 or later for one datagram of a pose without props.
inline drivers::mvn::Head mvn_head(drivers::mvn::Type type, std::uint32_t sample, bool fingers) {
  using namespace drivers::mvn;
  const std::size_t items = fingers ? kSegments : kBodySegments;
  return {.type = type,
          .sample = sample,
          .items = static_cast<std::uint8_t>(items),
          .time_ms = sample * 10,
          .body = kBodySegments,
          .fingers = static_cast<std::uint8_t>(items - kBodySegments)};
}

// The emulated walker, each segment turned a little about another axis.
inline drivers::mvn::CharacterPose mvn_pose(bool fingers) {
  drivers::mvn::CharacterPose pose;
  pose.fingers = fingers;
  const drivers::mvn::Character walker = drivers::mvn::emulated_walker();
  for (std::size_t i = 0; i < walker.segments(); ++i) {
    const int parent = drivers::mvn::parent_segment(i);
    auto& segment = pose.segments[i];
    const double angle_rad = 0.02 * static_cast<double>(i);
    segment.rotation_xyzw = from_eigen(axis_rotation(static_cast<Axis>(i % 3), angle_rad));
    segment.seen = true;
    segment.position_m = walker.offset_m[i];
    if (parent < 0) continue;
    const auto& above = pose.segments[static_cast<std::size_t>(parent)];
    const Vec3f& o = walker.offset_m[i];
    const Eigen::Vector3d offset =
        to_eigen_double(above.rotation_xyzw) * Eigen::Vector3d(o[0], o[1], o[2]);
    for (std::size_t k = 0; k < 3; ++k) {
      segment.position_m[k] = above.position_m[k] + static_cast<float>(offset[static_cast<int>(k)]);
    }
  }
  return pose;
}

inline MvnBytes mvn_datagram(drivers::mvn::Type type, std::uint32_t sample, bool fingers = false) {
  return drivers::mvn::encode_datagram(mvn_head(type, sample, fingers),
                                       drivers::mvn::encode_pose(type, mvn_pose(fingers)));
}

inline double mvn_apart_m(const Vec3f& a, const Vec3f& b) {
  double apart_m = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    apart_m = std::max(apart_m, std::abs(static_cast<double>(a[k]) - static_cast<double>(b[k])));
  }
  return apart_m;
}

inline double mvn_apart_rad(const Quatf& a, const Quatf& b) {
  return angle_between_rad(to_eigen_double(a), to_eigen_double(b));
}

}  // namespace posed::test
