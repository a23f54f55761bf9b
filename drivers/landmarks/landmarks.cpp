// The landmarks driver: hands that a tracker finds in a camera's picture, as JSON over UDP. Each
// hand is a body, "left" or "right", of hand45. Here are the description that the decoder writes,
// the layout, the decoder, and the entry in the registry.
#include <algorithm>

#include "drivers/active_time.hpp"
#include "drivers/landmarks/emulator.hpp"
#include "drivers/landmarks/fit.hpp"
#include "drivers/landmarks/protocol.hpp"
#include "drivers/source_type.hpp"
#include "drivers/timestamp_clock.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::drivers {
namespace landmarks {
namespace {

constexpr std::array<std::string_view, kMaxHands> kSideNames{"left", "right"};  // as Side

// The description is one byte, the sides that were seen: 1 left, 2 right, 3 both.
class HandsLayout final : public SourceLayout {
 public:
  std::array<std::size_t, kMaxHands> body_of{kMaxBodies, kMaxBodies};  // [side]; or there is none
};

Result<std::unique_ptr<SourceLayout>> make_layout(std::span<const std::byte> description) {
  const auto sides = description.size() == 1 ? std::to_integer<unsigned>(description[0]) : 0U;
  if (sides < 1 || sides > 3) return fail("the description of a hand tracker is one byte, 1 to 3");
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
  // Each call decodes one datagram.
  RT_SAFE void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                    Sink& sink) noexcept override;

  // `layout` is one that make_layout made.
  RT_SAFE void use(const SourceLayout& layout) noexcept override {
    layout_ = static_cast<const HandsLayout*>(&layout);
  }

 private:
  [[nodiscard]] Outcome accept(Sink& sink) noexcept;
  [[nodiscard]] Outcome emit(const TrackedHand& hand, Sink& sink) noexcept;
  void describe(std::int64_t now_ns, Sink& sink) noexcept;

  // A tracker that takes one hand for the other for a moment makes no new body.
  static constexpr int kSteady = 3;  // messages in a row with a hand of that side
  static constexpr std::int64_t kAgain_ns = kNanosPerSecond;

  const HandsLayout* layout_ = nullptr;  // null until the first description is in use
  HandFit fit_;
  Message message_;
  TimestampClock clock_;
  ActiveTime active_time_;
  std::array<int, kMaxHands> in_a_row_{};  // [side]
  std::byte sides_{};                      // seen for so long
  std::byte described_{};
  std::int64_t described_ns_ = kNoTime_ns;
};

RT_SAFE void LandmarksDecoder::feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                                    Sink& sink) noexcept {
  const std::int64_t now_ns = active_time_.to(arrival_ns);
  Outcome outcome =
      read_message({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, message_);
  if (outcome == Outcome::kOk) outcome = clock_.accept(message_.time_s);
  if (outcome == Outcome::kOk) {
    outcome = accept(sink);
    describe(now_ns, sink);
  }
  sink.outcome(outcome);
}

RT_SAFE Outcome LandmarksDecoder::accept(Sink& sink) noexcept {
  Outcome worst = Outcome::kOk;
  std::array<bool, kMaxHands> seen{};
  for (std::size_t i = 0; i < message_.count; ++i) {
    const TrackedHand& hand = message_.hands[i];
    Outcome outcome = hand.outcome;
    if (outcome == Outcome::kOk && hand.seen()) {
      seen[static_cast<std::size_t>(hand.side)] = true;
      outcome = emit(hand, sink);
    }
    if (outcome != Outcome::kOk) worst = outcome;
  }
  for (std::size_t at = 0; at < kMaxHands; ++at) {
    in_a_row_[at] = seen[at] ? std::min(in_a_row_[at] + 1, kSteady) : 0;
    if (in_a_row_[at] == kSteady) sides_ |= std::byte{1} << at;
  }
  return worst;
}

RT_SAFE Outcome LandmarksDecoder::emit(const TrackedHand& hand, Sink& sink) noexcept {
  const std::size_t body =
      layout_ == nullptr ? kMaxBodies : layout_->body_of[static_cast<std::size_t>(hand.side)];
  if (body == kMaxBodies) return Outcome::kForeign;
  HandAngles angles{};
  if (!fit_.angles_of(hand.side, hand.point_m, angles)) return Outcome::kOutOfRange;
  Frame frame;
  set_hand_angles(*layout_->bodies[body].skeleton, angles, frame);
  frame.header.device_ns = clock_.device_ns();
  sink.frame(body, frame);
  return Outcome::kOk;
}

// Also again while what was described is not in use, because somebody may not have heard it.
RT_SAFE void LandmarksDecoder::describe(std::int64_t now_ns, Sink& sink) noexcept {
  if (sides_ == std::byte{}) return;
  const bool waits =
      layout_ == nullptr && (described_ns_ == kNoTime_ns || now_ns - described_ns_ >= kAgain_ns);
  if (sides_ == described_ && !waits) return;
  described_ = sides_;
  described_ns_ = now_ns;
  sink.description({&described_, 1});
}

struct LandmarksSource : RateSource<LandmarksSource> {
  using DecoderType = LandmarksDecoder;
  static constexpr std::string_view kName = "landmarks";
  static constexpr std::string_view kSummary =
      "hands that a tracker finds in a camera's picture, as JSON over UDP: the page's own camera, "
      "OpenXR, Leap Motion, scripts (experimental)";
  static constexpr std::string_view kWhat = "a hand tracker";
  static constexpr std::string_view kListen = "127.0.0.1:7420";  // kUsualPort
  static constexpr double kRate_hz = 10.0;
  static constexpr std::string_view kRateHelp =
      "about how many messages a second the tracker sends";
  static constexpr auto make_layout = landmarks::make_layout;

  static Result<std::unique_ptr<Emulator>> emulator(const Options& /*options*/,
                                                    const Settings& settings) {
    return std::make_unique<LandmarksEmulator>(settings.rate_hz);
  }
};

}  // namespace
}  // namespace landmarks

const Driver& landmarks_driver() { return DriverOf<landmarks::LandmarksSource>::get(); }

}  // namespace posed::drivers
