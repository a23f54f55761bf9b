// Builds the large packets of a NatNet server, for the emulator and for outputs: the layouts drawn
// in frame.hpp and model_def.hpp, in any version. Cold.
#pragma once

#include <cstdint>
#include <vector>

#include "drivers/natnet/frame.hpp"
#include "drivers/natnet/model_def.hpp"

namespace posed::drivers::natnet {

struct SkeletonPacket {
  std::int32_t id = 0;
  std::vector<RigidBody> bones{};
};

struct FramePacket {
  std::uint32_t number = 0;
  std::uint32_t timecode = 0;
  double timestamp_s = 0.0;
  std::uint64_t exposure_ticks = 0, received_ticks = 0, sent_ticks = 0;
  bool bodies_changed = false;
  // Whether parts that posed does not know are filled with something, so that readers show that
  // they skip it: marker sets, assets, force plates, devices. Otherwise they are empty.
  bool invented = true;
  std::vector<RigidBody> rigid_bodies{};
  std::vector<SkeletonPacket> skeletons{};
  std::vector<LabelledMarker> labelled{};
};

// Whole datagrams, with their heads.
[[nodiscard]] std::vector<std::byte> encode_frame(const FramePacket& frame, const Reading& reading);
[[nodiscard]] std::vector<std::byte> encode_model_def(const ModelDef& model, Version version);

// Makes the description (Sink::description) that a decoder makes of such a ModelDef; the head has
// the version that it has heard of.
[[nodiscard]] std::vector<std::byte> encode_description(const ModelDef& model, Version version,
                                                        const DescriptionHead& head);

}  // namespace posed::drivers::natnet
