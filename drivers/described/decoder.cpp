#include "drivers/described/decoder.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

namespace posed::drivers::described {
namespace {

bool in_range(const Field& field, double value) noexcept {
  // NaN is rejected for a sensor, where it would bend a finger; for an extra it means missing.
  if (std::isnan(value)) return field.kind == FieldKind::kExtra;
  // A counter of whole seconds that sends fractions would lose them.
  if (field.kind == FieldKind::kTime && value != std::floor(value)) return false;
  return value >= field.low && value <= field.high;
}

}  // namespace

DescribedDecoder::DescribedDecoder(std::shared_ptr<const Table> table,
                                   std::shared_ptr<const Skeleton> skeleton,
                                   std::shared_ptr<const glove::Calibration> default_calibration)
    : GloveDecoder(std::move(skeleton), std::move(default_calibration)),
      table_(std::move(table)),
      skipping_(table_->packets.front().columns > 0),
      clock_(std::max(table_->time_bits, 1)),
      tick_ns_(table_->tick_s * 1e9) {
  extra_.fill(std::numeric_limits<float>::quiet_NaN());
}

RT_SAFE void DescribedDecoder::feed(std::span<const std::byte> bytes, std::int64_t /*arrival_ns*/,
                                    Sink& sink) noexcept {
  if (table_->link.kind == LinkKind::kHid) return accept_reports(bytes, sink);
  while (!bytes.empty()) {
    const std::size_t room = std::min(bytes.size(), pending_.size() - pending_bytes_);
    std::memcpy(pending_.data() + pending_bytes_, bytes.data(), room);
    pending_bytes_ += room;
    bytes = bytes.subspan(room);
    const std::span<const std::byte> all(pending_.data(), pending_bytes_);
    const std::size_t done =
        table_->delimiter.empty() ? accept_stream(all, sink) : accept_delimited(all, sink);
    assert(done > 0 || pending_bytes_ < pending_.size());  // otherwise it would never go on
    pending_bytes_ -= done;
    std::memmove(pending_.data(), pending_.data() + done, pending_bytes_);
  }
}

RT_SAFE std::size_t DescribedDecoder::accept_stream(std::span<const std::byte> bytes,
                                                    Sink& sink) noexcept {
  std::size_t at = 0;
  while (at < bytes.size()) {
    const Look look = look_for_packet(*table_, bytes.subspan(at));
    if (look.found == Look::Found::kMayCome) break;
    if (look.found == Look::Found::kNothing) {
      damaged(look.why, sink);
      ++at;
      continue;
    }
    const bool good = accept_packet(*look.rule, bytes.subspan(at, look.bytes), sink);
    // With a checksum it is certain that this is a packet, whatever its values; without one the
    // header may have been data.
    const bool sure = good || look.rule->checksum.kind != ChecksumKind::kNone;
    at += sure ? look.bytes : 1;
  }
  return at;
}

RT_SAFE std::size_t DescribedDecoder::accept_delimited(std::span<const std::byte> bytes,
                                                       Sink& sink) noexcept {
  const auto& delimiter = table_->delimiter;
  std::size_t begin = 0;
  for (;;) {
    const auto from = bytes.begin() + static_cast<std::ptrdiff_t>(begin + searched_);
    const auto found = std::search(from, bytes.end(), delimiter.begin(), delimiter.end());
    if (found == bytes.end()) break;
    const auto next = static_cast<std::size_t>(found - bytes.begin()) + delimiter.size();
    if (!std::exchange(skipping_, false)) accept_piece(bytes.subspan(begin, next - begin), sink);
    begin = next;
    searched_ = 0;
  }
  const std::size_t rest = bytes.size() - begin;
  if (rest > kMaxPacketBytes) {  // longer than any packet: discard up to the next delimiter
    if (!std::exchange(skipping_, true)) accept_piece(bytes.subspan(begin), sink);
    begin = bytes.size() - (delimiter.size() - 1);
  }
  searched_ = bytes.size() - begin;
  searched_ -= std::min(searched_, delimiter.size() - 1);
  return begin;
}

RT_SAFE void DescribedDecoder::accept_piece(std::span<const std::byte> piece, Sink& sink) noexcept {
  in_step_ = true;  // the delimiter limits the damage, so each piece is counted
  if (piece.size() > kMaxPacketBytes) return damaged(Outcome::kShort, sink);
  const Look look = look_for_packet(*table_, piece);
  if (look.found == Look::Found::kPacket && look.bytes == piece.size()) {
    accept_packet(*look.rule, piece, sink);
  } else {
    damaged(look.found == Look::Found::kNothing ? look.why : Outcome::kShort, sink);
  }
}

RT_SAFE void DescribedDecoder::accept_reports(std::span<const std::byte> bytes,
                                              Sink& sink) noexcept {
  while (!bytes.empty()) {
    const Look look = look_for_packet(*table_, bytes);
    in_step_ = true;  // the next report begins with the next chunk
    if (look.found != Look::Found::kPacket) {
      damaged(look.found == Look::Found::kMayCome ? Outcome::kShort : look.why, sink);
      return;
    }
    accept_packet(*look.rule, bytes.first(look.bytes), sink);
    bytes = bytes.subspan(look.bytes);
  }
}

RT_SAFE bool DescribedDecoder::accept_packet(const PacketRule& rule,
                                             std::span<const std::byte> packet,
                                             Sink& sink) noexcept {
  for (std::size_t i = 0; i < rule.fields.size(); ++i) {
    value_[i] = read_field(rule.fields[i], packet);
    if (!in_range(rule.fields[i], value_[i])) {
      damaged(Outcome::kOutOfRange, sink);
      return false;
    }
  }
  in_step_ = true;
  keep_values(rule);
  sink.outcome(Outcome::kOk);
  if (!rule.poses) return true;
  emit({.raw = std::span(raw_).first(table_->model.sensors.size()),
        .valid = seen_,
        .extra = std::span(extra_).first(table_->extra_names.size()),
        .device_ns = device_ns_,
        .quality = quality_},
       sink);
  return true;
}

RT_SAFE void DescribedDecoder::keep_values(const PacketRule& rule) noexcept {
  for (std::size_t i = 0; i < rule.fields.size(); ++i) {
    const Field& field = rule.fields[i];
    const double value = value_[i];
    if (field.kind == FieldKind::kSensor) {
      raw_[field.index] = static_cast<float>(value);
      seen_[field.index] = true;
    } else if (field.kind == FieldKind::kExtra) {
      extra_[field.index] = static_cast<float>(value * field.scale + field.offset);
    } else {
      const std::int64_t before_ns = device_ns_;
      const auto step = clock_.to(static_cast<std::uint64_t>(value));
      device_ns_ = std::llround(static_cast<double>(step.ticks) * tick_ns_);
      const bool repeats = device_ns_ == before_ns && !step.restarted;
      quality_ = repeats ? Quality::kHeld : Quality::kMeasured;
    }
  }
}

RT_SAFE void DescribedDecoder::damaged(Outcome why, Sink& sink) noexcept {
  if (std::exchange(in_step_, false)) sink.outcome(why);
}

}  // namespace posed::drivers::described
