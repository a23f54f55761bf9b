#include "daemon/pipeline/description_row.hpp"

#include <algorithm>
#include <cstring>

#include "proto/frame/sink.hpp"

namespace posed::pipeline {
namespace {

template <typename T>
T get(std::span<const std::byte> bytes) {
  T value;
  std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

}  // namespace

std::vector<std::byte> pack_description(std::span<const std::uint32_t> streams,
                                        std::span<const std::byte> description) {
  const auto count = static_cast<std::uint16_t>(streams.size());
  std::vector<std::byte> row(sizeof count + streams.size_bytes() + description.size());
  std::memcpy(row.data(), &count, sizeof count);
  std::ranges::copy(std::as_bytes(streams), row.begin() + sizeof count);
  std::ranges::copy(description, row.end() - static_cast<std::ptrdiff_t>(description.size()));
  return row;
}

std::optional<DescriptionRow> unpack_description(std::span<const std::byte> row) {
  if (row.size() < sizeof(std::uint16_t)) return std::nullopt;
  const std::size_t count = get<std::uint16_t>(row);
  row = row.subspan(sizeof(std::uint16_t));
  if (count > kMaxBodies || row.size() < count * sizeof(std::uint32_t)) return std::nullopt;
  DescriptionRow unpacked;
  for (std::size_t i = 0; i < count; ++i) {
    unpacked.streams.push_back(get<std::uint32_t>(row));
    row = row.subspan(sizeof(std::uint32_t));
  }
  unpacked.description = row;
  return unpacked;
}

}  // namespace posed::pipeline
