// Values: the blend shapes and tracked devices of a VMC performer, by the names that it sends. They
// become the values of a Sample.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <utility>

#include "drivers/vmc/layout.hpp"
#include "drivers/vmc/protocol.hpp"
#include "proto/frame/frame.hpp"

namespace posed::drivers::vmc {

// RT-safe.
class Values {
 public:
  // The values of one message: one of a blend shape, seven of a device. A new name takes the place
  // of one that has not come for kForgotten_ns when there is no other place, or is left out.
  void set(ValueKind kind, std::string_view name, std::span<const float> values,
           std::int64_t arrival_ns) noexcept;

  // Sets the names that have a place in samples. `layout` outlives its use.
  void use(const VmcLayout& layout) noexcept;

  // True once when a name has come that the description does not have.
  [[nodiscard]] bool consume_new() noexcept { return std::exchange(new_, false); }

  // True if something came since the last sample.
  [[nodiscard]] bool fresh() const noexcept { return fresh_; }
  // Fills the sample: blend shapes keep their value until they are sent again; a device that was
  // not sent since the last sample is not valid.
  void fill(Sample& sample) noexcept;

  // Adds what came within kForgotten_ns, as far as a sample has room for it.
  void describe(std::int64_t now_ns, Described& described) const noexcept;
  // When something came last; kNoTime_ns if nothing did.
  [[nodiscard]] std::int64_t last_ns() const noexcept { return last_ns_; }

 private:
  static constexpr std::int64_t kForgotten_ns = 10 * kNanosPerSecond;
  struct Entry {
    ValueKind kind{};
    std::array<char, kMaxVmcName> text{};
    std::size_t size = 0;  // of the text
    std::array<float, 7> values{};
    std::int64_t last_ns = 0;
    bool fresh = false;
    int place = VmcLayout::kNone;

    [[nodiscard]] std::string_view name() const noexcept { return {text.data(), size}; }
  };
  [[nodiscard]] Entry* find(ValueKind kind, std::string_view name) noexcept;
  [[nodiscard]] Entry* make(ValueKind kind, std::string_view name, std::int64_t now_ns) noexcept;

  std::array<Entry, kMaxVmcValues> entries_{};
  std::size_t count_ = 0;
  const VmcLayout* layout_ = nullptr;
  bool new_ = false, fresh_ = false;
  std::int64_t last_ns_ = kNoTime_ns;
};

}  // namespace posed::drivers::vmc
