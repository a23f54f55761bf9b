// The UDP datagrams of a recording of network traffic (pcapng), for real recordings of streams.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <vector>

#include <catch2/catch.hpp>

namespace posed::test {

using Datagram = std::vector<std::byte>;

inline Datagram file_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto bytes = std::as_bytes(std::span(text));
  REQUIRE_FALSE(bytes.empty());
  return {bytes.begin(), bytes.end()};
}

template <typename T>
T value_at(std::span<const std::byte> bytes, std::size_t place) {
  REQUIRE(place + sizeof(T) <= bytes.size());
  T value{};
  std::memcpy(&value, bytes.data() + place, sizeof value);
  return value;
}

// The payloads of a file with Ethernet and IPv4, in their order.
inline std::vector<Datagram> datagrams_of(const Datagram& pcapng) {
  constexpr std::uint32_t kEnhancedPacket = 6;
  constexpr std::size_t kPacketHead = 28;
  constexpr std::size_t kEthernet = 14;
  std::vector<Datagram> datagrams;
  for (std::size_t block = 0; block + 12 <= pcapng.size();) {
    const auto length = value_at<std::uint32_t>(pcapng, block + 4);
    REQUIRE(length >= 12);
    if (value_at<std::uint32_t>(pcapng, block) == kEnhancedPacket) {
      const auto packet = std::span(pcapng).subspan(block + kPacketHead,
                                                    value_at<std::uint32_t>(pcapng, block + 20));
      const bool udp = packet[12] == std::byte{8} && packet[kEthernet + 9] == std::byte{17};
      const std::size_t head =
          kEthernet + 4 * (std::to_integer<std::size_t>(packet[kEthernet]) & 15) + 8;
      const auto size = std::to_integer<std::size_t>(packet[head - 4]) << 8 |
                        std::to_integer<std::size_t>(packet[head - 3]);
      if (udp) {
        const auto payload = packet.subspan(head, size - 8);
        datagrams.emplace_back(payload.begin(), payload.end());
      }
    }
    block += length;
  }
  return datagrams;
}

}  // namespace posed::test
