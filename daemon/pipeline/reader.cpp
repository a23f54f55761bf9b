#include "daemon/pipeline/reader.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <string_view>
#include <utility>

#include "daemon/pipeline/intake.hpp"
#include "daemon/pipeline/junk_gate.hpp"
#include "daemon/system/hot_mark.hpp"
#include "drivers/glove/calibrated_decoder.hpp"
#include "posed/v1/posed.pb.h"

namespace posed::pipeline {
namespace {

// Pause before another look at a lossless source, or at a command that waits for space in the ring.
constexpr std::int64_t kLookAgain_ns = 250'000;
// The reader never sleeps so long (system/pulse.hpp): posed was stopped meanwhile.
constexpr std::int64_t kStoodStill_ns = 2 * kNanosPerSecond;

}  // namespace

// One source of the reader: its device, if one is connected, and the handling of what the device
// sends. RT-safe throughout, except for the reads, writes and wake-ups that are marked as allowed.
class Reader::Source final : private IntakeOut {
  // The most that one source may deliver in one turn; the rest waits for the next turn. A source
  // that always has data then costs each of the others only a fraction of a millisecond. No glove
  // comes near the limit: USB full speed is 64 bytes a millisecond, a serial line 11.5 KB a second.
  // A mocap system's datagram is often larger: then one is a turn.
  static constexpr std::uint64_t kChunksATurn = 64;
  static constexpr std::size_t kBytesATurn = 4096;
  // Frames of a lossless source on their way through the pipeline; below what the pipeline sheds.
  static constexpr std::uint64_t kFramesUnderWay = 2;
  static constexpr std::size_t kRowBytes = 100;  // of a chunk in the log, besides its content

 public:
  Source(std::uint32_t number, const ReadSource& read, const ReaderPorts& ports,
         system::Poller& poller, std::uint64_t& next_item)
      : read_(read),
        counters_(*read.counters),
        ports_(ports),
        poller_(poller),
        number_(number),
        device_(read.device),
        calibration_(read.calibration),
        intake_(next_item, *this) {
    if (read.body) set_bodies(std::span(&*read.body, 1));
  }

  // Whether a chunk may be read now: always while a device is connected, except that a lossless
  // source waits while its earlier frames are still in the pipeline, or the recorder is behind.
  [[nodiscard]] bool may_read() const noexcept {
    if (device_ == nullptr || ended_) return false;
    if (!device_->transport->lossless()) return true;
    for (std::size_t i = 0; i < places_; ++i) {
      const StreamCounters& stream = *place_[i]->body.counters;
      if (stream.reader.frames.load(std::memory_order_relaxed) -
              stream.pipeline.consumed.load(std::memory_order_acquire) >=
          kFramesUnderWay) {
        return false;
      }
      const RecordSink* const recorder = ports_.record_sink;
      if (recorder != nullptr && !recorder->keeps_up(number_, place_[i]->body.stream)) return false;
    }
    return true;
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
    counters_.link_ns.store(ports_.clock(), std::memory_order_relaxed);
    if (device_ != nullptr) use(*device_);
  }

  void calibrate(const DeviceCommand& command) noexcept {
    calibration_ = command.calibration;
    record_calibration();
    if (device_ != nullptr) use_calibration(*device_);
    for (std::size_t i = 0; i < places_; ++i) {
      static_cast<void>(report(i, v1::Event::KIND_CALIBRATED, command.ticket, calibration_->name));
    }
  }

  void send(std::span<const std::byte> bytes, std::uint8_t socket = 0) noexcept {
    if (device_ == nullptr) return;
    const system::AllowedCall the_write;
    if (!device_->transport->send(bytes, socket)) return;
    record(Direction::kToDevice, bytes, socket);
  }

  // Accepts new bodies and a new device, and returns the current device if the supervisor asks
  // for it. False while bodies wait for space in the ring.
  bool exchange() noexcept {
    const bool all_accepted = accept_update();
    if (read_.slot == nullptr) return all_accepted;
    if (device_ != nullptr && read_.slot->give_back.exchange(false)) give_back();
    static_cast<void>(read_.slot->in.consume([this](drivers::Device* device) noexcept {
      assert(device_ == nullptr);  // the supervisor hands over one device at a time
      device_ = device;
      intake_.new_link();
      arrived(ports_.clock());
      record(Direction::kDeviceInfo, std::as_bytes(std::span(device->description.text)));
      use(*device);
    }));
    return all_accepted;
  }

  // What waits in a link is old after posed stood still, and where it ends in the middle of a
  // message nobody can tell: the supervisor opens the link again. Sockets that only listen know how
  // old each datagram is.
  void reopen() noexcept {
    if (device_ == nullptr || read_.slot == nullptr || ended_) return;
    const drivers::Transport& transport = *device_->transport;
    if (transport.poll_fd() >= 0 && !transport.lossless() && !transport.only_listens()) give_back();
  }

  // Returns how many chunks came at the device's own pace.
  std::uint64_t serve() noexcept {
    if (device_ == nullptr) return 0;
    const bool paced = !device_->transport->lossless();
    poll();
    std::size_t bytes = 0;
    std::uint64_t chunks = 0;
    for (; chunks < kChunksATurn && bytes < kBytesATurn && may_read(); ++chunks) {
      const std::size_t got = read_one();
      if (got == 0) break;
      bytes += got;
    }
    if (ended_ && device_ != nullptr && device_->transport->poll_fd() >= 0) {
      poller_.remove(device_->transport->poll_fd());
    }
    return paced ? chunks : 0;
  }

  // IntakeOut: counts the item and puts it into the ring.
  bool item(std::size_t place, Item& item) noexcept override {
    Place& to = *place_[place];
    if (item.kind != Item::Kind::kEvent) {
      counters_.used_ns.store(arrival_ns_, std::memory_order_relaxed);
    }
    ReaderCounters& reader = to.body.counters->reader;
    switch (item.kind) {
      case Item::Kind::kSample:
        reader.samples.store(item.sample.header.sequence, std::memory_order_relaxed);
        break;
      case Item::Kind::kEvent:
        return push_event(to, item);
      default:
        item.frame.stamps.decoded_ns = ports_.clock();
        reader.frames.store(item.frame.header.sequence, std::memory_order_relaxed);
    }
    if (!push(to, item)) {
      count(reader.dropped);
      if (item.kind == Item::Kind::kFrame) {
        reader.last_dropped.store(item.frame.header.sequence, std::memory_order_release);
      } else {
        reader.last_dropped_sample.store(item.sample.header.sequence, std::memory_order_release);
      }
      return false;
    }
    return true;
  }

  void description(std::span<const std::byte> bytes) noexcept override {
    if (read_.exchange != nullptr && read_.exchange->descriptions) {
      read_.exchange->descriptions->put(bytes);
    }
  }

  void outcome(Outcome outcome) noexcept override {
    if (outcome == Outcome::kOk) {
      used_chunk_ = true;
      counters_.received_ns.store(arrival_ns_, std::memory_order_relaxed);
    }
    count(counters_.outcome[static_cast<std::size_t>(outcome)]);
  }

 private:
  // Reads and decodes one chunk; returns its length in bytes, 0 when none was due.
  std::size_t read_one() noexcept {
    const drivers::Chunk chunk = read();
    arrived(chunk.arrival_ns != kNoTime_ns ? chunk.arrival_ns : ports_.clock());
    count(counters_.outcome[static_cast<std::size_t>(Outcome::kForeign)], chunk.foreign);
    count(counters_.outcome[static_cast<std::size_t>(Outcome::kShort)], chunk.damaged);
    count(counters_.kernel_dropped, chunk.kernel_dropped);
    if (!chunk.bytes.empty()) accept(chunk);
    if (chunk.end) end();
    if (chunk.lost) give_back();
    return chunk.bytes.size();
  }

  [[nodiscard]] bool admits(const drivers::Chunk& chunk, std::int64_t cost) noexcept {
    return chunk.is_part_of_link() ? gate_.admits_link(chunk.sender, arrival_ns_)
                                   : gate_.admits(chunk.sender, cost, arrival_ns_);
  }

  // Records and decodes the bytes, unless a recording would be flooded with rubbish.
  void accept(const drivers::Chunk& chunk) noexcept {
    const auto cost = static_cast<std::int64_t>(kRowBytes + places_ * sizeof(StreamPosition) +
                                                chunk.bytes.size());
    if (ports_.record_sink != nullptr && !admits(chunk, cost)) {
      outcome(Outcome::kForeign);
      if (chunk.is_part_of_link()) return device_->transport->refuse();
      return device_->transport->decoded(false);
    }
    record(Direction::kFromDevice, chunk.bytes, chunk.socket);
    used_chunk_ = false;
    device_->decoder->feed_socket(chunk.socket, chunk.bytes, arrival_ns_, intake_);
    gate_.decoded(chunk.sender, used_chunk_, cost, arrival_ns_);
    device_->transport->decoded(used_chunk_);
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
    if (!device_->poll.request.empty()) {
      send(device_->poll.request, device_->poll.socket);
    } else if (const auto next = device_->decoder->next_request(now_ns); !next.bytes.empty()) {
      send(next.bytes, next.socket);
    }
    poll_due_ns_ += device_->poll.period_ns;
    if (poll_due_ns_ < now_ns) poll_due_ns_ = now_ns + device_->poll.period_ns;
  }

  void use_calibration(drivers::Device& device) noexcept {
    if (device.calibrated != nullptr) device.calibrated->calibrate(*calibration_->calibration);
  }

  void use(drivers::Device& device) noexcept {
    if (calibration_ != nullptr) use_calibration(device);
    if (used_ != nullptr && used_->layout) device.decoder->use(*used_->layout);
    poll_due_ns_ = device.poll.period_ns == 0 ? kNoTime_ns : ports_.clock();
    const std::int64_t now_ns = ports_.clock();
    counters_.received_ns.store(now_ns, std::memory_order_relaxed);
    counters_.link_ns.store(now_ns, std::memory_order_relaxed);
    counters_.connected.store(true, std::memory_order_release);
    count(counters_.connections);
    if (device.transport->poll_fd() < 0) return;
    const system::AllowedCall the_call;  // once for each connection, before any data flows
    static_cast<void>(poller_.add(device.transport->poll_fd(), number_));
  }

  // If a device without a supervisor is lost, its stream has ended.
  void give_back() noexcept {
    if (read_.slot == nullptr) return end();
    if (device_->transport->poll_fd() >= 0) {
      const system::AllowedCall the_call;
      poller_.remove(device_->transport->poll_fd());
    }
    poll_due_ns_ = kNoTime_ns;
    counters_.link_ns.store(ports_.clock(), std::memory_order_relaxed);
    counters_.connected.store(false, std::memory_order_release);
    const bool returned = read_.slot->out.push(device_);
    assert(returned);  // the slot has more entries than there are devices
    device_ = nullptr;
    const system::AllowedCall the_wake;
    read_.slot->supervisor->notify();
  }

  // The end events must not be lost: while the ring has no room for all of them, they are tried
  // again at the next read.
  void end() noexcept {
    if (!ports_.out->has_room(places_)) return;
    for (std::size_t i = 0; i < places_; ++i) end_stream(i, false);
    ended_ = true;
  }

  // Ends the stream of a place: because its body leaves, or else because the source has ended. The
  // ring has room.
  void end_stream(std::size_t place, bool leaves) noexcept {
    Place& ended = *place_[place];
    if (ended.ended && !leaves) return;
    ended.ended = true;
    const bool reported = intake_.report_end(place, leaves);
    assert(reported);
  }

  bool report(std::size_t place, v1::Event::Kind event, std::uint64_t ticket,
              std::string_view name = {}) noexcept {
    return intake_.report(place, static_cast<std::uint8_t>(event), ticket, name);
  }

  // A stream of the source: what it may put into the ring to the pipeline.
  struct Place {
    explicit Place(const ReadBody& of) noexcept
        : body(of),
          share(of.slots, of.counters->pipeline.taken),
          half(of.slots - of.slots / 2, of.counters->pipeline.taken) {}

    // Once its share of the ring is full, a stream may add nothing until half of the share is free.
    // A device that floods then loses long runs of frames instead of every other one, and each run
    // is a single decision in the log.
    bool is_open() noexcept {
      if (!share.has_room()) open = false;
      if (!open) open = half.has_room();
      return open && !ended;
    }

    ReadBody body;
    RingShare share, half;
    bool open = true;
    bool ended = false;  // and the end was reported
  };

  // From now on these are the bodies. A stream goes on with the numbers and the share of the stream
  // that had its slot, which is the same stream or the one of the same name before it.
  void set_bodies(std::span<const ReadBody> bodies) noexcept {
    std::array<std::optional<Place>, kMaxBodies> places;
    std::array<StreamPosition, kMaxBodies> positions;
    std::size_t count = 0;
    const std::span<const StreamPosition> now = intake_.next().streams;
    for (std::size_t body = 0; body < bodies.size(); ++body) {
      const ReadBody& one = bodies[body];
      positions[body].stream = one.stream;
      if (one.stream == kNoStream) continue;
      const std::size_t before = place_in(slot_of(one.stream));
      if (before < places_) {
        places[count] = place_[before];
        places[count]->body = one;
        places[count]->ended = false;
        positions[body].frame = now[before].frame;
        positions[body].sample = now[before].sample;
      } else {
        const NextNumbers next = next_numbers(*one.counters);
        places[count] = Place(one);
        positions[body].frame = next.frame;
        positions[body].sample = next.sample;
      }
      ++count;
    }
    place_ = places;
    places_ = count;
    intake_.set_streams(std::span(positions).first(bodies.size()));
  }

  [[nodiscard]] std::size_t place_in(std::uint32_t slot) const noexcept {
    std::size_t place = 0;
    while (place < places_ && slot_of(place_[place]->body.stream) != slot) ++place;
    return place;
  }

  // Uses the bodies that cold code has built: ends the streams that leave, swaps, records the row.
  // False while there is no room for an end event in the ring.
  bool accept_update() noexcept {
    if (read_.exchange == nullptr) return true;
    if (update_ == nullptr) {
      static_cast<void>(read_.exchange->updates.consume(
          [this](const SourceUpdate* update) noexcept { update_ = update; }));
    }
    if (update_ == nullptr) return true;
    assert(update_->bodies.size() <= kMaxBodies);
    // Room for the end events of all streams that may leave; after the source's end also of those
    // that come, which end at once.
    if (!ports_.out->has_room(places_ + update_->bodies.size())) return false;
    arrived(ports_.clock());
    for (std::size_t i = 0; i < places_; ++i) {
      const auto is_body = [&](const ReadBody& body) {
        return body.stream == place_[i]->body.stream;
      };
      if (std::ranges::none_of(update_->bodies, is_body)) end_stream(i, true);
    }
    set_bodies(update_->bodies);
    record(Direction::kDescription, update_->log);
    if (device_ != nullptr && update_->layout) device_->decoder->use(*update_->layout);
    used_ = std::exchange(update_, nullptr);
    if (ended_) end();
    const bool returned = read_.exchange->taken.push(used_);
    assert(returned);  // there are no more updates than entries
    read_.exchange->builder.notify();
    return true;
  }

  // Puts the item into the ring and counts it against the stream's share.
  bool put(Place& place, const Item& item) noexcept {
    if (!ports_.out->push(item)) return false;
    place.share.add();
    place.half.add();
    ports_.pipeline->notify();
    return true;
  }

  // Puts a frame or sample into the stream's share of the ring.
  bool push(Place& place, const Item& item) noexcept {
    if (!place.is_open() || !put(place, item)) return false;
    ReaderCounters& reader = place.body.counters->reader;
    if (item.kind == Item::Kind::kSample) {
      reader.newest_sample.store(item.sample.header.sequence, std::memory_order_release);
    } else {
      reader.newest.store(item.frame.header.sequence, std::memory_order_release);
    }
    return true;
  }

  // Events that a device can trigger at any rate count against its stream's share, too.
  bool push_event(Place& place, const Item& item) noexcept {
    const bool shared = item.stream_event.kind == v1::Event::KIND_CLOCK_JUMPED;
    return (!shared || place.is_open()) && put(place, item);
  }

  void arrived(std::int64_t arrival_ns) noexcept {
    arrival_ns_ = arrival_ns;
    intake_.arrived(arrival_ns);
  }

  void record_calibration() noexcept {
    record(Direction::kCalibration, std::as_bytes(std::span(calibration_->text)));
  }
  void record(Direction direction, std::span<const std::byte> bytes,
              std::uint8_t socket = 0) noexcept {
    if (ports_.record_sink == nullptr) return;
    ports_.record_sink->chunk(number_, socket, direction, arrival_ns_, intake_.next(), bytes);
  }

  ReadSource read_;
  SourceCounters& counters_;
  const ReaderPorts& ports_;
  system::Poller& poller_;
  std::uint32_t number_;
  drivers::Device* device_;  // null while it is unplugged
  const drivers::glove::OwnedCalibration* calibration_;
  const SourceUpdate* update_ = nullptr;  // waits for space in the ring
  const SourceUpdate* used_ = nullptr;    // null before the first one
  std::int64_t poll_due_ns_ = kNoTime_ns;
  std::int64_t arrival_ns_ = 0;
  JunkGate gate_;
  bool used_chunk_ = false;  // something of the chunk that is decoded was of use
  bool ended_ = false;
  std::array<std::optional<Place>, kMaxBodies> place_;  // as in intake_.next().streams
  std::size_t places_ = 0;
  Intake intake_;
};

Result<std::unique_ptr<Reader>> Reader::open(const ReaderPorts& ports) {
  auto wake = TRY(system::EventFd::open());
  auto poller = TRY(system::Poller::open());
  TRY(poller->add(*wake));
  return std::unique_ptr<Reader>(new Reader(ports, std::move(wake), std::move(poller)));
}

Reader::Reader(const ReaderPorts& ports, std::unique_ptr<system::EventFd> wake,
               std::unique_ptr<system::Poller> poller)
    : ports_(ports), wake_(std::move(wake)), poller_(std::move(poller)) {}

Reader::~Reader() = default;

void Reader::add(const ReadSource& source) {
  const auto index = static_cast<std::uint32_t>(sources_.size());
  sources_.push_back(std::make_unique<Source>(index, source, ports_, *poller_, next_item_));
}

void Reader::begin() noexcept {
  for (const auto& source : sources_) source->begin();
}

std::int64_t Reader::turn(std::int64_t now_ns) noexcept {
  if (turned_ns_ != kNoTime_ns && now_ns - turned_ns_ > kStoodStill_ns) {
    for (const auto& source : sources_) source->reopen();
  }
  turned_ns_ = now_ns;
  const bool all_handled = handle_requests();
  for (const std::uint32_t source : std::exchange(ready_, {})) {
    handled_ += sources_[source]->serve();
  }
  const std::int64_t due_ns = serve_timed(now_ns);
  return all_handled ? due_ns : std::min(due_ns, now_ns + kLookAgain_ns);
}

void Reader::run() noexcept {
  const system::HotSection hot;
  begin();
  while (!stop_.load(std::memory_order_acquire)) {
    pulse_.beat();
    const std::int64_t now_ns = ports_.clock();
    const std::int64_t due_ns = turn(now_ns);
    system::rest(moderation_.rest_ns(handled_, now_ns));
    wake_->going_to_sleep();
    if (stop_.load(std::memory_order_acquire)) break;
    ready_ = poller_->wait(called() ? 0 : system::time_left_ns(due_ns, ports_.clock));
    wake_->awake();
  }
}

void Reader::stop() noexcept {
  stop_.store(true, std::memory_order_release);
  wake_->notify();
}

void Reader::call() noexcept {
  called_.store(true, std::memory_order_release);
  wake_->notify();
}

// A calibration is acknowledged by an event, and a body that leaves is reported by one; events need
// a free slot in the ring: while there is none, the requests wait.
bool Reader::handle_requests() noexcept {
  if (!called_.exchange(false, std::memory_order_acq_rel) && !requests_wait_) return true;
  requests_wait_ = false;
  for (const auto& source : sources_) requests_wait_ |= !source->exchange();
  const auto apply = [this](const DeviceCommand& command) noexcept {
    assert(command.source < sources_.size());
    Source& source = *sources_[command.source];
    if (command.kind == DeviceCommand::Kind::kCalibrate) {
      source.calibrate(command);
    } else {
      source.send(std::span(command.bytes).first(command.size));
    }
  };
  if (ports_.commands != nullptr) {
    while (ports_.out->has_room() && ports_.commands->consume(apply)) {
    }
    requests_wait_ |= !ports_.commands->empty();
  }
  return !requests_wait_;
}

std::int64_t Reader::serve_timed(std::int64_t now_ns) noexcept {
  std::int64_t next_ns = system::kForever_ns;
  for (const auto& source : sources_) {
    std::int64_t due_ns = source->due_ns();
    if (due_ns == kNoTime_ns) continue;
    if (due_ns <= now_ns) {
      handled_ += source->serve();
      due_ns = source->due_ns();
      if (due_ns == kNoTime_ns) continue;
      if (source->must_wait()) due_ns = std::max(due_ns, now_ns + kLookAgain_ns);
    }
    next_ns = std::min(next_ns, due_ns);
  }
  return next_ns;
}

}  // namespace posed::pipeline
