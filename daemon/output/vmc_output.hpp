// VmcOutput: sends one avatar to programs of the VMC protocol, as OSC over UDP. Each frame has
// root, bones, blend shapes, status and time, in bundles that fit a network packet.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/output/output.hpp"
#include "daemon/output/udp_receivers.hpp"
#include "drivers/driver.hpp"
#include "drivers/vmc/messages.hpp"
#include "models/motion/retarget.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::output {

// The parts of an avatar that have streams of their own.
enum class Part : std::uint8_t { kBody, kLeftHand, kRightHand };
inline constexpr std::size_t kParts = 3;
inline constexpr std::array<Part, kParts> kAllParts{Part::kBody, Part::kLeftHand, Part::kRightHand};

[[nodiscard]] constexpr std::size_t index_of(Part part) noexcept {
  return static_cast<std::size_t>(part);
}

// The name of the part in the config.
[[nodiscard]] constexpr std::string_view words_for(Part part) noexcept {
  constexpr std::array<std::string_view, kParts> kWords{"body", "left hand", "right hand"};
  return kWords[index_of(part)];
}

// The humanoid with the bones of an avatar's file. A program that shows a glTF file turns its bones
// from how they rest there, also where that is no T-pose. Cold.
Result<std::shared_ptr<const Skeleton>> avatar_figure(const std::filesystem::path& path);

// One pose of the VMC protocol's humanoid, put together from a stream with the body and streams
// with single hands. Each stream is brought onto the canonical humanoid with its own proportions,
// or with an avatar's; the fingers of a hand's stream replace those of the body. One thread.
class Avatar {
 public:
  // With `hands_only` only the body's wrists and fingers are written, as VMC's role "assistant"
  // does.
  // `figure` has the proportions that are sent, and its zero pose is the one from which the bones
  // are turned (motion::resting_skeleton()); null: each part's own, from the T-pose.
  explicit Avatar(bool hands_only, std::shared_ptr<const Skeleton> figure = nullptr)
      : hands_only_(hands_only), figure_(std::move(figure)) {}

  // Sets the skeleton of a part whose stream has come; null when the stream has left. The part has
  // no pose until the next set_pose(). An error says why the skeleton cannot move this part. Cold.
  Result<> set_skeleton(Part part, const std::shared_ptr<const Skeleton>& skeleton);

  // Sets the pose of a part. Returns false, and does nothing, for a part without a skeleton.
  bool set_pose(Part part, const Frame& frame) noexcept;

  // Writes the root, if there is a whole body, and all bones that have a pose, parents first. All
  // positions but that of the hips are those of the zero pose.
  void write(drivers::vmc::DatagramWriter& writer) const noexcept;

 private:
  struct Moved {
    std::size_t joint = 0;  // index in the canonical skeleton
    std::size_t bone = 0;   // index in the protocol
    Vec3f offset_m{};
  };
  struct Source {
    std::optional<motion::Retarget> to_canonical;
    std::vector<Moved> moved;
    Frame pose{};         // on the canonical skeleton
    float rise_m = 0.0F;  // of the hips, so that the soles of an avatar stand on the floor
    bool posed = false;
  };
  [[nodiscard]] bool writes(Part part, Bone bone) const noexcept;

  bool hands_only_;
  std::shared_ptr<const Skeleton> figure_;
  std::array<Source, kParts> sources_;  // [part]
};

enum class VrmNames : std::uint8_t { kVrm0, kVrm1 };

// Returns the preset's name in the wanted version ("Joy" and "happy" are one preset); a name that
// is no preset stays as it is.
[[nodiscard]] std::string_view preset_name(std::string_view name, VrmNames wanted) noexcept;

// Finds the values of a face among the samples of a stream and writes them under the names that VRM
// models of version 0 or 1 have for them. One thread.
class BlendShapes {
 public:
  explicit BlendShapes(VrmNames names) : names_(names) {}

  // Sets the layout of the stream's samples. Values without unit whose name has no '/' are blend
  // shapes; those for which a frame of the protocol has no room are left out. Returns how many were
  // left out. Cold.
  std::size_t set_layout(const drivers::SampleLayout& samples);

  void update(const Sample& sample) noexcept;

  // Writes the values that were measured, and the message that ends a frame: some receivers move
  // their bones only when it comes.
  void write(drivers::vmc::DatagramWriter& writer) const noexcept;

 private:
  struct Shape {
    std::size_t index = 0;  // the place of its value in a sample
    std::string name;       // the name that is sent
    float value = 0.0F;
    bool known = false;
  };
  VrmNames names_;
  std::vector<Shape> shapes_;
};

class VmcOutput final : public Output {
 public:
  static Result<std::unique_ptr<Output>> open(const config::OutputConfig& config,
                                              std::unique_ptr<system::EventFd> wake);
  VmcOutput(const config::OutputConfig& config, std::unique_ptr<system::EventFd> wake,
            std::shared_ptr<const Skeleton> figure, UdpReceivers receivers);

 private:
  [[nodiscard]] Result<> set_stream(std::size_t place, const LiveStream* stream) override;
  void begin_turn(std::int64_t now_ns) override;
  [[nodiscard]] bool take(std::size_t place, const Frame& frame, std::int64_t now_ns) override;
  void send(std::int64_t now_ns) override;
  [[nodiscard]] std::int64_t end_turn(std::int64_t now_ns) override;
  // Whether frames of this part trigger sending. Those of the body do; while it has none, those of
  // the left hand do, then those of the right hand.
  [[nodiscard]] bool leads(Part part, std::int64_t now_ns) const noexcept;

  bool assistant_;
  Avatar avatar_;
  BlendShapes shapes_;
  UdpReceivers receivers_;
  Datagrams datagrams_;
  std::unique_ptr<drivers::vmc::DatagramWriter> writer_;
  std::array<std::int64_t, kParts> measured_ns_;  // [part] when its last measured frame came
  Quality quality_ = Quality::kMeasured;          // of the frame that makes it send
  std::int64_t begin_ns_ = kNoTime_ns;            // the zero of the time that is sent
};

}  // namespace posed::output
