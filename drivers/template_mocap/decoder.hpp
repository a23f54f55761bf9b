// Decodes each datagram of the template mocap system: a description is passed on, a frame becomes
// one Frame for each body that the layout names.
#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/byte_reader.hpp"
#include "drivers/datagram_order.hpp"
#include "drivers/driver.hpp"
#include "drivers/template_mocap/layout.hpp"
#include "drivers/unrolled_counter.hpp"

namespace posed::drivers::mocap {

class MocapDecoder final : public Decoder {
 public:
  // Takes one datagram per call. RT-safe.
  void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
            Sink& sink) noexcept override;

  // Takes what make_layout made. RT-safe.
  void use(const SourceLayout& layout) noexcept override {
    layout_ = static_cast<const MocapLayout*>(&layout);
  }

 private:
  [[nodiscard]] Outcome take_frame(std::span<const std::byte> content, Sink& sink) noexcept;
  // Reads one body; emits it if it fits the layout.
  [[nodiscard]] Outcome take_body(ByteReader& reader, std::int64_t device_ns, Sink& sink) noexcept;

  const MocapLayout* layout_ = nullptr;  // null until the device has described itself
  UnrolledCounter clock_{32};            // [us]
  std::bitset<kMaxBodies> taken_;        // bodies of the frame so far
  DatagramOrder order_{32};              // the clock sees only frames that are new
};

}  // namespace posed::drivers::mocap
