// The contract between posed and a device. A driver is passive: the daemon owns every thread. It
// splits in two: a Transport that hands over raw chunks, and a Decoder that turns chunks into
// frames. A log of the chunks therefore replays through the very decoder that ran live.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "drivers/emulator.hpp"
#include "drivers/glove/model.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/sink.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::drivers {

class TransportFactory;  // drivers/transport/transport_factory.hpp

inline constexpr std::size_t kMaxChunk =
    64 * 1024;  // bytes; a longer one is an error of the transport

// What one read gave.
struct Chunk {
  std::span<const std::byte> bytes;  // valid until the next read; empty when nothing was due
  bool end = false;   // comes alone, after the last bytes: the source will never give more
  bool lost = false;  // comes alone: the link is broken; the device may come back on a new one
};

// Where bytes come from. One reader thread uses it after open().
class Transport {
 public:
  Transport() = default;
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;
  virtual ~Transport() = default;

  // Readable when a chunk may be due; the daemon polls it. Valid from open() to destruction. -1 for
  // a source that goes by time alone.
  [[nodiscard]] virtual int poll_fd() const noexcept = 0;

  // Host time of the next chunk of a source that goes by time (files, replay); kNoTime_ns for one
  // that its descriptor announces. RT-safe.
  [[nodiscard]] virtual std::int64_t next_due_ns() const noexcept { return kNoTime_ns; }

  // Whether the source would rather wait than lose frames (a file played as fast as possible): it
  // is read only when the pipeline has caught up.
  [[nodiscard]] virtual bool lossless() const noexcept { return false; }

  // Chunks a second to be expected of a source that goes by time; 0 where only the device knows.
  [[nodiscard]] virtual double rate_hz() const noexcept { return 0.0; }

  // Starts the source (a file's clock begins to run). Cold.
  [[nodiscard]] virtual Result<> start(std::int64_t now_ns) = 0;

  // The next chunk, at most one; call again until it is empty. Never blocks. RT-safe but for its
  // read.
  [[nodiscard]] virtual Chunk read(std::int64_t now_ns) noexcept = 0;

  // Sends bytes to the device, all or none; false when the link does not take them now. RT-safe but
  // for its write.
  [[nodiscard]] virtual bool send(std::span<const std::byte> /*bytes*/) noexcept { return false; }
};

// Bytes to frames. Pure: no clock, no I/O, no allocation after construction.
class Decoder {
 public:
  Decoder() = default;
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;
  virtual ~Decoder() = default;

  // Bytes in any cut; `arrival_ns` is the time of the read. Whatever the bytes are, it neither
  // crashes nor hangs, and counts what it cannot use. RT-safe.
  virtual void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                    Sink& sink) noexcept = 0;

  // Uses this calibration from the next packet on; it must outlive its use. Without a call the
  // device's default holds; what is no glove has nothing to calibrate. RT-safe.
  virtual void calibrate(const glove::Calibration& /*calibration*/) noexcept {}
};

// Names and units of a device's sample values.
struct SampleLayout {
  std::vector<std::string> names;
  std::vector<std::string> units;  // "rad", "1", "m"
};

// Everything a device says about itself before it streams; stored in the log, enough to decode it
// again.
struct Description {
  std::string driver;    // registry name
  std::string text;      // the device's own header (a BVH's HIERARCHY), decoder's input
  std::string identity;  // stable name of the device: path, serial number
  std::shared_ptr<const Skeleton> skeleton;  // null for a device that emits samples only
  SampleLayout samples;
  double rate_hz = 0.0;  // nominal; 0 when unknown
};

// What is sent to a device that answers instead of streaming.
struct Poll {
  std::vector<std::byte> request;  // empty: the device streams by itself
  std::int64_t period_ns = 0;
};

// One opened device.
struct Device {
  Description description;
  std::unique_ptr<Transport> transport;
  std::unique_ptr<Decoder> decoder;
  std::vector<std::string> warnings;  // one sentence each, for the user: opened, but look at this
  Poll poll{};
  double reopen_after_s = 0.0;  // silence after which the link is opened anew; 0: never
};

// What a glove with motors is told: a control message, in units of the hand.
struct Haptics {
  std::array<float, kFingers> force{};  // thumb to little: 0 free, 1 blocked, negative unchanged
  float vibration_hz = 0.0F;
  float vibration_s = 0.0F;  // 0: no vibration
  float vibration = 0.0F;    // amplitude, 0 to 1
};

// The options a driver takes from its [stream.<driver>] table; config/ checks them against this
// list.
using OptionValue = std::variant<bool, std::int64_t, double, std::string>;
using Options = std::map<std::string, OptionValue>;
struct OptionSpec {
  std::string_view name;
  OptionValue default_value;  // also fixes the type
  bool required = false;
  bool is_path = false;  // relative to the config file
  std::string_view help;
};

// One line of the registry.
struct Driver {
  std::string_view name;
  std::string_view summary;
  std::vector<OptionSpec> options;
  // Finds the device, speaks with it and starts it; may take a few seconds. Files open at once.
  Result<Device> (*open)(const Options& options, TransportFactory& ports);
  // The decoder alone, from what a log kept of the description's text; replay uses it.
  Result<std::unique_ptr<Decoder>> (*make_decoder)(const Description& description);
  // Skeleton, samples and rate again from driver + text + identity.
  Result<Description> (*describe)(const std::string& text, const std::string& identity);
  // For a device that may come later: its description as the options promise it. What open() finds
  // has the same skeleton and samples. Null: the device must be there from the start.
  Result<Description> (*expect)(const Options& options) = nullptr;
  // The sensors of a glove and what they mean before calibration; null for what is no glove.
  Result<glove::Model> (*glove_model)(const Description& description) = nullptr;
  // The bytes for the device; null for one that cannot be felt.
  Result<std::vector<std::byte>> (*encode_haptics)(const Options& options,
                                                   const Haptics& haptics) = nullptr;
  // The device's other side, for tests, `posed emulate` and the demo; null where there is none.
  Result<std::unique_ptr<Emulator>> (*emulate)(const Options& options) = nullptr;
};

[[nodiscard]] std::span<const Driver> registry();                // the one list
[[nodiscard]] const Driver* find_driver(std::string_view name);  // null when unknown

}  // namespace posed::drivers
