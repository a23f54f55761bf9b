// The messages of NatNet, the protocol of OptiTrack's Motive, versions 2.5 to 4.x. No I/O here. All
// numbers are little-endian; texts end with a zero byte; f32 and f64 are IEEE 754.
//
// Every datagram:
//
//     0   1    2   3    4 ...
//   +--------+--------+-----------+
//   |   id   | length |  payload  |
//   +--------+--------+-----------+
//    id         u16, MessageId
//    length     u16, bytes of the payload
//
// The server listens for commands on port 1510 and sends frames to port 1511, by multicast to
// 239.255.42.99 or to each client that keeps sending KeepAlive. Its answers:
//
//   ServerInfo   char[256] name of the program, u8[4] its version, u8[4] NatNet version; from 3.0:
//                u64 clock [Hz], u16 data port, u8 multicast, u8[4] group
//   Response     to the request "FrameRate": f32 [Hz]
//   ModelDef     the bodies (model_def.hpp)
//   Frame        their poses (frame.hpp)
//
// What the description of this driver holds (Sink::description), because a ModelDef alone does not
// say how to read it:
//
//   +-----------+-----------+------------+--------+------------------+-----------------------+
//   | major, u8 | minor, u8 | Z up?, u8  | 0, u8  | rate [Hz], f32   | payload of a ModelDef |
//   +-----------+-----------+------------+--------+------------------+-----------------------+
//    major, minor   the NatNet version; 0, 0: unknown
//    rate           frames a second; 0: unknown
//
// Sources: the packet samples of the NatNet SDK 2.5 to 4.2, and the recordings that
// drivers/natnet/README.md names.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "proto/frame/result.hpp"
#include "proto/frame/sink.hpp"

namespace posed::drivers::natnet {

inline constexpr std::uint16_t kCommandPort = 1510;

enum class MessageId : std::uint16_t {
  kConnect = 0,
  kServerInfo = 1,
  kRequest = 2,
  kResponse = 3,
  kRequestModelDef = 4,
  kModelDef = 5,
  kFrame = 7,
  kMessageText = 8,
  kDisconnect = 9,
  kKeepAlive = 10,
  kEchoRequest = 12,
  kEchoResponse = 13,
  kDiscovery = 14,
  kUnrecognized = 100
};

// A version of NatNet, not of Motive.
struct Version {
  std::uint8_t major = 0;  // 0: unknown
  std::uint8_t minor = 0;

  [[nodiscard]] constexpr bool known() const noexcept { return major != 0; }
  constexpr auto operator<=>(const Version&) const = default;
};

// "3.0", of any version, with a revision ("3.0.0") or without; nullopt for other text.
[[nodiscard]] std::optional<Version> read_version(std::string_view text) noexcept;
// The same for an option: fails for a version that posed does not know.
Result<Version> parse_version(std::string_view text);

struct Message {
  MessageId id{};
  std::span<const std::byte> payload;
};

// kOk fills `message`; kForeign: no id of NatNet; kShort: cut, or longer than it says.
RT_SAFE [[nodiscard]] Outcome decode_message(std::span<const std::byte> bytes,
                                             Message& message) noexcept;
// The same for what a client asks: some end a request with a byte more than its head says.
[[nodiscard]] Outcome decode_request(std::span<const std::byte> bytes, Message& message) noexcept;

struct ServerInfo {
  std::string_view name = "posed emulator";  // only to encode it
  Version version;
  std::uint64_t clock_hz = 0;  // of its ticks; 0 before 3.0
  // Where it sends its frames, from 3.0 on; port 0: it does not say.
  std::uint16_t data_port = 0;
  bool multicast = true;
  std::uint32_t group = 0;  // the first number in the highest byte
};
inline constexpr std::uint16_t kDataPort = 1511;
inline constexpr std::uint32_t kGroup = 0xEFFF2A63;  // 239.255.42.99

// False when the payload is too short.
RT_SAFE [[nodiscard]] bool decode_server_info(std::span<const std::byte> payload,
                                              ServerInfo& info) noexcept;

// The head of a description.
struct DescriptionHead {
  Version version;
  bool z_up = false;
  float rate_hz = 0.0F;
};
inline constexpr std::size_t kDescriptionHeadBytes = 8;

RT_SAFE void write_description_head(const DescriptionHead& head,
                                    std::span<std::byte, kDescriptionHeadBytes> bytes) noexcept;
// Zero when there are too few bytes.
RT_SAFE [[nodiscard]] DescriptionHead read_description_head(
    std::span<const std::byte> bytes) noexcept;

// The datagrams of the host and of the server. Cold.
[[nodiscard]] std::vector<std::byte> encode_message(MessageId id,
                                                    std::span<const std::byte> payload);
[[nodiscard]] std::vector<std::byte> encode_text(MessageId id, std::string_view text);
[[nodiscard]] std::vector<std::byte> encode_connect();
[[nodiscard]] std::vector<std::byte> encode_server_info(const ServerInfo& info);

// What a host says of itself in Connect (char[256] name, u8[4] its version, u8[4] its NatNet
// version; clients of SDK 4 also u8 0, u8[4] the version that they want to be sent): the version to
// send it, of 2.9 to 4.1. Short payloads say nothing, and get the newest.
[[nodiscard]] Version version_for(std::span<const std::byte> connect) noexcept;
// The newest of these versions that is no newer than `asked`, or the oldest.
[[nodiscard]] Version nearest_version(Version asked) noexcept;

}  // namespace posed::drivers::natnet
