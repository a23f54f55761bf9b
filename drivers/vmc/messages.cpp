#include "drivers/vmc/messages.hpp"

#include <algorithm>

#include <oscpack/osc/OscOutboundPacketStream.h>

#include "drivers/vmc/axes.hpp"

namespace posed::drivers::vmc {
namespace {

// "#bundle", and the time that means "immediately".
constexpr std::array<std::byte, 16> kBundleHead{
    std::byte{'#'}, std::byte{'b'}, std::byte{'u'}, std::byte{'n'}, std::byte{'d'}, std::byte{'l'},
    std::byte{'e'}, std::byte{0},   std::byte{0},   std::byte{0},   std::byte{0},   std::byte{0},
    std::byte{0},   std::byte{0},   std::byte{0},   std::byte{1}};
constexpr std::size_t kElementHead = 4;  // the size of an element of a bundle

bool is_usable(std::string_view name) noexcept {
  return !name.empty() && name.size() <= kMaxVmcName && name.find('\0') == std::string_view::npos;
}

// One message, written by oscpack. It throws when its memory is too small: with names of at most
// kMaxVmcName bytes, which is_usable() has checked, the longest message needs half of this.
class VmcMessage {
 public:
  explicit VmcMessage(const char* address) noexcept { stream_ << osc::BeginMessage(address); }
  VmcMessage& text(std::string_view value) noexcept {
    std::array<char, kMaxVmcName + 1> terminated{};
    std::ranges::copy(value, terminated.begin());
    stream_ << terminated.data();
    return *this;
  }
  VmcMessage& number(int value) noexcept {
    stream_ << static_cast<osc::int32>(value);
    return *this;
  }
  VmcMessage& numbers(std::span<const float> values) noexcept {
    for (const float value : values) stream_ << value;
    return *this;
  }
  [[nodiscard]] std::span<const std::byte> finish() noexcept {
    stream_ << osc::EndMessage;
    return std::as_bytes(std::span(stream_.Data(), stream_.Size()));
  }

 private:
  std::array<char, 1024> memory_{};
  osc::OutboundPacketStream stream_{memory_.data(), memory_.size()};
};

}  // namespace

RT_SAFE void DatagramWriter::start() noexcept { count_ = 0; }

RT_SAFE std::span<const std::byte> DatagramWriter::datagram(std::size_t i) const noexcept {
  const std::size_t begin = i == 0 ? 0 : ends_[i - 1];
  return std::span(room_).subspan(begin, ends_[i] - begin);
}

RT_SAFE bool DatagramWriter::root(const Vec3f& position_m, const Quatf& rotation_xyzw) noexcept {
  return transform("/VMC/Ext/Root/Pos", "root", position_m, rotation_xyzw);
}

RT_SAFE bool DatagramWriter::bone(std::size_t bone, const Vec3f& position_m,
                                  const Quatf& rotation_xyzw) noexcept {
  return transform("/VMC/Ext/Bone/Pos", bone_table()[bone].name, position_m, rotation_xyzw);
}

RT_SAFE bool DatagramWriter::device(ValueKind kind, std::string_view serial,
                                    const Vec3f& position_m, const Quatf& rotation_xyzw) noexcept {
  return transform(address_of(kind), serial, position_m, rotation_xyzw);
}

RT_SAFE bool DatagramWriter::transform(const char* address, std::string_view name,
                                       const Vec3f& position_m,
                                       const Quatf& rotation_xyzw) noexcept {
  if (!is_usable(name)) return false;
  return add(VmcMessage(address)
                 .text(name)
                 .numbers(mirrored(position_m))
                 .numbers(mirrored(rotation_xyzw))
                 .finish());
}

RT_SAFE bool DatagramWriter::blend(std::string_view name, float value) noexcept {
  if (!is_usable(name)) return false;
  return add(
      VmcMessage(address_of(ValueKind::kBlend)).text(name).numbers(std::span(&value, 1)).finish());
}

RT_SAFE bool DatagramWriter::apply() noexcept {
  return add(VmcMessage("/VMC/Ext/Blend/Apply").finish());
}

RT_SAFE bool DatagramWriter::status(const Status& status) noexcept {
  return add(VmcMessage("/VMC/Ext/OK")
                 .number(status.loaded ? 1 : 0)
                 .number(status.calibration)
                 .number(status.mode)
                 .number(status.tracking ? 1 : 0)
                 .finish());
}

RT_SAFE bool DatagramWriter::loaded() noexcept {
  return add(VmcMessage("/VMC/Ext/OK").number(1).finish());
}

RT_SAFE bool DatagramWriter::time(float time_s) noexcept {
  return add(VmcMessage("/VMC/Ext/T").numbers(std::span(&time_s, 1)).finish());
}

RT_SAFE bool DatagramWriter::avatar(std::string_view path, std::string_view title) noexcept {
  if (path.size() > kMaxVmcName || title.size() > kMaxVmcName) return false;
  return add(VmcMessage("/VMC/Ext/VRM").text(path).text(title).finish());
}

RT_SAFE bool DatagramWriter::add(std::span<const std::byte> message) noexcept {
  const bool bundled = packing_ != Packing::kMessages;
  const std::size_t most = packing_ == Packing::kOneBundle ? kRoom : kMaxBytes;
  const std::size_t needed = message.size() + (bundled ? kElementHead : 0);
  const bool goes_on = bundled && count_ > 0 && datagram(count_ - 1).size() + needed <= most;
  const std::size_t head = bundled && !goes_on ? kBundleHead.size() : 0;
  if (size() + head + needed > kRoom) return false;
  if (!goes_on) {
    if (count_ == kMaxDatagrams) return false;
    ends_[count_] = size();
    ++count_;
    put(std::span(kBundleHead).first(head));
  }
  if (bundled) {
    const auto length = static_cast<std::uint32_t>(message.size());
    std::array<std::byte, kElementHead> big_endian{};
    for (std::size_t i = 0; i < kElementHead; ++i) {
      big_endian[i] = static_cast<std::byte>(length >> (24 - 8 * i) & 0xFF);
    }
    put(big_endian);
  }
  put(message);
  return true;
}

RT_SAFE void DatagramWriter::put(std::span<const std::byte> bytes) noexcept {
  std::ranges::copy(bytes, room_.begin() + static_cast<std::ptrdiff_t>(size()));
  ends_[count_ - 1] += bytes.size();
}

}  // namespace posed::drivers::vmc
