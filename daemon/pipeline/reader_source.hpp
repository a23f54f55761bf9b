// Reader::Source: one stream of the reader. Private to reader.cpp. RT-safe throughout, except for
// the reads, writes and wake-ups that are marked as allowed.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <string_view>

#include "daemon/pipeline/intake.hpp"
#include "daemon/pipeline/reader.hpp"
#include "daemon/system/hot_mark.hpp"
#include "drivers/glove/calibrated_decoder.hpp"
#include "posed/v1/posed.pb.h"

namespace posed::pipeline {

// One stream: its device, if one is connected, and the handling of what the device sends.
class Reader::Source final : private IntakeOut {
  // The most that one source may deliver in one turn; the rest waits for the next turn. A source
  // that always has data then costs each of the others only a fraction of a millisecond. No real
  // device comes near the limit: USB full speed is 64 bytes a millisecond, a serial line 11.5 KB a
  // second.
  static constexpr int kChunksATurn = 64;
  static constexpr std::size_t kBytesATurn = 4096;
  // Frames of a lossless source on their way through the pipeline; below what the pipeline sheds.
  static constexpr std::uint64_t kFramesUnderWay = 2;

 public:
  Source(std::uint32_t stream, const ReadStream& read, const ReaderPorts& ports,
         system::Poller& poller, std::uint64_t& next_item)
      : read_(read),
        counters_(*read.counters),
        ports_(ports),
        poller_(poller),
        stream_(stream),
        device_(read.device),
        calibration_(read.calibration),
        share_(read.slots, counters_.pipeline.taken),
        half_(read.slots - read.slots / 2, counters_.pipeline.taken),
        intake_(stream, next_item, *this) {}

  [[nodiscard]] bool ended() const noexcept { return ended_; }

  // Whether a chunk may be read now: always while a device is connected, except that a lossless
  // source waits while its earlier frames are still in the pipeline.
  [[nodiscard]] bool may_read() const noexcept {
    if (device_ == nullptr || ended_) return false;
    return !device_->transport->lossless() ||
           counters_.reader.frames.load(std::memory_order_relaxed) -
                   counters_.pipeline.consumed.load(std::memory_order_acquire) <
               kFramesUnderWay;
  }

  // When the source must be read although its descriptor is not ready; kNoTime_ns: never.
  [[nodiscard]] std::int64_t due_ns() const noexcept {
    if (device_ == nullptr || ended_) return kNoTime_ns;
    const std::int64_t next_ns = device_->transport->next_due_ns();
    if (poll_due_ns_ == kNoTime_ns || next_ns == kNoTime_ns) return std::max(poll_due_ns_, next_ns);
    return std::min(poll_due_ns_, next_ns);
  }
  [[nodiscard]] bool must_wait() const noexcept { return device_ != nullptr && !may_read(); }

  // Before the first read: records the first device's info and calibration.
  void begin() noexcept {
    arrived(ports_.clock());
    if (calibration_ != nullptr) record_calibration();
    counters_.reader.link_ns.store(ports_.clock(), std::memory_order_relaxed);
    if (device_ != nullptr) use(*device_);
  }

  void calibrate(const DeviceCommand& command) noexcept {
    calibration_ = command.calibration;
    record_calibration();
    if (device_ != nullptr) use_calibration(*device_);
    static_cast<void>(report(v1::Event::KIND_CALIBRATED, command.ticket, calibration_->name));
  }

  void send(std::span<const std::byte> bytes) noexcept {
    if (device_ == nullptr) return;
    const system::AllowedCall the_write;
    if (!device_->transport->send(bytes)) return;
    record_sink(pipeline::Direction::kToDevice, bytes);
  }

  // Takes a new device from the slot, and returns the current one if the supervisor asks for it.
  void exchange() noexcept {
    if (read_.slot == nullptr) return;
    if (device_ != nullptr && read_.slot->give_back.exchange(false)) give_back();
    static_cast<void>(read_.slot->in.consume([this](drivers::Device* device) noexcept {
      device_ = device;
      intake_.new_link();
      arrived(ports_.clock());
      record_sink(pipeline::Direction::kDeviceInfo,
                  std::as_bytes(std::span(device->description.text)));
      use(*device);
    }));
  }

  void serve() noexcept {
    if (device_ == nullptr) return;
    poll();
    std::size_t bytes = 0;
    for (int i = 0; i < kChunksATurn && bytes < kBytesATurn && may_read(); ++i) {
      const std::size_t got = read_one();
      if (got == 0) break;
      bytes += got;
    }
    if (ended_ && device_ != nullptr && device_->transport->poll_fd() >= 0) {
      poller_.remove(device_->transport->poll_fd());
    }
  }

  // IntakeOut: counts the item and puts it into the ring.
  bool item(Item& item) noexcept override {
    switch (item.kind) {
      case Item::Kind::kSample:
        counters_.reader.samples.store(item.sample.header.sequence, std::memory_order_relaxed);
        break;
      case Item::Kind::kEvent:
        return push_event(item);
      default:
        item.frame.stamps.decoded_ns = ports_.clock();
        counters_.reader.frames.store(item.frame.header.sequence, std::memory_order_relaxed);
    }
    counters_.reader.heard_ns.store(arrival_ns_, std::memory_order_relaxed);
    if (!push(item)) {
      count(counters_.reader.dropped);
      return false;
    }
    return true;
  }

  void outcome(Outcome outcome) noexcept override {
    count(counters_.reader.outcome[static_cast<std::size_t>(outcome)]);
  }

 private:
  // Reads and decodes one chunk; returns its length in bytes, 0 when none was due.
  std::size_t read_one() noexcept {
    const drivers::Chunk chunk = read();
    arrived(chunk.arrival_ns != kNoTime_ns ? chunk.arrival_ns : ports_.clock());
    count(counters_.reader.outcome[static_cast<std::size_t>(Outcome::kForeign)], chunk.foreign);
    count(counters_.reader.outcome[static_cast<std::size_t>(Outcome::kShort)], chunk.damaged);
    if (!chunk.bytes.empty()) {
      record_sink(pipeline::Direction::kFromDevice, chunk.bytes, chunk.socket);
      device_->decoder->feed_socket(chunk.socket, chunk.bytes, arrival_ns_, intake_);
    }
    if (chunk.end) end();
    if (chunk.lost) give_back();
    return chunk.bytes.size();
  }

  // A source without a descriptor is driven by time alone, so it needs no system call.
  drivers::Chunk read() noexcept {
    drivers::Transport& transport = *device_->transport;
    if (transport.poll_fd() < 0) return transport.read(ports_.clock());
    const system::AllowedCall the_read;
    return transport.read(ports_.clock());
  }

  // A device that is polled gets its requests at its own rate. A late request does not delay the
  // ones after it.
  void poll() noexcept {
    if (poll_due_ns_ == kNoTime_ns) return;
    const std::int64_t now_ns = ports_.clock();
    if (now_ns < poll_due_ns_) return;
    send(device_->poll.request);
    poll_due_ns_ += device_->poll.period_ns;
    if (poll_due_ns_ < now_ns) poll_due_ns_ = now_ns + device_->poll.period_ns;
  }

  void use_calibration(drivers::Device& device) noexcept {
    if (device.calibrated != nullptr) device.calibrated->calibrate(*calibration_->calibration);
  }

  void use(drivers::Device& device) noexcept {
    if (calibration_ != nullptr) use_calibration(device);
    poll_due_ns_ = device.poll.request.empty() ? kNoTime_ns : ports_.clock();
    const std::int64_t now_ns = ports_.clock();
    counters_.reader.heard_ns.store(now_ns, std::memory_order_relaxed);
    counters_.reader.link_ns.store(now_ns, std::memory_order_relaxed);
    counters_.reader.connected.store(true, std::memory_order_release);
    count(counters_.reader.connections);
    if (device.transport->poll_fd() < 0) return;
    const system::AllowedCall the_call;  // once for each connection, before any data flows
    static_cast<void>(poller_.add(device.transport->poll_fd(), stream_));
  }

  // If a device without a supervisor is lost, its stream has ended.
  void give_back() noexcept {
    if (read_.slot == nullptr) return end();
    if (device_->transport->poll_fd() >= 0) {
      const system::AllowedCall the_call;
      poller_.remove(device_->transport->poll_fd());
    }
    poll_due_ns_ = kNoTime_ns;
    counters_.reader.link_ns.store(ports_.clock(), std::memory_order_relaxed);
    counters_.reader.connected.store(false, std::memory_order_release);
    // never full: the slot has more entries than there are devices
    static_cast<void>(read_.slot->out.push(device_));
    device_ = nullptr;
    const system::AllowedCall the_wake;
    read_.slot->supervisor->notify();
  }

  // The end event must not be lost: if the ring is full it is tried again at the next read.
  void end() noexcept { ended_ = report(v1::Event::KIND_ENDED, 0); }

  bool report(v1::Event::Kind event, std::uint64_t ticket, std::string_view name = {}) noexcept {
    return intake_.report(static_cast<std::uint8_t>(event), ticket, name);
  }

  // Once its share of the ring is full, a stream may add nothing until half of the share is free. A
  // device that floods then loses long runs of frames instead of every other one, and each run is a
  // single decision in the log.
  bool share_is_open() noexcept {
    if (!share_.has_room()) open_ = false;
    if (!open_) open_ = half_.has_room();
    return open_;
  }

  // Puts the item into the ring and counts it against the stream's share.
  bool put(const Item& item) noexcept {
    if (!ports_.out->push(item)) return false;
    share_.add();
    half_.add();
    ports_.pipeline->notify();
    return true;
  }

  // Puts a frame or sample into the stream's share of the ring.
  bool push(const Item& item) noexcept {
    if (!share_is_open() || !put(item)) return false;
    if (item.kind == Item::Kind::kSample) {
      counters_.reader.newest_sample.store(item.sample.header.sequence, std::memory_order_release);
    } else {
      counters_.reader.newest.store(item.frame.header.sequence, std::memory_order_release);
    }
    return true;
  }

  // Events that a device can trigger at any rate count against its stream's share, too.
  bool push_event(const Item& item) noexcept {
    const bool shared = item.stream_event.kind == v1::Event::KIND_CLOCK_JUMPED;
    return (!shared || share_is_open()) && put(item);
  }

  void arrived(std::int64_t arrival_ns) noexcept {
    arrival_ns_ = arrival_ns;
    intake_.arrived(arrival_ns);
  }

  void record_calibration() noexcept {
    record_sink(pipeline::Direction::kCalibration, std::as_bytes(std::span(calibration_->text)));
  }
  void record_sink(pipeline::Direction direction, std::span<const std::byte> bytes,
                   std::uint8_t socket = 0) noexcept {
    if (ports_.record_sink == nullptr) return;
    ports_.record_sink->chunk(stream_, socket, direction, arrival_ns_, intake_.next(), bytes);
  }

  ReadStream read_;
  StreamCounters& counters_;
  const ReaderPorts& ports_;
  system::Poller& poller_;
  std::uint32_t stream_;
  drivers::Device* device_;  // null while it is unplugged
  const drivers::glove::OwnedCalibration* calibration_;
  std::int64_t poll_due_ns_ = kNoTime_ns;
  std::int64_t arrival_ns_ = 0;
  bool ended_ = false;
  RingShare share_, half_;  // this stream's share of the ring to the pipeline
  bool open_ = true;
  Intake intake_;
};

}  // namespace posed::pipeline
