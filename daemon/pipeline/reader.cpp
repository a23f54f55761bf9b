#include "daemon/pipeline/reader.hpp"

#include <algorithm>

#include "daemon/pipeline/hot_mark.hpp"
#include "posed/v1/posed.pb.h"

namespace posed::pipeline {
namespace {

// A source that never runs dry must not starve the others.
constexpr int kMaxChunksInARow = 64;
// Frames of a patient source on their way through the pipeline; below what the pipeline sheds.
constexpr std::uint64_t kPatientFrames = 2;
constexpr std::int64_t kPatientLook_ns = 250'000;

}  // namespace

// One device, and the sink its decoder writes to.
class Reader::Source final : public Sink {
 public:
  Source(std::uint32_t stream, drivers::Device& device, StreamCounters& counters,
         const ReaderPorts& ports)
      : device_(device), counters_(counters), ports_(ports), stream_(stream) {
    item_.frame.header.stream = stream;
  }

  [[nodiscard]] drivers::Transport& transport() const noexcept { return *device_.transport; }
  [[nodiscard]] bool ended() const noexcept { return ended_; }

  // Whether a chunk may be read now: always, but for a patient source with frames under way.
  [[nodiscard]] bool may_read() const noexcept {
    return !transport().patient() ||
           frames_ - counters_.pipeline.consumed.load(std::memory_order_acquire) < kPatientFrames;
  }

  // Reads and decodes one chunk; false when none was due.
  bool read_one() noexcept {
    const drivers::Chunk chunk = read();
    arrival_ns_ = ports_.clock();
    if (!chunk.bytes.empty()) {
      if (ports_.tape != nullptr) {
        ports_.tape->chunk(stream_, record::Direction::kFromDevice, arrival_ns_, frames_ + 1,
                           chunk.bytes);
      }
      device_.decoder->feed(chunk.bytes, arrival_ns_, *this);
    }
    if (chunk.end) end();
    return !chunk.bytes.empty();
  }

  void frame(Frame& frame) noexcept override {
    frame.header.stream = stream_;
    frame.header.sequence = ++frames_;
    frame.header.arrival_ns = arrival_ns_;
    frame.stamps.decoded_ns = ports_.clock();
    item_.kind = Item::Kind::kFrame;
    item_.frame = frame;
    if (!ports_.out->push(item_)) return count(counters_.reader.dropped);
    counters_.reader.newest.store(frames_, std::memory_order_release);
    ports_.pipeline->ring();
  }

  void sample(Sample& sample) noexcept override {
    sample.header.stream = stream_;
    sample.header.sequence = ++samples_;
    sample.header.arrival_ns = arrival_ns_;
    item_.kind = Item::Kind::kSample;
    item_.sample = sample;
    if (!ports_.out->push(item_)) return count(counters_.reader.dropped);
    ports_.pipeline->ring();
  }

  void outcome(Outcome outcome) noexcept override {
    count(counters_.reader.outcome[static_cast<std::size_t>(outcome)]);
  }

 private:
  // A source that goes by time alone has nothing to ask the system.
  drivers::Chunk read() noexcept {
    if (transport().poll_fd() < 0) return transport().read(ports_.clock());
    const AllowedCall the_read;
    return transport().read(ports_.clock());
  }

  // The end must be heard: without room it is tried again at the next read.
  void end() noexcept {
    item_.kind = Item::Kind::kNotice;
    item_.notice = {stream_, v1::Event::KIND_ENDED, arrival_ns_, frames_, 0.0};
    ended_ = ports_.out->push(item_);
    ports_.pipeline->ring();
  }

  drivers::Device& device_;
  StreamCounters& counters_;
  const ReaderPorts& ports_;
  std::uint32_t stream_;
  std::int64_t arrival_ns_ = 0;
  std::uint64_t frames_ = 0;
  std::uint64_t samples_ = 0;
  bool ended_ = false;
  Item item_;  // kept here because it is large
};

Result<std::unique_ptr<Reader>> Reader::open(const ReaderPorts& ports) {
  auto wake = Wake::open();
  if (!wake) return std::unexpected(wake.error());
  auto poller = Poller::open();
  if (!poller) return std::unexpected(poller.error());
  if (auto added = (*poller)->add(**wake); !added) return std::unexpected(added.error());
  return std::unique_ptr<Reader>(new Reader(ports, std::move(*wake), std::move(*poller)));
}

Reader::Reader(const ReaderPorts& ports, std::unique_ptr<Wake> wake, std::unique_ptr<Poller> poller)
    : ports_(ports), wake_(std::move(wake)), poller_(std::move(poller)) {}

Reader::~Reader() = default;

Result<> Reader::add(drivers::Device& device, StreamCounters& counters) {
  const auto stream = static_cast<std::uint32_t>(sources_.size());
  if (const int fd = device.transport->poll_fd(); fd >= 0) {
    if (auto added = poller_->add(fd, stream); !added) return added;
  }
  sources_.push_back(std::make_unique<Source>(stream, device, counters, ports_));
  return {};
}

void Reader::run() noexcept {
  const HotSection hot;
  while (!stop_.load(std::memory_order_acquire)) {
    const std::int64_t due_ns = serve_timed(ports_.clock());
    wake_->going_to_sleep();
    if (stop_.load(std::memory_order_acquire)) break;
    std::int64_t timeout_ns = kForever_ns;
    if (due_ns != kForever_ns) timeout_ns = std::max<std::int64_t>(due_ns - ports_.clock(), 0);
    const auto ready = poller_->wait(timeout_ns);
    wake_->awake();
    for (const std::uint32_t stream : ready) serve(*sources_[stream]);
  }
}

void Reader::stop() noexcept {
  stop_.store(true, std::memory_order_release);
  wake_->ring();
}

std::int64_t Reader::serve_timed(std::int64_t now_ns) noexcept {
  std::int64_t next_ns = kForever_ns;
  for (const auto& source : sources_) {
    std::int64_t due_ns = source->transport().next_due_ns();
    if (source->ended() || due_ns == kNoTime_ns) continue;
    if (due_ns <= now_ns) {
      serve(*source);
      if (source->ended()) continue;
      due_ns = source->transport().next_due_ns();
      if (!source->may_read()) due_ns = std::max(due_ns, now_ns + kPatientLook_ns);
    }
    next_ns = std::min(next_ns, due_ns);
  }
  return next_ns;
}

void Reader::serve(Source& source) noexcept {
  for (int i = 0; i < kMaxChunksInARow && !source.ended() && source.may_read(); ++i) {
    if (!source.read_one()) break;
  }
  if (source.ended() && source.transport().poll_fd() >= 0) {
    poller_->remove(source.transport().poll_fd());
  }
}

}  // namespace posed::pipeline
