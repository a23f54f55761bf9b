// The landmarks driver: hands that a tracker finds in a camera's picture, as JSON over UDP or
// TCP. Each hand is a body, "left" or "right", of hand45. Here are the description that the decoder
// writes, the layout, the decoder, and the entry in the registry.
#include <algorithm>
#include <limits>

#include "drivers/glove/line_reader.hpp"
#include "drivers/landmarks/emulator.hpp"
#include "drivers/landmarks/fit.hpp"
#include "drivers/landmarks/protocol.hpp"
#include "drivers/landmarks/tracks.hpp"
#include "drivers/source_type.hpp"
#include "drivers/timestamp_clock.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::drivers {
namespace landmarks {
namespace {

constexpr std::array<std::string_view, kMaxHands> kSideNames{"left", "right"};  // as Side

// The description is one byte, the sides that there are: 1 left, 2 right, 3 both, 0 none any more.
class HandsLayout final : public SourceLayout {
 public:
  std::array<std::size_t, kMaxHands> body_of{kMaxBodies, kMaxBodies};  // [side]; or there is none
};

Result<std::unique_ptr<SourceLayout>> make_layout(std::span<const std::byte> description) {
  const auto sides = description.size() == 1 ? std::to_integer<unsigned>(description[0]) : 4U;
  if (sides > 3) return fail("the description of a hand tracker is one byte, 0 to 3");
  auto layout = std::make_unique<HandsLayout>();
  for (const Side side : {Side::kLeft, Side::kRight}) {
    const auto at = static_cast<std::size_t>(side);
    if ((sides >> at & 1U) == 0) continue;
    layout->body_of[at] = layout->bodies.size();
    layout->bodies.push_back({.name = std::string(kSideNames[at]),
                              .skeleton = std::make_shared<const Skeleton>(hand_skeleton(side))});
  }
  return layout;
}

class LandmarksDecoder final : public Decoder {
 public:
  // `stream`: lines over TCP. Otherwise each call decodes one datagram.
  explicit LandmarksDecoder(bool stream) : stream_(stream) {}

  RT_SAFE void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                    Sink& sink) noexcept override;

  // `layout` is one that make_layout made.
  RT_SAFE void use(const SourceLayout& layout) noexcept override {
    layout_ = static_cast<const HandsLayout*>(&layout);
  }

 private:
  [[nodiscard]] Outcome read(std::string_view json, Sink& sink) noexcept;
  [[nodiscard]] Outcome accept(Sink& sink) noexcept;
  void bridge(Side side, bool read, Sink& sink) noexcept;
  [[nodiscard]] Outcome angles_of(const TrackedHand& hand, HandAngles& angles) const noexcept;
  [[nodiscard]] Outcome emit(Side side, const HandAngles& angles, Sink& sink) noexcept;
  void describe(std::int64_t now_ns, Sink& sink) noexcept;

  // A tracker that takes one hand for the other for a moment makes no new body.
  static constexpr int kSteady = 3;  // messages in a row with a hand of that side
  static constexpr std::int64_t kAgain_ns = kNanosPerSecond;

  bool stream_;
  glove::LineReader<kMaxMessage> lines_;
  const HandsLayout* layout_ = nullptr;  // null until the first description is in use
  HandFit fit_;
  HandTracks tracks_;
  Message message_;
  TimestampClock clock_;
  std::array<int, kMaxHands> in_a_row_{};  // [side]
  std::byte sides_{};                      // seen for so long
  std::byte described_{};
  std::int64_t now_ns_ = 0;
  std::int64_t described_ns_ = kNoTime_ns;
};

RT_SAFE void LandmarksDecoder::feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                                    Sink& sink) noexcept {
  now_ns_ = std::max(now_ns_, arrival_ns);
  if (!stream_) {
    return sink.outcome(read({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, sink));
  }
  lines_.feed(
      bytes, [&](std::string_view line) noexcept { sink.outcome(read(line, sink)); },
      [&]() noexcept { sink.outcome(Outcome::kOutOfRange); });
}

RT_SAFE Outcome LandmarksDecoder::read(std::string_view json, Sink& sink) noexcept {
  Outcome outcome = read_message(json, message_);
  if (outcome == Outcome::kOk) outcome = clock_.accept(message_.time_s);
  if (outcome != Outcome::kOk) return outcome;
  tracks_.follow(message_, now_ns_);
  outcome = accept(sink);
  describe(now_ns_, sink);
  return outcome;
}

RT_SAFE Outcome LandmarksDecoder::accept(Sink& sink) noexcept {
  Outcome worst = Outcome::kOk;
  std::array<bool, kMaxHands> seen{}, read{};
  for (std::size_t i = 0; i < message_.count; ++i) {
    const TrackedHand& hand = message_.hands[i];
    Outcome outcome = hand.outcome;
    if (outcome == Outcome::kOk && hand.seen()) {
      seen[static_cast<std::size_t>(hand.side)] = true;
      HandAngles angles{};
      if (!hand.doubtful) outcome = angles_of(hand, angles);
      if (!hand.doubtful && outcome == Outcome::kOk) outcome = emit(hand.side, angles, sink);
      read[static_cast<std::size_t>(hand.side)] = !hand.doubtful;
    }
    if (outcome != Outcome::kOk) worst = outcome;
  }
  for (std::size_t at = 0; at < kMaxHands; ++at) {
    in_a_row_[at] = seen[at] ? std::min(in_a_row_[at] + 1, kSteady) : 0;
    if (in_a_row_[at] == kSteady) sides_ |= std::byte{1} << at;
    bridge(static_cast<Side>(at), read[at], sink);
  }
  if (message_.end) sides_ = std::byte{};
  return worst;
}

// A hand that was not read in this picture is somewhere: a frame without angles keeps its stream.
RT_SAFE void LandmarksDecoder::bridge(Side side, bool read, Sink& sink) noexcept {
  if (read || !tracks_.knows(side, now_ns_)) return;
  HandAngles unknown{};
  unknown.fill(std::numeric_limits<double>::quiet_NaN());
  static_cast<void>(emit(side, unknown, sink));
}

RT_SAFE Outcome LandmarksDecoder::angles_of(const TrackedHand& hand,
                                            HandAngles& angles) const noexcept {
  return fit_.angles_of(hand.shape, hand.point_m, angles) ? Outcome::kOk : Outcome::kOutOfRange;
}

RT_SAFE Outcome LandmarksDecoder::emit(Side side, const HandAngles& angles, Sink& sink) noexcept {
  const std::size_t body =
      layout_ == nullptr ? kMaxBodies : layout_->body_of[static_cast<std::size_t>(side)];
  if (body == kMaxBodies) return Outcome::kForeign;
  Frame frame;
  set_hand_angles(*layout_->bodies[body].skeleton, angles, frame);
  frame.header.device_ns = clock_.device_ns();
  sink.frame(body, frame);
  return Outcome::kOk;
}

// Also again while what was described is not in use, because somebody may not have heard it.
RT_SAFE void LandmarksDecoder::describe(std::int64_t now_ns, Sink& sink) noexcept {
  const bool waits = layout_ == nullptr && sides_ != std::byte{} &&
                     (described_ns_ == kNoTime_ns || now_ns - described_ns_ >= kAgain_ns);
  if (sides_ == described_ && !waits) return;
  described_ = sides_;
  described_ns_ = now_ns;
  sink.description({&described_, 1});
}

constexpr double kDefaultRate_hz = 10.0;

struct LandmarksSettings {
  bool stream = false;  // over TCP
  double rate_hz = kDefaultRate_hz;
};

std::string link_prefix(bool stream) {
  return stream ? "landmarks link=tcp rate=" : "landmarks rate=";
}

struct LandmarksSource : NetworkRateSource<LandmarksSource> {
  using Settings = LandmarksSettings;
  static constexpr std::string_view kName = "landmarks";
  static constexpr std::string_view kSummary =
      "hands that a tracker finds in a camera's picture, as JSON over UDP or TCP: the page's own "
      "camera, OpenXR, Leap Motion, scripts (experimental)";
  static constexpr std::string_view kWhat = "a hand tracker";
  static constexpr std::string_view kExample = "landmarks rate=10";
  static constexpr bool kOftenEmpty = true;
  using DecoderType = LandmarksDecoder;
  static constexpr auto link_prefix = landmarks::link_prefix;
  static constexpr auto make_layout = landmarks::make_layout;

  static std::vector<OptionSpec> option_specs() {
    auto specs = network_options("udp", "127.0.0.1:7420");
    specs.push_back(
        rate_option(kDefaultRate_hz, "about how many messages a second the tracker sends"));
    return specs;
  }
  static Result<Settings> settings(const Options& options) {
    return Settings{.stream = option<std::string>(options, "link") == "tcp",
                    .rate_hz = option<double>(options, "rate_hz")};
  }
  static Result<std::unique_ptr<Emulator>> emulator(const Options& /*options*/,
                                                    const Settings& settings) {
    return std::make_unique<LandmarksEmulator>(settings.rate_hz);
  }
};

}  // namespace
}  // namespace landmarks

const Driver& landmarks_driver() { return DriverOf<landmarks::LandmarksSource>::get(); }

}  // namespace posed::drivers
