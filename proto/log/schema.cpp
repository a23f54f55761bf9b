#include "proto/log/schema.hpp"

#include <cstdint>

namespace posed::log {
namespace {

constexpr std::size_t kPlaceBytes = 4 + 8 + 8;

template <typename Int>
void put(Int value, std::vector<std::byte>& out) {
  for (std::size_t i = 0; i < sizeof(Int); ++i) {
    out.push_back(static_cast<std::byte>(value >> (8 * i)));
  }
}

template <typename Int>
Int next(std::span<const std::byte>& bytes) {
  Int value = 0;
  for (std::size_t i = 0; i < sizeof(Int); ++i) value |= static_cast<Int>(bytes[i]) << (8 * i);
  bytes = bytes.subspan(sizeof(Int));
  return value;
}

}  // namespace

void pack_positions(std::span<const StreamPosition> places, std::vector<std::byte>& out) {
  out.clear();
  for (const StreamPosition& place : places) {
    put(place.stream, out);
    put(place.next_frame, out);
    put(place.next_sample, out);
  }
}

bool unpack_positions(std::span<const std::byte> bytes, std::vector<StreamPosition>& out) {
  out.clear();
  if (bytes.size() % kPlaceBytes != 0) return false;
  while (!bytes.empty()) {
    StreamPosition place;
    place.stream = next<std::uint32_t>(bytes);
    place.next_frame = next<std::uint64_t>(bytes);
    place.next_sample = next<std::uint64_t>(bytes);
    out.push_back(place);
  }
  return true;
}

}  // namespace posed::log
