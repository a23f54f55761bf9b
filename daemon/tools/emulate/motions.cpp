#include "daemon/tools/emulate/motions.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "daemon/system/realtime.hpp"
#include "drivers/driver.hpp"
#include "drivers/options.hpp"
#include "models/motion/interpolate.hpp"
#include "models/motion/retarget.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/sink.hpp"

namespace posed::emulate {
namespace {

struct Performer {
  std::size_t body;
  motion::Retarget retarget;
  Frame pose;
};

struct Performance {
  clip::Clip clip;
  std::vector<Performer> performers;
  Frame pose;  // of the clip
};

void pose_bodies(Performance& performance, double time_s, drivers::Emulator& emulator) {
  const clip::Clip& clip = performance.clip;
  const double at = std::fmod(std::max(time_s, 0.0) * clip.frame_rate_hz, clip.frames());
  const int before = std::min(static_cast<int>(at), clip.frames() - 1);
  const int after = std::min(before + 1, clip.frames() - 1);
  performance.pose = clip.frame(before);
  motion::interpolate(*clip.skeleton, clip.frame(before), clip.frame(after), at - before,
                      performance.pose);
  for (Performer& performer : performance.performers) {
    performer.retarget.apply(performance.pose, performer.pose);
    // A suit measures all of its bones: those that the clip does not have rest on their parents.
    for (std::size_t j = 0; j < performer.pose.joint_count; ++j) performer.pose.valid.set(j);
    emulator.pose(performer.body, performer.pose);
  }
}

}  // namespace

Result<Motion> clip_motion(const std::vector<std::filesystem::path>& paths,
                           drivers::Emulator& emulator) {
  auto performances = std::make_shared<std::vector<Performance>>();
  for (const auto& path : paths) {
    auto clip = TRY(clip::read_clip(path));
    performances->emplace_back().clip = std::move(clip);
  }
  std::size_t people = 0;
  for (std::size_t body = 0; body < kMaxBodies; ++body) {
    const bool more = people < paths.size();
    if (emulator.skeleton(body) == nullptr && !(more && emulator.add_person())) continue;
    Performance& performance = (*performances)[people % performances->size()];
    const Skeleton& skeleton = *emulator.skeleton(body);
    auto retarget = motion::Retarget::bind(performance.clip.skeleton,
                                           std::make_shared<const Skeleton>(skeleton));
    if (!retarget) continue;  // a prop
    performance.performers.push_back({.body = body, .retarget = std::move(*retarget), .pose = {}});
    ++people;
  }
  if (people == 0) {
    return misuse("no body of the device has a bone of the clip; choose a clip of a person",
                  paths.front().string());
  }
  if (people < paths.size()) {
    return misuse("the device has fewer people than there are clips: name " +
                  std::to_string(people) + (people == 1 ? " clip" : " clips"));
  }
  return Motion([performances](double time_s, drivers::Emulator& moved) {
    for (Performance& performance : *performances) pose_bodies(performance, time_s, moved);
  });
}

Result<std::unique_ptr<SyntheticSigner>> SyntheticSigner::start(const std::string& name,
                                                                const std::filesystem::path& clip,
                                                                bool realtime) {
  const drivers::Driver* driver = drivers::find_driver(name);
  if (driver == nullptr || driver->emulate == nullptr) {
    return misuse("driver '" + name + "' has no emulator, so it cannot be used here");
  }
  auto motion = TRY(clip::read_hand_clip(clip));
  const auto options = TRY(drivers::complete_options(*driver, {}));
  auto emulator = TRY(driver->emulate(options));
  auto port = TRY(EmulatedPort::open_pty());
  return std::unique_ptr<SyntheticSigner>(
      new SyntheticSigner(std::move(emulator), std::move(port), std::move(motion), realtime));
}

SyntheticSigner::SyntheticSigner(std::unique_ptr<drivers::Emulator> emulator, EmulatedPort port,
                                 clip::HandClip clip, bool realtime)
    : clip_(std::move(clip)),
      glove_(std::move(emulator), std::move(port),
             hand_motion([this](double time_s) { return pose_at(clip_, time_s); }), {}),
      thread_([this, realtime](const std::stop_token& stop) {
        system::enter_hot_thread("signer", realtime ? system::kDevicePriority : 0);
        glove_.run(stop);
      }) {}

}  // namespace posed::emulate
