// Writes the messages of the VMC protocol, packed into datagrams: the sending side, for the
// emulator and for outputs. Poses are given in posed's axes. RT-safe: it has memory of its own for
// one frame and allocates nothing. One thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "drivers/vmc/protocol.hpp"
#include "proto/frame/frame.hpp"

namespace posed::drivers::vmc {

enum class Packing : std::uint8_t {
  kOneBundle,  // the whole frame in one datagram, which the network may have to cut
  kBundles,    // bundles that fit a network packet of 1,500 bytes
  kMessages    // each message in a datagram of its own
};

// /VMC/Ext/OK
struct Status {
  bool loaded = true;
  int calibration = 3;  // 0 not calibrated, 1 waiting, 2 calibrating, 3 done
  int mode = 0;         // 0 normal, 1 mixed reality, 2 mixed reality with floor correction
  bool tracking = true;
};

class DatagramWriter {
 public:
  // The size of a bundle of kBundles: with the heads of IPv4 and UDP it has 1,500 bytes.
  static constexpr std::size_t kMaxBytes = 1472;

  explicit DatagramWriter(Packing packing) noexcept : packing_(packing) {}

  void start() noexcept;  // begins a new frame, without datagrams

  // Each adds a message, or returns false and adds nothing: if a name is empty (one of avatar() may
  // be) or longer than kMaxVmcName, or if the frame's memory is full. A frame of all bones with 64
  // values has room. `bone` is an index in bone_table().
  bool root(const Vec3f& position_m, const Quatf& rotation_xyzw) noexcept;
  bool bone(std::size_t bone, const Vec3f& position_m, const Quatf& rotation_xyzw) noexcept;
  bool device(ValueKind kind, std::string_view serial, const Vec3f& position_m,
              const Quatf& rotation_xyzw) noexcept;
  bool blend(std::string_view name, float value) noexcept;
  bool apply() noexcept;  // ends the blend shapes of a frame
  bool status(const Status& status) noexcept;
  bool loaded() noexcept;  // /VMC/Ext/OK in its oldest form, which every receiver knows
  bool time(float time_s) noexcept;
  bool avatar(std::string_view path, std::string_view title) noexcept;

  // The datagrams of the frame so far, valid until start(); another message may lengthen the last.
  [[nodiscard]] std::size_t datagrams() const noexcept { return count_; }
  [[nodiscard]] std::span<const std::byte> datagram(std::size_t i) const noexcept;

 private:
  static constexpr std::size_t kRoom = 24 * 1024;
  static constexpr std::size_t kMaxDatagrams = 256;

  bool transform(const char* address, std::string_view name, const Vec3f& position_m,
                 const Quatf& rotation_xyzw) noexcept;
  bool add(std::span<const std::byte> message) noexcept;
  [[nodiscard]] std::size_t size() const noexcept { return count_ == 0 ? 0 : ends_[count_ - 1]; }
  void put(std::span<const std::byte> bytes) noexcept;

  Packing packing_;
  std::size_t count_ = 0;
  std::array<std::size_t, kMaxDatagrams> ends_{};  // of each datagram, in room_
  std::array<std::byte, kRoom> room_{};
};

}  // namespace posed::drivers::vmc
