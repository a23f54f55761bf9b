#include "drivers/vmc/osc.hpp"

#include <algorithm>

namespace posed::drivers::vmc {
namespace {

constexpr std::string_view kOscBundle{"#bundle\0", 8};  // with its zero

std::size_t padded(std::size_t bytes) noexcept { return (bytes + 3) / 4 * 4; }

// The text up to its zero; false when there is none, or when the padding is cut or is not zeros.
RT_SAFE bool read_text(BigEndianReader& reader, std::span<const std::byte>& rest,
                       std::string_view& text) noexcept {
  const auto end = std::ranges::find(rest, std::byte{0});
  const std::size_t length = end - rest.begin();
  if (end == rest.end() || padded(length + 1) > rest.size()) return false;
  text = reader.text(padded(length + 1));
  rest = rest.subspan(padded(length + 1));
  const bool zeros = text.find_first_not_of('\0', length) == std::string_view::npos;
  text = text.substr(0, length);
  return zeros;
}

// True when the arguments hold what the types say.
RT_SAFE bool holds(std::span<const std::byte> arguments, std::string_view types) noexcept {
  BigEndianReader reader(arguments);
  int open_arrays = 0;
  for (const char type : types) {
    switch (type) {
      case 'i':
      case 'f':
      case 'c':
      case 'r':
      case 'm':
        (void)reader.bytes(4);
        break;
      case 'h':
      case 'd':
      case 't':
        (void)reader.bytes(8);
        break;
      case 's':
      case 'S': {
        auto rest = arguments.last(reader.left());
        std::string_view text;
        if (!read_text(reader, rest, text)) return false;
        break;
      }
      case 'b': {
        const std::size_t size = reader.u32();
        if (size > reader.left()) return false;
        (void)reader.bytes(padded(size));
        break;
      }
      case 'T':
      case 'F':
      case 'N':
      case 'I':
        break;
      case '[':
        ++open_arrays;
        break;
      case ']':
        if (--open_arrays < 0) return false;
        break;
      default:
        return false;
    }
    if (!reader.ok()) return false;
  }
  return open_arrays == 0;
}

// A message in a bundle may hold anything: its size says where the next one begins.
RT_SAFE bool is_valid_packet(std::span<const std::byte> packet, int depth) noexcept {
  if (packet.empty() || packet.size() % 4 != 0) return false;
  if (!is_bundle(packet)) {
    OscMessage message;
    return depth > 0 || read_message(packet, message);
  }
  if (depth >= kMaxBundleDepth || packet.size() < kBundleHeadBytes) return false;
  BigEndianReader reader(packet.subspan(kBundleHeadBytes));
  while (reader.left() != 0) {
    const std::size_t size = reader.u32();
    if (!reader.ok() || size > reader.left()) return false;
    if (!is_valid_packet(reader.bytes(size), depth + 1)) return false;
  }
  return true;
}

}  // namespace

RT_SAFE double OscArguments::number() noexcept {
  switch (next()) {
    case 'f':
      return static_cast<double>(reader_.f32());
    case 'd':
      return reader_.f64();
    case 'i':
      return static_cast<double>(reader_.i32());
    case 'h':
      return static_cast<double>(static_cast<std::int64_t>(reader_.u64()));
    case 'T':
      return 1.0;
    case 'F':
      return 0.0;
    default:
      ok_ = false;
      return 0.0;
  }
}

RT_SAFE std::string_view OscArguments::text() noexcept {
  if (next() != 's') {
    ok_ = false;
    return {};
  }
  BigEndianReader ahead = reader_;
  const std::string_view all = ahead.text(reader_.left());
  const std::string_view text = all.substr(0, all.find('\0'));
  (void)reader_.bytes(padded(text.size() + 1));
  return text;
}

RT_SAFE bool is_bundle(std::span<const std::byte> packet) noexcept {
  return BigEndianReader(packet).text(kOscBundle.size()) == kOscBundle;
}

RT_SAFE bool read_message(std::span<const std::byte> bytes, OscMessage& message) noexcept {
  BigEndianReader reader(bytes);
  if (!read_text(reader, bytes, message.address) || !message.address.starts_with('/')) return false;
  message.types = {};
  message.arguments = {};
  if (bytes.empty()) return true;
  if (!read_text(reader, bytes, message.types) || !message.types.starts_with(',')) return false;
  message.types.remove_prefix(1);
  message.arguments = bytes;
  return holds(message.arguments, message.types);
}

RT_SAFE Outcome check_packet(std::span<const std::byte> packet) noexcept {
  const bool is_message = !packet.empty() && packet.front() == std::byte{'/'};
  if (!is_message && !is_bundle(packet)) return Outcome::kForeign;
  return is_valid_packet(packet, 0) ? Outcome::kOk : Outcome::kShort;
}

}  // namespace posed::drivers::vmc
