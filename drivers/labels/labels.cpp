// A stream without a device: a hand or a body that performs gesture labels only.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <sstream>
#include <string_view>
#include <utility>

#include "drivers/driver.hpp"
#include "drivers/file/decoder.hpp"
#include "drivers/options.hpp"
#include "drivers/transport/file.hpp"
#include "proto/clip/device_clip.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/frame/time.hpp"

namespace posed::drivers {

const Driver& labels_driver();

namespace labels {
namespace {

// Turns the clock ticks of a stream without a device into frames of its rest pose, held, to be
// filled with synthesised poses. Device time follows the ticks: frame n is at n / rate.
class LabelsDecoder final : public Decoder {
 public:
  static constexpr std::string_view kBeat = "\n";

  // `rest` is posed for the stream's skeleton; its header does not matter.
  LabelsDecoder(const Frame& rest, double rate_hz) : rest_(rest), rate_hz_(rate_hz) {
    rest_.header = {};
    rest_.source = Source::kLabels;
    rest_.quality = Quality::kHeld;
  }

  RT_SAFE void feed(std::span<const std::byte> bytes, std::int64_t /*arrival_ns*/,
                    Sink& sink) noexcept override {
    for (const std::byte byte : bytes) {
      if (static_cast<char>(byte) != kBeat.front()) {
        if (!std::exchange(foreign_, true)) sink.outcome(Outcome::kForeign);
        continue;
      }
      foreign_ = false;
      rest_.header.device_ns = nanoseconds(static_cast<double>(beats_++) / rate_hz_);
      sink.outcome(Outcome::kOk);
      sink.frame(rest_);
    }
  }

 private:
  Frame rest_;
  double rate_hz_;
  std::int64_t beats_ = 0;
  bool foreign_ = false;  // inside foreign bytes, which are already counted
};

constexpr double kMaxRate_hz = 1000.0;

// Who performs, and how they stand at rest.
struct Performer {
  std::shared_ptr<const Skeleton> skeleton;
  Frame rest;
  double rate_hz = 0.0;
};

// Keeps the last frame.
class RestSink final : public Sink {
 public:
  void frame(std::size_t /*body*/, Frame& frame) noexcept override { rest = frame; }
  void sample(std::size_t /*body*/, Sample& /*sample*/) noexcept override {}
  void outcome(Outcome /*outcome*/) noexcept override {}

  std::optional<Frame> rest;
};

// "right 30.000000" describes a hand; "body 30.000000 N", a line end, N bytes with a frame of a
// clip and then the clip's own description a body.
std::string hand_text(const std::string& side, double rate_hz) {
  return side + " " + std::to_string(rate_hz);
}

std::string body_text(const clip::DeviceClip& clip, double rate_hz) {
  const std::string& rest = clip.frames.front();
  return "body " + std::to_string(rate_hz) + " " + std::to_string(rest.size()) + "\n" + rest +
         clip.description;
}

Error damaged(const std::string& identity) {
  return {.message = "the description of a labels stream is damaged",
          .file = identity,
          .line = 0,
          .exit_code = ExitCode::kFailed};
}

// The body of a clip, as it stands in that frame.
Result<Performer> body_of(std::string_view frame, std::string_view description, double rate_hz,
                          const std::string& identity) {
  auto coding = TRY(clip::parse_description(description, identity));
  Performer body{.skeleton = coding.skeleton, .rest = {}, .rate_hz = rate_hz};
  if (body.skeleton->joint_of(Bone::kHips) < 0) {
    return fail("is no clip of a body, because no joint of it is the hips", identity);
  }
  ClipDecoder decoder(std::move(coding));
  RestSink sink;
  decoder.feed(std::as_bytes(std::span(frame)), 0, sink);
  if (!sink.rest) return std::unexpected(damaged(identity));
  body.rest = *sink.rest;
  return body;
}

Result<Performer> parse_text(const std::string& text, const std::string& identity) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  std::istringstream words(text.substr(0, end));
  std::string who, more;
  double rate_hz = 0.0;
  std::size_t bytes = 0;
  words >> who >> rate_hz;
  const bool valid = words && rate_hz >= 1.0 && rate_hz <= kMaxRate_hz;
  if (!valid) return std::unexpected(damaged(identity));
  if (who == "body") {
    const bool cut = !(words >> bytes) || words >> more || bytes > text.size() - end;
    if (cut || end == text.size()) return std::unexpected(damaged(identity));
    const std::string_view rest = std::string_view(text).substr(end + 1);
    if (bytes > rest.size()) return std::unexpected(damaged(identity));
    return body_of(rest.substr(0, bytes), rest.substr(bytes), rate_hz, identity);
  }
  const bool sided = who == "left" || who == "right";
  if (!sided || words >> more || end != text.size()) return std::unexpected(damaged(identity));
  Performer hand{.skeleton = std::make_shared<const Skeleton>(
                     hand_skeleton(who == "left" ? Side::kLeft : Side::kRight)),
                 .rest = {},
                 .rate_hz = rate_hz};
  set_hand_angles(*hand.skeleton, HandAngles{}, hand.rest);
  return hand;
}

Result<Description> describe(const std::string& text, const std::string& identity) {
  auto performer = TRY(parse_text(text, identity));
  return Description{.driver = "labels",
                     .text = text,
                     .identity = identity,
                     .skeleton = std::move(performer.skeleton),
                     .samples = {},
                     .rate_hz = performer.rate_hz};
}

Result<std::unique_ptr<Decoder>> make_decoder(const Description& description) {
  const auto performer = TRY(parse_text(description.text, description.identity));
  return std::make_unique<LabelsDecoder>(performer.rest, performer.rate_hz);
}

Result<Device> make_body(const std::string& path, double rate_hz) {
  const auto clip = TRY(clip::open_device_clip(path));
  auto device = make_device(labels_driver(), body_text(clip, rate_hz), path);
  if (device) device->warnings = clip.warnings;
  return device;
}

Result<Device> open(const Options& given, TransportFactory& /*ports*/) {
  const auto options = TRY(complete_options(labels_driver(), given));
  const auto& side = option<std::string>(options, "side");
  const auto& body = option<std::string>(options, "body");
  const double rate_hz = option<double>(options, "rate_hz");
  if (side != "left" && side != "right") return misuse("side should be \"left\" or \"right\"");
  if (!(rate_hz >= 1.0 && rate_hz <= kMaxRate_hz)) {
    return misuse("rate_hz should be 1 to 1000 frames a second");
  }
  auto device =
      TRY(body.empty() ? make_device(labels_driver(), hand_text(side, rate_hz), side + " hand")
                       : make_body(body, rate_hz));
  Chunks beat;
  beat.add(LabelsDecoder::kBeat);
  auto transport =
      TRY(FileTransport::open(std::move(beat), {.rate_hz = device.description.rate_hz}));
  device.transport = std::move(transport);
  return device;
}

}  // namespace
}  // namespace labels

const Driver& labels_driver() {
  static const Driver driver{
      .name = "labels",
      .summary =
          "a hand or a body without a device that performs labels (needs a [stream.generate] "
          "table)",
      .options = {{.name = "side",
                   .default_value = std::string("right"),
                   .help = "of a hand: left or right"},
                  {.name = "body",
                   .default_value = std::string(),
                   .is_path = true,
                   .help = "a clip of the body that performs in place of a hand; it stands as in "
                           "the first frame"},
                  {.name = "rate_hz", .default_value = 30.0, .help = "frames a second"}},
      .open = labels::open,
      .make_decoder = labels::make_decoder,
      .describe = labels::describe};
  return driver;
}

}  // namespace posed::drivers
