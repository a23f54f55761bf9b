// The messages that another daemon publishes (proto/wire/posed/v1/posed.proto), as this driver
// reads them. A chunk is one message of ZeroMQ: its topic, a zero byte, its body.
//
//   skeleton/<stream> 00 posed.v1.Skeleton       every second, and when somebody subscribes
//   pose/<stream>     00 posed.v1.Frame
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/sink.hpp"

namespace posed::drivers::chain {

// Numbers of a list that may come packed or one by one.
template <std::size_t N>
struct FloatList {
  std::array<float, N> values{};
  std::size_t count = 0;
};

// The fields of posed.v1.Frame that are carried on. Texts point into the message.
struct UpstreamFrame {
  std::uint64_t sequence = 0;
  std::int64_t arrival_ns = 0;  // on the clock of the upstream's machine
  std::uint32_t skeleton_id = 0;
  FloatList<3> root_position_m{};
  FloatList<std::size_t{4} * kMaxJoints> rotation_xyzw{};
  std::span<const std::byte> validity{};
  FloatList<kMaxChannels> angle_rad{};
  std::uint64_t quality = 0;
  std::uint64_t source = 0;
  std::string_view label{};
  std::string_view timecode{};
  float label_probability = 0.0F;
  std::uint64_t lag_frames = 0;
  float lag_ms = 0.0F;
};

struct UpstreamMessage {
  std::string_view topic{};
  std::span<const std::byte> body{};
};

// False for a chunk without a zero byte.
RT_SAFE [[nodiscard]] bool split_message(std::span<const std::byte> chunk,
                                         UpstreamMessage& message) noexcept;
// The chunk of a message. Cold.
[[nodiscard]] std::vector<std::byte> join_message(std::string_view topic, std::string_view body);

// kShort for bytes that are no message, kOutOfRange for lists that are too long and for fields of
// another type. Fields that a later version adds are skipped.
RT_SAFE [[nodiscard]] Outcome read_frame(std::span<const std::byte> body,
                                         UpstreamFrame& frame) noexcept;

// Returns whether posed.v1.Skeleton names a stream and it is not this one. Other damage is for
// make_layout to find.
RT_SAFE [[nodiscard]] bool is_of_other_stream(std::span<const std::byte> skeleton,
                                              std::string_view stream) noexcept;

// Device info: "posed stream=ann rate=60".
struct UpstreamInfo {
  std::string stream;
  double rate_hz = 0.0;
};
[[nodiscard]] std::string device_info_text(const UpstreamInfo& info);
Result<UpstreamInfo> parse_device_info(const std::string& text, const std::string& identity);
// Returns whether an upstream may have a stream of this name: [a-z0-9_-], with "-raw" at most 36
// bytes.
[[nodiscard]] bool is_upstream_stream(std::string_view name);

}  // namespace posed::drivers::chain
