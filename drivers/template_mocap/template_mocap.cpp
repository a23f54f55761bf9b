// The template mocap system: an invented device with several bodies over UDP, whose packets
// protocol.hpp draws. Here are the layout that its description is compiled into, its decoder, and
// its entry in the registry.
#include <algorithm>
#include <bitset>

#include "drivers/byte_reader.hpp"
#include "drivers/datagram_order.hpp"
#include "drivers/pose_values.hpp"
#include "drivers/source_type.hpp"
#include "drivers/template_mocap/emulator.hpp"
#include "drivers/template_mocap/protocol.hpp"
#include "drivers/unrolled_counter.hpp"

namespace posed::drivers {
namespace mocap {
namespace {

class MocapLayout final : public SourceLayout {
 public:
  std::vector<std::uint16_t> id;  // [body], as the device numbers them

  // Returns the index of a body; bodies.size() when there is no such body.
  RT_SAFE [[nodiscard]] std::size_t body_of(std::uint16_t wanted) const noexcept {
    return std::ranges::find(id, wanted) - id.begin();
  }
};

Result<std::unique_ptr<SourceLayout>> make_layout(std::span<const std::byte> description) {
  const auto entries = TRY(parse_description(description));
  auto layout = std::make_unique<MocapLayout>();
  for (const BodyEntry& entry : entries) {
    auto skeleton = TRY(skeleton_of(entry));
    layout->bodies.push_back({.name = entry.name, .skeleton = std::move(skeleton)});
    layout->id.push_back(entry.id);
  }
  return layout;
}

bool read_position(ByteReader& reader, Vec3f& position_m) noexcept {
  for (float& x_m : position_m) x_m = reader.f32();
  return is_plausible(position_m);
}

bool read_rotation(ByteReader& reader, Quatf& rotation, bool& seen) noexcept {
  for (float& x : rotation) x = reader.f32();
  return accept_rotation(rotation, seen);
}

// Decodes each datagram: a description is passed on, and a frame becomes one Frame for each body
// that the layout names.
class MocapDecoder final : public LayoutDecoder<MocapLayout> {
 public:
  // Each call decodes one datagram.
  RT_SAFE void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                    Sink& sink) noexcept override;

 private:
  [[nodiscard]] Outcome read_frame(std::span<const std::byte> content, Sink& sink) noexcept;
  // Reads one body and emits it if it fits the layout.
  [[nodiscard]] Outcome read_body(ByteReader& reader, std::int64_t device_ns, Sink& sink) noexcept;

  UnrolledCounter clock_{32};        // [us]
  std::bitset<kMaxBodies> emitted_;  // the bodies of the present frame so far
  DatagramOrder order_{32};          // the clock sees only frames that are new
};

RT_SAFE void MocapDecoder::feed(std::span<const std::byte> bytes, std::int64_t /*arrival_ns*/,
                                Sink& sink) noexcept {
  Datagram datagram;
  Outcome outcome = decode_datagram(bytes, datagram);
  if (outcome == Outcome::kOk) {
    switch (datagram.kind) {
      case Kind::kRequest:
        outcome = Outcome::kForeign;  // another host's
        break;
      case Kind::kDescription:
        sink.description(datagram.content);
        break;
      case Kind::kFrame:
        outcome = read_frame(datagram.content, sink);
        break;
    }
  }
  sink.outcome(outcome);
}

RT_SAFE Outcome MocapDecoder::read_frame(std::span<const std::byte> content, Sink& sink) noexcept {
  ByteReader reader(content);
  const std::uint32_t number = reader.u32();
  const std::uint32_t time_us = reader.u32();
  const std::size_t bodies = reader.u8();
  if (!reader.ok()) return Outcome::kShort;
  if (layout_ == nullptr) return Outcome::kForeign;  // the poll asks for a description
  if (const Outcome order = order_.accept(number); order != Outcome::kOk) return order;
  const std::int64_t device_ns = clock_.to(time_us).ticks * 1000;
  emitted_.reset();
  Outcome worst = Outcome::kOk;
  for (std::size_t i = 0; i < bodies; ++i) {
    const Outcome outcome = read_body(reader, device_ns, sink);
    if (outcome != Outcome::kOk) worst = outcome;
    if (outcome == Outcome::kShort) break;
  }
  return worst == Outcome::kOk && reader.left() != 0 ? Outcome::kShort : worst;
}

RT_SAFE Outcome MocapDecoder::read_body(ByteReader& reader, std::int64_t device_ns,
                                        Sink& sink) noexcept {
  Frame frame;
  const std::uint16_t id = reader.u16();
  const std::size_t joints = reader.u8();
  bool valid = joints <= kMaxJoints && read_position(reader, frame.root_position_m);
  for (std::size_t j = 0; j < joints && joints <= kMaxJoints; ++j) {
    bool seen = false;
    valid = read_rotation(reader, frame.rotation_xyzw[j], seen) && valid;
    frame.valid[j] = seen;
  }
  // With too many joints the next body cannot be found.
  if (!reader.ok() || joints > kMaxJoints) return Outcome::kShort;
  const std::size_t body = layout_->body_of(id);
  if (!valid || body == layout_->bodies.size() || emitted_[body]) return Outcome::kOutOfRange;
  const Skeleton& skeleton = *layout_->bodies[body].skeleton;
  if (joints != skeleton.joints.size()) return Outcome::kOutOfRange;
  emitted_.set(body);
  frame.header.device_ns = device_ns;
  frame.skeleton = skeleton.id;
  frame.joint_count = static_cast<std::uint16_t>(joints);
  sink.frame(body, frame);
  return Outcome::kOk;
}

struct TemplateMocap : RateSource<TemplateMocap> {
  using DecoderType = MocapDecoder;
  static constexpr std::string_view kName = "template_mocap";
  static constexpr std::string_view kSummary =
      "an invented mocap system with two people over UDP; copy its folder to begin a driver with "
      "several bodies";
  static constexpr std::string_view kWhat = "a template mocap system";
  static constexpr std::string_view kListen = "127.0.0.1:7400";
  static constexpr double kRate_hz = 100.0;
  static constexpr std::string_view kRateHelp = "frames a second that the system is set to";
  static constexpr auto make_layout = mocap::make_layout;

  // The device is asked for its description every second; the first request that has somebody to
  // go to follows its first datagram.
  static Poll poll() { return {.request = encode_request(), .period_ns = kNanosPerSecond}; }

  static Result<std::unique_ptr<Emulator>> emulator(const Options& /*options*/,
                                                    const Settings& settings) {
    return std::make_unique<MocapEmulator>(settings.rate_hz);
  }
};

}  // namespace
}  // namespace mocap

const Driver& template_mocap_driver() { return DriverOf<mocap::TemplateMocap>::get(); }

}  // namespace posed::drivers
