#include "drivers/fivedt/decoder.hpp"

#include <algorithm>
#include <cassert>
#include <numbers>

#include "drivers/glove/angle_map.hpp"

namespace posed::drivers::fivedt {
namespace {

constexpr std::array<std::string_view, kMaxValues> kWideNames{
    "thumb_near",  "thumb_far",  "thumb_index", "index_near", "index_far", "index_middle",
    "middle_near", "middle_far", "middle_ring", "ring_near",  "ring_far",  "ring_little",
    "little_near", "little_far", "thumb_palm",  "wrist_bend"};

bool has_tilt(Form form) noexcept { return form == Form::kFive || form == Form::kFiveWireless; }

}  // namespace

RT_SAFE void Framer::feed(std::span<const std::byte> bytes, Readings& readings) noexcept {
  for (const std::byte byte : bytes) {
    assert(pending_bytes_ < pending_.size());
    pending_[pending_bytes_++] = byte;
    while (pending_bytes_ > 0 && advance(readings)) {
    }
  }
}

// Consumes bytes from the front; returns false when it needs more bytes.
RT_SAFE bool Framer::advance(Readings& readings) noexcept {
  return in_step_ ? advance_in_step(readings) : advance_hunting();
}

RT_SAFE bool Framer::advance_in_step(Readings& readings) noexcept {
  const std::size_t length = packet_length(form_, pending());
  if (length == 0) {
    if (consume_tail()) return true;
    in_step_ = false;
    just_lost_ = true;
    readings.outcome(Outcome::kForeign);
    return true;
  }
  if (pending_bytes_ < length) return false;
  Reading reading;
  const auto packet = pending().first(length);
  Outcome outcome = decode_packet(form_, packet, reading);
  if (outcome == Outcome::kOk && is_usb(form_) && !is_half_used(packet)) {
    outcome = Outcome::kForeign;
  }
  // An info packet is not a measurement and is not counted.
  if (reading.kind == Reading::Kind::kData) readings.outcome(outcome);
  in_step_ = outcome == Outcome::kOk;
  just_lost_ = !in_step_;
  if (!in_step_) return true;
  if (form_ == Form::kUltraWireless) ports_[std::to_integer<std::size_t>(packet[1])] = true;
  drop(length);
  after_packet_ = true;
  readings.reading(reading);
  return true;
}

// Searches for the next packet that cannot be a coincidence.
RT_SAFE bool Framer::advance_hunting() noexcept {
  if (just_lost_) return skip_damaged();
  const std::size_t length = packet_length(form_, pending());
  const std::size_t needed = length + (form_ == Form::kUltraWireless ? 1 : 0);
  if (length > 0 && pending_bytes_ < needed) return false;
  in_step_ = length > 0 && is_packet(pending());
  hunted_ = in_step_ ? 0 : hunted_ + 1;
  if (!in_step_) drop(1);
  return true;
}

// When bytes were changed but none lost, the next packet is at its expected position, which is
// tried first: in the packets of a Data Glove 5 any byte 80 looks like a start, even with a valid
// checksum while the hand does not move.
RT_SAFE bool Framer::skip_damaged() noexcept {
  const std::size_t length = packet_bytes(form_);
  if (pending_bytes_ <= length) return false;
  const std::size_t start = length + (is_tail(pending_[length]) ? 1 : 0);
  if (pending_bytes_ <= start) return false;
  const auto next = pending().subspan(start);
  if (next.size() < packet_length(form_, next)) return false;
  just_lost_ = false;
  in_step_ = packet_length(form_, next) > 0 && is_packet(next);
  if (in_step_) drop(start);
  return true;
}

// True when `bytes` begins with a whole packet, and for an Ultra Wireless kit with one more byte if
// it is available.
RT_SAFE bool Framer::is_packet(std::span<const std::byte> bytes) noexcept {
  const std::size_t length = packet_length(form_, bytes);
  const auto packet = bytes.first(length);
  Reading reading;
  if (decode_packet(form_, packet, reading) != Outcome::kOk) return false;
  if (form_ == Form::kUltraWireless) {
    // Only the start of the next record confirms this one, and a hand that does not move repeats
    // its bytes: at first only ports that were seen before are accepted.
    constexpr std::size_t kShy = 256;  // bytes
    const bool known = ports_[std::to_integer<std::size_t>(packet[1])];
    const bool followed = bytes.size() == length || packet_length(form_, bytes.subspan(length)) > 0;
    return followed && (known || ports_.none() || hunted_ > kShy);
  }
  // Zeros fit everywhere, so a report must begin with a sensor that measures.
  return !is_usb(form_) || (reading.value[0] != 0 && is_half_used(packet));
}

RT_SAFE bool Framer::is_tail(std::byte byte) const noexcept {
  return (form_ == Form::kFive && byte == kReady) ||
         (form_ == Form::kFiveWireless && is_capability(byte));
}

// Consumes the byte that may follow a packet of a Data Glove 5.
RT_SAFE bool Framer::consume_tail() noexcept {
  if (!after_packet_) return false;
  after_packet_ = false;
  const std::byte byte = pending_[0];
  if (!is_tail(byte)) return false;
  if (form_ == Form::kFiveWireless) capability_ = std::to_integer<int>(byte);
  drop(1);
  return true;
}

// True when a glove that leaves the second half of its reports zero still does so: over USB nothing
// shifts, but a report of another kind is noticed.
RT_SAFE bool Framer::is_half_used(std::span<const std::byte> report) noexcept {
  const bool zero = std::ranges::all_of(report.subspan(2 * kMaxValues),
                                        [](std::byte byte) { return byte == std::byte{0}; });
  if (usb_tail_ == Tail::kUnknown) usb_tail_ = zero ? Tail::kZero : Tail::kUsed;
  return zero || usb_tail_ == Tail::kUsed;
}

RT_SAFE void Framer::drop(std::size_t count) noexcept {
  std::copy(pending_.begin() + static_cast<std::ptrdiff_t>(count),
            pending_.begin() + static_cast<std::ptrdiff_t>(pending_bytes_), pending_.begin());
  assert(count <= pending_bytes_);
  pending_bytes_ -= count;
}

Result<glove::Model> model(Form form) {
  glove::Model model{.driver = "fivedt", .sensors = {}};
  const bool narrow = sensors_of(form) == kFingers;
  for (std::size_t i = 0; i < sensors_of(form); ++i) {
    glove::Sensor sensor{.name = std::string(narrow ? kFingerNames[i] : kWideNames[i]),
                         .raw_max = has_tilt(form) ? 255.0 : 4095.0,
                         .curve = {},
                         .unit = "1"};
    sensor.curve = has_tilt(form) ? glove::Curve::line(0.0, 0.0, 255.0, 1.0)
                                  : glove::Curve::line(kStraight, 0.0, kBent, 1.0);
    model.sensors.push_back(std::move(sensor));
  }
  return glove::with_device_table(std::move(model), narrow ? "fivedt-5" : "fivedt-14");
}

SampleLayout layout(const glove::Model& model, Form form) {
  if (!has_tilt(form)) return glove::sample_layout(model);
  const std::array<std::string, 2> extras{"pitch", "roll"};
  SampleLayout layout = glove::sample_layout(model, extras);
  std::fill_n(layout.units.rbegin(), extras.size(), "rad");
  return layout;
}

RT_SAFE void FiveDtDecoder::feed(std::span<const std::byte> bytes, std::int64_t /*arrival_ns*/,
                                 Sink& sink) noexcept {
  sink_ = &sink;
  framer_.feed(bytes, *this);
  sink_ = nullptr;
}

RT_SAFE void FiveDtDecoder::reading(const Reading& reading) noexcept {
  const bool mine = settings_.form != Form::kUltraWireless || reading.port_b == settings_.port_b;
  if (reading.kind != Reading::Kind::kData || !mine) return;
  const std::size_t sensors = sensors_of(settings_.form);
  std::array<float, glove::kMaxSensors> raw{};
  glove::Packet packet{.raw = std::span(raw).first(sensors), .valid = {}, .extra = {}};
  for (std::size_t i = 0; i < sensors; ++i) {
    raw[i] = static_cast<float>(reading.value[value_of_sensor(settings_.form, i)]);
    packet.valid[i] = true;
  }
  constexpr float kTilt_rad = std::numbers::pi_v<float> / 255.0F;
  const std::array<float, 2> tilt{kTilt_rad * static_cast<float>(reading.pitch),
                                  kTilt_rad * static_cast<float>(reading.roll)};
  if (has_tilt(settings_.form)) packet.extra = tilt;
  const bool same = has_before_ && before_ == reading.value;
  if (settings_.polled && same) packet.quality = Quality::kHeld;
  before_ = reading.value;
  has_before_ = true;
  emit(packet, *sink_);
}

}  // namespace posed::drivers::fivedt
