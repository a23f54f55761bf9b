// Decodes the datagrams of a NatNet server: passes the description of its bodies on, and makes of
// each frame one Frame for each body and one Sample for each body with markers. It also says what
// to ask the server next.
#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/datagram_order.hpp"
#include "drivers/driver.hpp"
#include "drivers/natnet/frame.hpp"
#include "drivers/natnet/layout.hpp"
#include "drivers/natnet/protocol.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/time.hpp"

namespace posed::drivers::natnet {

// The settings of a NatNet decoder, which the device info in Description::text holds.
// The frame in which the server streams the bones of skeletons; kAuto: each skeleton shows it.
enum class Coordinates : std::uint8_t { kAuto, kLocal, kGlobal };

struct Settings {
  Version version;  // unknown: as the server says
  bool z_up = false;
  Coordinates coordinates = Coordinates::kAuto;
  bool unicast = false;
  int rate_hz = 120;  // until the server says it
};

// "natnet version=auto up=y coordinates=auto cast=multi rate=120", and back. Cold.
[[nodiscard]] std::string settings_text(const Settings& settings);
Result<Settings> parse_settings(const std::string& text, const std::string& identity);

// The words of the options.
Result<bool> parse_up(const std::string& word);
Result<Coordinates> parse_coordinates(const std::string& word);

// Requests: what to ask a NatNet server next. It is asked who it is until it answers and again when
// it was silent or its frames do not fit, then less and less often; for its frame rate, for its
// bodies whenever they may have changed, and over unicast it also says every second that somebody
// listens. One datagram per call.
class Requests {
 public:
  // How often next() should be called.
  static constexpr std::int64_t kPeriod_ns = 100'000'000;

  explicit Requests(bool unicast);  // cold

  // Each of these is called when such a packet of the server has come.
  RT_SAFE void received(std::int64_t arrival_ns) noexcept { received_ns_ = arrival_ns; }
  void accept_server_info(const ServerInfo& info) noexcept;
  void accept_rate() noexcept { rate_.wanted = false; }
  void accept_bodies() noexcept { bodies_.wanted = false; }
  void bodies_changed() noexcept { bodies_.wanted = true; }
  // The server may have been replaced by one of another version.
  void does_not_fit() noexcept;
  void fits() noexcept { connect_.pause_ns = kAgain_ns; }
  // The server is still the one whose frames do not fit.
  void has_not_changed() noexcept { connect_.wanted = false; }

  // The datagram to send now; empty: none.
  RT_SAFE [[nodiscard]] std::span<const std::byte> next(std::int64_t now_ns) noexcept;

 private:
  static constexpr std::int64_t kAgain_ns = kNanosPerSecond;
  static constexpr std::int64_t kMaxPause_ns = 32 * kAgain_ns;
  static constexpr std::int64_t kSilence_ns = 2 * kNanosPerSecond;

  struct Question {
    std::vector<std::byte> datagram;
    bool wanted = true;
    std::int64_t next_ns = kNoTime_ns;  // not before
    std::int64_t pause_ns = kAgain_ns;
  };
  // Returns whether it is time to ask, and then not again for a while.
  [[nodiscard]] static bool is_due(Question& question, std::int64_t now_ns) noexcept;

  Question connect_, rate_, bodies_, alive_;
  std::int64_t received_ns_ = kNoTime_ns;
};

// The time of a frame on the server's own clock. It never decreases. From 3.0 the middle of the
// camera's exposure in ticks, if the server has said how many a second it counts; otherwise the
// timestamp. RT-safe.
class DeviceTime {
 public:
  [[nodiscard]] std::int64_t of(const FrameView& frame, std::uint64_t clock_hz) noexcept {
    const bool ticks = frame.exposure_ticks != 0 && clock_hz != 0 && clock_hz <= kMaxClock_hz;
    return ticks ? to(nanoseconds_of(frame.exposure_ticks, clock_hz), clock_hz)
                 : to(nanoseconds_of(frame.timestamp_s), 0);
  }

 private:
  static constexpr std::uint64_t kMaxClock_hz = 4'000'000'000;  // the product below fits 64 bits
  static constexpr std::uint64_t kMaxSeconds = 4'000'000'000;   // 126 years
  // A longer step is none: the server has restarted, or the value is damaged.
  static constexpr std::int64_t kMaxStep_ns = 3600 * kNanosPerSecond;
  static constexpr std::int64_t kLast_ns = INT64_MAX / 2;

  static std::int64_t nanoseconds_of(std::uint64_t ticks, std::uint64_t clock_hz) noexcept {
    const std::uint64_t whole_s = ticks / clock_hz;
    if (whole_s > kMaxSeconds) return kNoTime_ns;
    const std::uint64_t rest_ns = ticks % clock_hz * kNanosPerSecond / clock_hz;
    return static_cast<std::int64_t>(whole_s * kNanosPerSecond + rest_ns);
  }
  static std::int64_t nanoseconds_of(double time_s) noexcept {
    if (!(std::abs(time_s) <= static_cast<double>(kMaxSeconds))) return kNoTime_ns;  // or NaN
    return nanoseconds(time_s);
  }

  // A clock whose origin changes (`base`) goes on from where it was.
  std::int64_t to(std::int64_t device_ns, std::uint64_t base) noexcept {
    if (device_ns == kNoTime_ns) return now_ns_;
    if (now_ns_ == kNoTime_ns) {
      now_ns_ = device_ns;
    } else if (base == base_) {
      const std::int64_t step_ns = device_ns - last_ns_;
      const bool valid = step_ns > 0 && step_ns <= kMaxStep_ns;
      if (valid) now_ns_ = std::min(now_ns_ + step_ns, kLast_ns);
    }
    base_ = base;
    last_ns_ = device_ns;
    return now_ns_;
  }

  std::int64_t now_ns_ = kNoTime_ns;
  std::int64_t last_ns_ = 0;  // as the server counts
  std::uint64_t base_ = 0;    // its clock [Hz]; 0: the timestamp
};

class NatNetDecoder final : public LayoutDecoder<NatNetLayout> {
 public:
  explicit NatNetDecoder(const Settings& settings);

  // Takes one datagram per call, of either socket.
  RT_SAFE void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                    Sink& sink) noexcept override;

  RT_SAFE [[nodiscard]] Request next_request(std::int64_t now_ns) noexcept override {
    return {.bytes = requests_.next(now_ns), .socket = 0};
  }

 private:
  // After so many frames in a row that its reading does not fit, the version was a wrong guess.
  static constexpr int kMaxMisfits = 8;

  [[nodiscard]] Outcome accept(const Message& message, Sink& sink) noexcept;
  [[nodiscard]] Outcome accept_server_info(std::span<const std::byte> payload) noexcept;
  [[nodiscard]] Outcome accept_response(std::span<const std::byte> payload) noexcept;
  [[nodiscard]] Outcome accept_model_def(std::span<const std::byte> payload, Sink& sink) noexcept;
  [[nodiscard]] Outcome accept_frame(std::span<const std::byte> payload, Sink& sink) noexcept;

  // Reads the frame with the reading that fits; false when none does.
  [[nodiscard]] bool read(std::span<const std::byte> payload, FrameView& view) noexcept;
  [[nodiscard]] Outcome accept_bodies(const FrameView& view, Sink& sink) noexcept;
  [[nodiscard]] Outcome accept_rigid_body(ByteReader& reader, Sink& sink) noexcept;
  [[nodiscard]] Outcome accept_skeleton(ByteReader& reader, Sink& sink) noexcept;
  [[nodiscard]] Outcome accept_markers(const FrameView& view, Sink& sink) noexcept;
  // The markers of one body; emits them if there are any.
  [[nodiscard]] Outcome accept_markers_of(std::size_t body, const Entries& labelled,
                                          Sink& sink) noexcept;
  // Emits the body's frame, once for each packet.
  [[nodiscard]] Outcome emit(std::size_t body, Frame& frame, Sink& sink) noexcept;

  const Settings settings_;
  Version version_;  // unknown: not said yet
  Reading reading_;
  bool has_reading_ = false;
  int misfits_ = 0;  // frames since reading_ fitted
  std::uint64_t clock_hz_ = 0;
  float rate_hz_ = 0.0F;
  DeviceTime time_;
  std::int64_t device_ns_ = kNoTime_ns;  // of the frame at hand
  Timecode timecode_{};                  // the same
  DatagramOrder order_{32};
  std::bitset<kMaxBodies> emitted_;  // bodies of the frame at hand so far
  const BodyTable nobody_{};
  Requests requests_;
  std::array<std::byte, 64 * 1024 + kDescriptionHeadBytes> description_{};
};

// The bones of one skeleton as a frame of NatNet lists them, and the Frame that they make. All
// calls are RT-safe.
class SkeletonPose {
 public:
  // `table` outlives the pose.
  explicit SkeletonPose(const BodyTable& table) noexcept : table_(table) {}

  // Adds a bone, whose values are in posed's axes; the bones of a packet mostly come in the order
  // of the table. False when the bone is unknown, came before or has values that make no sense.
  [[nodiscard]] bool add(const RigidBody& bone) noexcept;

  // Whether the description has the bones so far, and as many as these.
  [[nodiscard]] bool is_described(std::size_t bones) const noexcept {
    return !undescribed_ && bones == table_.bone_ids.size();
  }

  // Fills root position, rotations and validity. False when a bone is missing.
  [[nodiscard]] bool fill(Coordinates coordinates, Frame& frame) const noexcept;

 private:
  // Returns whether the positions are relative to the parents: then they are the offsets of the
  // description, however the person moves.
  [[nodiscard]] bool looks_local() const noexcept;

  const BodyTable& table_;
  std::size_t next_ = 0;
  bool undescribed_ = false;
  std::bitset<kMaxJoints> seen_, tracked_;
  std::array<Vec3f, kMaxJoints> position_m_{};
  std::array<Quatf, kMaxJoints> rotation_xyzw_{};
};

}  // namespace posed::drivers::natnet
