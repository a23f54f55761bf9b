#include "drivers/axis/decoder.hpp"

#include <array>

#include "proto/frame/degree.hpp"

namespace posed::drivers::axis {
namespace {

constexpr std::size_t kMaxFrameChannels = 6 + 3 + 3 * kBones;
constexpr double kMaxTime_s = 1e9;  // only damaged frame numbers lead so far

// The values of a message as those of skeleton_of()'s channels [m, rad]; returns their number.
// RT-safe.
std::size_t to_channels(const Message& message,
                        std::array<double, kMaxFrameChannels>& channels) noexcept {
  std::size_t size = 0;
  const auto convert = [&](std::size_t at, double scale) {
    for (std::size_t i = 0; i < 3; ++i) channels[size++] = message.values[at + i] * scale;
  };
  if (message.content.reference) {
    convert(0, kCentimetre_m);
    convert(3, kDegree);
  }
  convert(rotations_at(message.content, kHips) - 3, kCentimetre_m);
  for (std::size_t b = 0; b < kBones; ++b) convert(rotations_at(message.content, b), kDegree);
  return size;
}

}  // namespace

// RT-safe.
void AxisDecoder::feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                       Sink& sink) noexcept {
  sink_ = &sink;
  now_ns_ = arrival_ns;
  reader_.feed(bytes, *this);
  if (const auto news = roster_.news(arrival_ns); !news.empty()) sink.description(news);
}

// RT-safe.
bool AxisDecoder::binary(std::span<const std::byte> bytes, bool in_damage) noexcept {
  Outcome outcome = decode_binary(bytes, message_);
  const bool valid = outcome == Outcome::kOk;
  if (valid) outcome = accept_message();
  if (valid || !in_damage) sink_->outcome(outcome);
  return valid;
}

// RT-safe.
void AxisDecoder::text(std::string_view text, bool in_damage) noexcept {
  Outcome outcome = decode_text(text, message_);
  const bool valid = outcome == Outcome::kOk;
  if (valid) outcome = accept_message();
  if (valid || !in_damage) sink_->outcome(outcome);
}

// RT-safe.
Outcome AxisDecoder::accept_message() noexcept {
  Present* const present = roster_.find(message_.avatar);
  if (present == nullptr) return Outcome::kOutOfRange;  // more avatars than bodies of a source
  if (settings_.datagrams && message_.frame_number != 0) {
    const Outcome order = present->order.convert(message_.frame_number);
    if (order != Outcome::kOk) return order;
  }
  roster_.see(*present, message_, now_ns_);
  if (layout_ == nullptr) return Outcome::kForeign;
  const std::size_t body = layout_->body_of(message_.avatar);
  if (body == layout_->bodies.size() ||
      layout_->known[body].reference != message_.content.reference) {
    return Outcome::kForeign;  // until the new description is in use
  }
  emit_frame(body, *present);
  return Outcome::kOk;
}

// RT-safe.
void AxisDecoder::emit_frame(std::size_t body, const Present& present) noexcept {
  std::array<double, kMaxFrameChannels> channels;
  const std::size_t count = to_channels(message_, channels);
  Frame frame;
  if (settings_.rate_hz > 0.0 && message_.frame_number != 0) {
    const double time_s = static_cast<double>(present.tick) / settings_.rate_hz;
    if (time_s < kMaxTime_s) frame.header.device_ns = nanoseconds(time_s);
  }
  pose_from_channels(*layout_->bodies[body].skeleton, std::span(channels).first(count), frame);
  sink_->frame(body, frame);
}

}  // namespace posed::drivers::axis
