// The contract between posed and a device. A driver starts no threads, except where a library must
// not run in the reader (transport/subscription): the daemon owns all others. It has two parts: a
// Transport that delivers raw chunks of bytes, and a Decoder that turns chunks into frames. So a
// log of the chunks replays through the same decoder that ran live.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/emulator.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/sink.hpp"
#include "proto/frame/skeleton.hpp"
#include "proto/text/parameter.hpp"

namespace posed::drivers {

class TransportFactory;  // drivers/transport/transport_factory.hpp

namespace glove {
class CalibratedDecoder;  // drivers/glove/calibrated_decoder.hpp
struct GloveTraits;       // drivers/glove/traits.hpp
}  // namespace glove

inline constexpr std::size_t kMaxChunk = 64 * 1024;  // bytes; a Transport never gives more

// The result of one read.
struct Chunk {
  std::span<const std::byte> bytes;  // valid until the next read; empty when nothing was available
  bool end = false;   // delivered alone after the last bytes: the source has ended for good
  bool lost = false;  // delivered alone: the connection is lost; the device may return on a new one
  std::uint8_t socket = 0;  // where the bytes came from, for a device with several sockets
  // Host time at which the kernel received the bytes; kNoTime_ns: the time after the read counts.
  std::int64_t arrival_ns = kNoTime_ns;
  // Who sent the bytes, as a number that tells apart the senders of datagrams, or the links that
  // one device after the other makes; 0: nobody else could have.
  std::uint64_t sender = 0;
  // Set in `sender` of a link, whose bytes go on where its last ones ended.
  static constexpr std::uint64_t kLink = std::uint64_t{1} << 63;
  [[nodiscard]] bool is_part_of_link() const noexcept { return (sender & kLink) != 0; }
  // Datagrams dropped since the last chunk, counted also beside empty bytes: from senders that are
  // not among the peers, and empty or too long ones.
  std::uint32_t foreign = 0;
  std::uint32_t damaged = 0;
  // Datagrams that were dropped because nobody read in time: by the kernel, whose buffer was full
  // and which reports them with the next datagram that it keeps, and by the transport, because they
  // had waited for more than a second.
  std::uint32_t kernel_dropped = 0;
};

// The source of bytes. After open(), one reader thread uses it.
class Transport {
 public:
  Transport() = default;
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;
  virtual ~Transport() = default;

  // Readable when a chunk may be available; the daemon polls it. Valid from open() to destruction.
  // -1 for a source driven by time only.
  [[nodiscard]] virtual int poll_fd() const noexcept = 0;

  // Host time of the next chunk of a source driven by time (files, replay), and of one that was
  // received but not yet read; kNoTime_ns when only the descriptor announces chunks.
  RT_SAFE [[nodiscard]] virtual std::int64_t next_due_ns() const noexcept { return kNoTime_ns; }

  // True when the source must not lose frames and may wait instead (a file played as fast as
  // possible): it is read only when the pipeline has caught up.
  [[nodiscard]] virtual bool lossless() const noexcept { return false; }

  // True for bound sockets, which say nothing about the other side until it sends.
  [[nodiscard]] virtual bool only_listens() const noexcept { return false; }

  // Expected chunks per second of a source driven by time; 0 when only the device knows.
  [[nodiscard]] virtual double rate_hz() const noexcept { return 0.0; }

  // Starts the source (the clock of a file begins to run). Cold.
  virtual Result<> start(std::int64_t now_ns) = 0;

  // The next chunk, at most one; call again until it is empty. Never blocks. RT-safe except for its
  // read.
  [[nodiscard]] virtual Chunk read(std::int64_t now_ns) noexcept = 0;

  // Is told whether the decoder had a use for the bytes of the last chunk.
  RT_SAFE virtual void decoded(bool /*used*/) noexcept {}

  // Sends bytes to the device, all or none; returns false when the link does not accept them now.
  // RT-safe except for its write.
  [[nodiscard]] virtual bool send(std::span<const std::byte> /*bytes*/,
                                  std::uint8_t /*socket*/) noexcept {
    return false;
  }
  // Is told that the bytes of the last chunk, which was part of a link, are lost: the link must
  // end.
  RT_SAFE virtual void refuse() noexcept {}
  [[nodiscard]] bool send(std::span<const std::byte> bytes) noexcept { return send(bytes, 0); }
};

// Names and units of the sample values of a device or body.
struct SampleLayout {
  std::vector<std::string> names;
  std::vector<std::string> units;  // "rad", "1", "m"
};

// One of the bodies that a source delivers.
struct Body {
  std::string name;                          // as the device calls it
  std::shared_ptr<const Skeleton> skeleton;  // null for a body with samples only
  SampleLayout samples{};
  double rate_hz = 0.0;     // nominal; 0 when unknown
  std::string remark{};     // what people should know about it, for the log; may be empty
  std::int32_t number = 0;  // by which the device's programs know it; 0: none
};

// The bodies of a source, compiled from the device's description. A driver derives from it to add
// the tables that its decoder needs. Immutable once built: threads share it.
class SourceLayout {
 public:
  SourceLayout() = default;
  SourceLayout(const SourceLayout&) = delete;
  SourceLayout& operator=(const SourceLayout&) = delete;
  virtual ~SourceLayout() = default;

  std::vector<Body> bodies;  // [body of Sink::frame], at most kMaxBodies
};

// Bytes for the device.
struct Request {
  std::span<const std::byte> bytes{};
  std::uint8_t socket = 0;  // where it goes, for a device with several sockets
};

// Turns bytes into frames. Pure: no clock, no I/O, no allocation after construction.
class Decoder {
 public:
  Decoder() = default;
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;
  virtual ~Decoder() = default;

  // Decodes bytes, which may be cut at any position; `arrival_ns` is the time of the read. The
  // bytes are untrusted: for any input it neither crashes nor hangs, and it counts what it cannot
  // use.
  RT_SAFE virtual void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                            Sink& sink) noexcept = 0;

  // Decodes one chunk of a device with several sockets, as feed() does.
  RT_SAFE virtual void feed_socket(std::uint8_t /*socket*/, std::span<const std::byte> bytes,
                                   std::int64_t arrival_ns, Sink& sink) noexcept {
    feed(bytes, arrival_ns, sink);
  }

  // Decodes the bodies of this layout from the next packet on. The layout comes from the same
  // driver's make_layout and outlives its use. A device with one body ignores the call.
  RT_SAFE virtual void use(const SourceLayout& /*layout*/) noexcept {}

  // Returns the request to send now, for a device whose Poll has no fixed one; empty: none.
  // The bytes are valid until the next call. It may depend on what was fed before, but feed() may
  // not depend on it: a replay does not call it.
  RT_SAFE [[nodiscard]] virtual Request next_request(std::int64_t /*now_ns*/) noexcept {
    return {};
  }
};

// A decoder whose driver's make_layout makes an `L`.
template <typename L>
class LayoutDecoder : public Decoder {
 public:
  RT_SAFE void use(const SourceLayout& layout) noexcept override {
    layout_ = static_cast<const L*>(&layout);
  }

 protected:
  const L* layout_ = nullptr;  // null until the first description is in use
};

// The knowledge about a device before it streams. It is stored in the log; enough to decode its
// bytes again.
struct Description {
  std::string driver;  // registry name
  // Device info: the device's own header (a BVH's HIERARCHY); input of the decoder.
  std::string text;
  // Stable name of the device: path, serial number, address. One that listens on port 0 has another
  // at each opening.
  std::string identity;
  // Null for a device that emits samples only, and for one with several bodies
  // (Driver::make_layout).
  std::shared_ptr<const Skeleton> skeleton;
  SampleLayout samples;
  double rate_hz = 0.0;  // nominal; 0 when unknown
};

// The request for a device that answers instead of streaming.
struct Poll {
  std::vector<std::byte> request;  // empty: the decoder says what to ask (Decoder::next_request)
  std::int64_t period_ns = 0;      // 0: the device streams on its own
  std::uint8_t socket = 0;         // where it goes, for a device with several sockets
};

// One opened device.
struct Device {
  Description description;
  std::unique_ptr<Transport> transport;
  std::unique_ptr<Decoder> decoder;
  // One sentence each for the user: the device is open, but something needs attention.
  std::vector<std::string> warnings;
  Poll poll{};
  double reopen_after_s = 0.0;  // seconds of silence after which the link is reopened; 0: never
  glove::CalibratedDecoder* calibrated = nullptr;  // the decoder, if it is a glove's
};

// The options that a driver accepts in its [stream.<driver>] table; the daemon's config reader
// checks a config against this list.
using OptionValue = ParameterValue;
using Options = Parameters;
using OptionSpec = ParameterSpec;

// One entry of the registry.
struct Driver {
  std::string_view name;
  std::string_view summary;
  std::vector<OptionSpec> options;
  // Finds the device, talks to it and starts it; may take a few seconds. Files open at once.
  Result<Device> (*open)(const Options& options, TransportFactory& ports);
  // Makes only the decoder, from the description's text stored in a log; used by replay.
  Result<std::unique_ptr<Decoder>> (*make_decoder)(const Description& description);
  // Rebuilds skeleton, samples and rate from driver + text + identity.
  Result<Description> (*describe)(const std::string& text, const std::string& identity);
  // For a device that may be connected later: its description according to the options. The device
  // found by open() has the same skeleton and samples. Null: the device must be present at start.
  Result<Description> (*expect)(const Options& options) = nullptr;
  // Compiles the bytes of Sink::description, which are untrusted. Null: the device has one body,
  // described above. Cold.
  Result<std::unique_ptr<SourceLayout>> (*make_layout)(std::span<const std::byte> description) =
      nullptr;
  // What comes may long hold no pose, as pictures without a hand.
  bool often_empty = false;
  // The functions that only gloves have; null for other devices.
  const glove::GloveTraits* glove = nullptr;
  // Emulates the device, for tests, `posed emulate` and the demo; null when there is no emulator.
  Result<std::unique_ptr<Emulator>> (*emulate)(const Options& options) = nullptr;
};

[[nodiscard]] std::span<const Driver> registry();                // the list of all drivers
[[nodiscard]] const Driver* find_driver(std::string_view name);  // null when unknown

}  // namespace posed::drivers
