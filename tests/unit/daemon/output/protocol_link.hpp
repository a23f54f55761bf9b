// What the tests of outputs that speak a device's protocol share: the protocol's emulator, and a
// reader that decodes as a second posed does.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include "drivers/driver.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/unit/daemon/output/output_rig.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace posed::output {

// Uses each description at once, as the daemon does a little later.
class ProtocolReader {
 public:
  explicit ProtocolReader(const std::string& driver, const drivers::Options& options = {})
      : driver_(*drivers::find_driver(driver)),
        decoder_(driver_.make_decoder(driver_.expect(options).value()).value()) {}

  void feed(std::span<const std::byte> datagram, std::int64_t now_ns) {
    const int before = sink_.descriptions;
    sink_.clear();
    decoder_->feed(datagram, now_ns, sink_);
    for (std::size_t i = 0; i < sink_.frames.size(); ++i) {
      newest[bodies()[sink_.bodies[i]].name] = sink_.frames[i];
      ++frames;
    }
    for (const Outcome outcome : {Outcome::kShort, Outcome::kBadChecksum, Outcome::kOutOfRange,
                                  Outcome::kLate, Outcome::kDuplicate}) {
      if (sink_.count(outcome) == 0) continue;
      damage += std::string(kOutcomeNames[static_cast<std::size_t>(outcome)]) + " at frame " +
                std::to_string(frames) + ", ";
    }
    if (sink_.descriptions == before) return;
    auto layout = driver_.make_layout(sink_.described);
    if (!layout) FAIL(layout.error().text());
    layouts_.push_back(std::move(*layout));
    decoder_->use(*layouts_.back());
    newest.clear();
  }
  [[nodiscard]] drivers::Decoder& decoder() { return *decoder_; }
  [[nodiscard]] const std::vector<drivers::Body>& bodies() const {
    static const std::vector<drivers::Body> kNone;
    return layouts_.empty() ? kNone : layouts_.back()->bodies;
  }
  // Null while nobody of this name is described.
  [[nodiscard]] std::shared_ptr<const Skeleton> skeleton(const std::string& body) const {
    const auto at = std::ranges::find(bodies(), body, &drivers::Body::name);
    return at == bodies().end() ? nullptr : at->skeleton;
  }

  std::map<std::string, Frame> newest;  // [body] since the last description
  int frames = 0;
  std::string damage;  // what was wrong with datagrams

 private:
  const drivers::Driver& driver_;
  std::unique_ptr<drivers::Decoder> decoder_;
  std::vector<std::unique_ptr<const drivers::SourceLayout>> layouts_;
  test::CollectSink sink_{64};
};

// How far two poses of one skeleton are apart at most.
struct Apart {
  double rad = 0.0, m = 0.0;
  int timecodes = 0;  // that differ
};

inline void compare(const Skeleton& skeleton, const Frame& a, const Frame& b, Apart& worst) {
  if (a.timecode != b.timecode) ++worst.timecodes;
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
    worst.rad = std::max(worst.rad, angle_between_rad(to_eigen_double(a.rotation_xyzw[j]),
                                                      to_eigen_double(b.rotation_xyzw[j])));
  }
  for (std::size_t k = 0; k < 3; ++k) {
    worst.m = std::max(worst.m, std::abs(static_cast<double>(a.root_position_m[k]) -
                                         static_cast<double>(b.root_position_m[k])));
  }
}

// Returns whether both have the same joints; `worst.m` grows to how far their bones differ.
inline bool same_figure(const Skeleton& a, const Skeleton& b, Apart& worst) {
  if (a.joints.size() != b.joints.size()) return false;
  for (std::size_t j = 0; j < a.joints.size(); ++j) {
    const Joint &first = a.joints[j], &second = b.joints[j];
    if (first.name != second.name || first.parent != second.parent || first.bone != second.bone) {
      return false;
    }
    if (j > 0) worst.m = std::max(worst.m, (first.offset_m - second.offset_m).norm());
  }
  return true;
}

}  // namespace posed::output
