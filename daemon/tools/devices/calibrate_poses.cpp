#include "daemon/tools/devices/calibrate_poses.hpp"

#include <algorithm>
#include <chrono>

namespace posed::tools {
namespace {

using drivers::glove::Pose;
using drivers::glove::Recorded;
using SteadyClock = std::chrono::steady_clock;

constexpr double kRestlessShare = 0.12;  // share of a sensor's range; its noise is far less
constexpr double kPatience_s = 5.0;      // for a glove that sends nothing while the user reads

class Recording {
 public:
  Recording(GloveSource& source, const PosePlan& plan, PoseGuide& guide)
      : source_(source), plan_(plan), guide_(guide) {}

  Result<Recorded> run() {
    const std::vector<Pose> poses = plan_.poses();
    for (std::size_t i = 0; i < poses.size();) {
      const auto word = ask(poses[i]);
      if (!word) return std::unexpected(word.error());
      if (*word == PoseGuide::Word::kStop) return fail("stopped; no calibration was written");
      if (*word == PoseGuide::Word::kBack) {
        i -= i > 0 ? 1 : 0;
        continue;
      }
      if (auto held = hold(poses[i]); !held) return std::unexpected(held.error());
      ++i;
    }
    return recorded_;
  }

 private:
  using Raw = GloveSource::Raw;
  using Valid = GloveSource::Valid;

  // Shows the live hand until the user confirms, or the time to get ready has passed.
  Result<PoseGuide::Word> ask(Pose pose) {
    guide_.want(pose);
    const double ready_s = plan_.ready_s.value_or(0.0);
    begin();
    PoseGuide::Word word = PoseGuide::Word::kNothing;
    const auto enough = [&] {
      word = guide_.hear();
      if (plan_.ready_s && word == PoseGuide::Word::kNothing && past_s() >= ready_s) {
        word = PoseGuide::Word::kGo;
      }
      return word != PoseGuide::Word::kNothing;
    };
    const auto show = [&](const Raw& raw, const Valid& valid) {
      guide_.show(raw, valid, PosePhase::kAsked, ready_s - past_s(), ready_s);
    };
    while (word == PoseGuide::Word::kNothing) {
      if (auto ok = source_.listen(kPatience_s, show, enough); !ok) {
        return std::unexpected(ok.error());
      }
    }
    return word;
  }

  Result<> hold(Pose pose) {
    auto& held = recorded_[static_cast<std::size_t>(pose)];
    held = {};
    begin();
    const double held_s = plan_.seconds[static_cast<std::size_t>(pose)];
    // shown to the user as one time in which to hold still
    const double whole_s = plan_.settle_s + held_s;
    const auto settle = [&](const Raw& raw, const Valid& valid) {
      guide_.show(raw, valid, PosePhase::kSettling, whole_s - past_s(), whole_s);
    };
    if (auto ok = source_.listen(plan_.settle_s, settle); !ok) return ok;
    begin();
    std::array<std::optional<Span>, drivers::glove::kMaxSensors> spans{};
    const auto keep = [&](const Raw& raw, const Valid& valid) {
      for (std::size_t i = 0; i < raw.size(); ++i) {
        if (!valid[i]) continue;
        held[i].add(raw[i]);
        if (!spans[i]) spans[i] = Span{raw[i], raw[i]};
        spans[i]->low = std::min(spans[i]->low, raw[i]);
        spans[i]->high = std::max(spans[i]->high, raw[i]);
      }
      guide_.show(raw, valid, PosePhase::kHeld, held_s - past_s(), whole_s);
    };
    if (auto ok = source_.listen(held_s, keep); !ok) return ok;
    const auto& sensors = source_.model().sensors;
    for (std::size_t i = 0; i < sensors.size(); ++i) {
      if (!spans[i] || !is_restless(*spans[i], sensors[i])) continue;
      guide_.restless(pose, sensors[i].name);
      break;
    }
    return {};
  }

  struct Span {
    float low, high;
  };
  static bool is_restless(const Span& span, const drivers::glove::Sensor& sensor) {
    const double range = sensor.raw_max - sensor.raw_min;
    return static_cast<double>(span.high - span.low) > kRestlessShare * range;
  }

  void begin() { begun_ = SteadyClock::now(); }
  [[nodiscard]] double past_s() const {
    return std::chrono::duration<double>(SteadyClock::now() - begun_).count();
  }

  GloveSource& source_;
  const PosePlan& plan_;
  PoseGuide& guide_;
  Recorded recorded_{};
  SteadyClock::time_point begun_{};  // start of the phase
};

}  // namespace

std::vector<Pose> PosePlan::poses() const {
  std::vector<Pose> poses;
  for (std::size_t p = 0; p < seconds.size(); ++p) {
    if (seconds[p] > 0.0) poses.push_back(static_cast<Pose>(p));
  }
  return poses;
}

Result<Recorded> record_poses(GloveSource& source, const PosePlan& plan, PoseGuide& guide) {
  return Recording(source, plan, guide).run();
}

}  // namespace posed::tools
