// A record sink that keeps nothing. Tests override what they look at.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "daemon/pipeline/record_sink.hpp"

namespace posed::test {

class QuietRecordSink : public pipeline::RecordSink {
 public:
  void chunk(std::uint32_t, std::uint8_t, pipeline::Direction, std::int64_t,
             const pipeline::Position&, std::span<const std::byte>) noexcept override {}
  [[nodiscard]] bool keeps_up(std::uint32_t, std::uint32_t) const noexcept override { return true; }
  void decision(const pipeline::Decision&) noexcept override {}
  [[nodiscard]] bool wants_published() const noexcept override { return false; }
  void published(std::uint32_t, std::uint64_t, bool, std::span<const std::byte>) noexcept override {
  }
  void unpublished(std::uint32_t) noexcept override {}
  void keep_model(std::span<const std::byte>) override {}
  Result<pipeline::Take> mark_take(const pipeline::TakeMark&) override {
    return fail("it keeps no takes");
  }
};

}  // namespace posed::test
