// The rings behind RecordSink: the hot threads add records, the recorder thread removes them. Each
// source has a share of the ring of chunks, and each slot for a stream a share of those of
// decisions and frames, so that none can cause another to lose records. A record that does not fit
// is counted as lost by its source or by its stream, and the next record of the same source or
// stream that fits carries the count; so the gap row stands in the log where the gap happened.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <limits>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <boost/lockfree/spsc_queue.hpp>

#include "daemon/pipeline/counters.hpp"
#include "daemon/pipeline/record_sink.hpp"
#include "daemon/pipeline/ring.hpp"
#include "daemon/pipeline/take.hpp"
#include "daemon/record/recorded_stream.hpp"
#include "daemon/record/ring_sizes.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/rt_safe.hpp"
#include "proto/log/rows.hpp"

namespace posed::record {

// A lock-free ring of records {header, bytes} of any length, between one producer and one consumer.
// A record that does not fit is refused as a whole. The memory is touched at construction, so that
// the producer never causes a page fault.
// Header: trivially copyable, with a member `bytes` that holds the length of all bytes behind it.
template <typename Header>
class RecordRing {
  static_assert(std::is_trivially_copyable_v<Header>);

 public:
  explicit RecordRing(std::size_t capacity_bytes) : ring_(capacity_bytes) {
    const std::vector<std::byte> zeros(capacity_bytes);
    ring_.push(zeros.data(), zeros.size());
    ring_.reset();
  }

  // How much of the capacity a record uses.
  [[nodiscard]] static std::size_t size_of(const Header& header) noexcept {
    return sizeof(Header) + header.bytes;
  }

  // Producer. The bytes behind the header are those of `first` and then those of `second`. Returns
  // false if the ring is full; then nothing was written.
  RT_SAFE [[nodiscard]] bool push(const Header& header, std::span<const std::byte> first,
                                  std::span<const std::byte> second = {}) noexcept {
    if (ring_.write_available() < size_of(header)) return false;
    std::array<std::byte, sizeof(Header)> image;
    std::memcpy(image.data(), &header, sizeof(Header));
    ring_.push(image.data(), image.size());
    ring_.push(first.data(), first.size());
    ring_.push(second.data(), second.size());
    return true;
  }

  // Consumer: calls each(header, bytes) for the records that are there now, not for later ones. The
  // bytes are valid during the call.
  template <typename Each>
  void drain(Each&& each) {
    std::size_t budget = ring_.read_available();
    while (budget >= sizeof(Header) || header_ready_) {
      if (!header_ready_) {
        std::array<std::byte, sizeof(Header)> image;
        ring_.pop(image.data(), image.size());
        std::memcpy(&header_, image.data(), sizeof(Header));
        header_ready_ = true;
        budget -= sizeof(Header);
      }
      // Header and bytes are several pushes: the later ones may still be missing.
      if (budget < header_.bytes) return;
      scratch_.resize(header_.bytes);
      ring_.pop(scratch_.data(), scratch_.size());
      budget -= header_.bytes;
      header_ready_ = false;
      each(std::as_const(header_), std::span<const std::byte>(scratch_));
    }
  }

 private:
  boost::lockfree::spsc_queue<std::byte> ring_;
  // Used by the consumer.
  Header header_{};
  bool header_ready_ = false;
  std::vector<std::byte> scratch_;
};

// Behind it are the positions of the source's streams, then the bytes of the chunk.
struct ChunkHeader {
  std::uint32_t bytes = 0;  // of both
  std::uint32_t source = 0;
  std::uint8_t socket = 0;
  pipeline::Direction direction = pipeline::Direction::kFromDevice;
  std::uint16_t positions = 0;  // how many
  std::int64_t arrival_ns = 0;
  std::uint64_t item = 0;  // number of the first item made from it
  std::uint64_t lost_before = 0;
};

struct FrameHeader {
  std::uint32_t bytes = 0;
  std::uint32_t stream = 0;
  bool raw = false;
  std::uint64_t sequence = 0;
  std::uint64_t lost_before = 0;
};

// Stands for "no frame"; compares as later than any frame.
inline constexpr std::uint64_t kNoFrame = std::numeric_limits<std::uint64_t>::max();

// The first frame of its stream that a decision concerns.
RT_SAFE [[nodiscard]] inline std::uint64_t first_frame_of(
    const pipeline::Decision& decision) noexcept {
  const bool of_samples = decision.kind == pipeline::Decision::Kind::kShedSamples;
  return of_samples ? kNoFrame : decision.sequence;
}

struct DecisionRecord {
  pipeline::Decision decision;
  std::uint64_t lost_before = 0;
  std::uint64_t lost_from_frame = 0;  // the first frame that one of the lost decisions may concern
};

// The records of one kind that did not fit, of one source or stream. `total` is written by any
// thread, the others by the single producer of this kind; any thread may read them.
struct Losses {
  std::atomic<std::uint64_t> total{0};
  std::atomic<std::uint64_t> carried{0};          // how many of them a later record has reported
  std::atomic<std::uint64_t> lost_from_frame{0};  // for decisions, see DecisionRecord

  // Those that no later record carries yet.
  [[nodiscard]] std::uint64_t pending() const noexcept {
    return total.load(std::memory_order_relaxed) - carried.load(std::memory_order_relaxed);
  }
};

// They belong to a stream, not to its slot: while a slot's share is full several generations may
// have lost records. They stay until the recording ends.
struct StreamLosses {
  StreamLosses(std::uint32_t stream, StreamLosses* before) noexcept : id(stream), older(before) {}
  const std::uint32_t id;
  StreamLosses* const older;  // of the same slot
  Losses decisions, frames;
};

using log::kMaxTakes;

// A take has begun or ended.
struct TakeChange {
  log::TakeRow row{};  // as the log is to have it
  std::int64_t time_ns = 0;
  std::string text{};  // a sentence about it
};

// How the recorder gets on.
struct RecorderState {
  std::string trouble{};          // why the log cannot be written at present; empty: it can
  std::uint64_t lost_chunks = 0;  // that the log lacks
};

// The takes of a recording, numbered as they begin. What changes waits here until the recorder
// thread writes it. Any thread; cold.
class Takes {
 public:
  // `next_item`: the first item behind the mark. Returns the take that began or ended. Fails when
  // none runs that could be ended, or when there are too many.
  Result<pipeline::Take> mark(const pipeline::TakeMark& mark, std::uint64_t next_item);
  [[nodiscard]] std::optional<pipeline::Take> running() const;
  // Told by the recorder thread; the takes carry it on.
  void set_state(RecorderState state);
  [[nodiscard]] RecorderState state() const;
  // What has changed since the last call, in order.
  [[nodiscard]] std::vector<TakeChange> next_changes();

 private:
  // The take that runs, as things are now.
  [[nodiscard]] pipeline::Take as_of_now() const;
  void end(const pipeline::TakeMark& mark, std::uint64_t next_item);
  void begin(const pipeline::TakeMark& mark, std::uint64_t next_item);

  mutable std::mutex mutex_;
  std::uint32_t last_number_ = 0;
  std::uint64_t first_item_ = 0;  // of the take that runs
  std::optional<pipeline::Take> running_;
  RecorderState state_;
  std::uint64_t lost_before_ = 0;  // chunks, when the take that runs began
  std::vector<TakeChange> changes_;
};

class RecordRings final : public pipeline::RecordSink {
 public:
  // Frames are recorded of all streams or of none. The streams of generation 0 need not be added.
  explicit RecordRings(const RingSizes& sizes);

  // Before the first record of the stream is made. Cold: allocates and locks; any thread.
  void add_stream(RecordedStream stream);

  // RecordSink, called by the hot threads. Records of a stream that was never added are ignored.
  void chunk(std::uint32_t source, std::uint8_t socket, pipeline::Direction direction,
             std::int64_t arrival_ns, const pipeline::Position& next,
             std::span<const std::byte> bytes) noexcept override;
  [[nodiscard]] bool keeps_up(std::uint32_t source, std::uint32_t stream) const noexcept override;
  void decision(const pipeline::Decision& decision) noexcept override;
  [[nodiscard]] bool wants_published() const noexcept override { return wants_published_; }
  void published(std::uint32_t stream, std::uint64_t sequence, bool raw,
                 std::span<const std::byte> bytes) noexcept override;
  void unpublished(std::uint32_t stream) noexcept override;
  void keep_model(std::span<const std::byte> bytes) override;
  // A take has the chunks from the newest one at its beginning up to the one before the newest at
  // its end, with all their items. So two takes in a row have each item once.
  Result<pipeline::Take> mark_take(const pipeline::TakeMark& mark) override;
  [[nodiscard]] std::optional<pipeline::Take> running_take() const { return takes_.running(); }
  [[nodiscard]] RecorderState state() const { return takes_.state(); }

  // Called by the recorder thread for what is there now: each(header, positions, bytes),
  // each(header, bytes) or each(record).
  template <typename Each>
  void drain_chunks(Each&& each) {
    chunks_.drain([&](const ChunkHeader& header, std::span<const std::byte> bytes) {
      give_back(sources_[header.source].share, chunks_.size_of(header));
      positions_.resize(header.positions);
      const auto packed = std::as_writable_bytes(std::span(positions_));
      std::ranges::copy(bytes.first(packed.size()), packed.begin());
      each(header, std::span<const pipeline::StreamPosition>(positions_),
           bytes.subspan(packed.size()));
    });
  }
  template <typename Each>
  void drain_frames(Each&& each) {
    frames_.drain([&](const FrameHeader& header, std::span<const std::byte> bytes) {
      give_back(slots_[pipeline::slot_of(header.stream)].frames, frames_.size_of(header));
      each(header, bytes);
    });
  }
  template <typename Each>
  void drain_decisions(Each&& each) {
    const auto drain = [&](const DecisionRecord& record) {
      give_back(slots_[pipeline::slot_of(record.decision.stream)].decisions, 1);
      each(record);
    };
    while (decisions_.consume(drain)) {
    }
  }
  [[nodiscard]] std::vector<std::vector<std::byte>> next_models();
  [[nodiscard]] std::vector<RecordedStream> next_streams();
  [[nodiscard]] std::vector<TakeChange> next_takes() { return takes_.next_changes(); }
  void set_state(RecorderState state) { takes_.set_state(std::move(state)); }

  [[nodiscard]] std::size_t sources() const noexcept { return sources_.size(); }
  // Any thread.
  [[nodiscard]] const Losses& losses_of_source(std::uint32_t source) const noexcept {
    return sources_[source].lost;
  }
  // Null for a stream that was never added. RT-safe; any thread.
  [[nodiscard]] const StreamLosses* losses_of(std::uint32_t stream) const noexcept;

 private:
  // One source's or slot's part of one ring. `taken` is written by the recorder, `share` belongs to
  // the single producer of this kind, which writes `put` for the other threads.
  struct Share {
    explicit Share(std::size_t size) noexcept : half(size / 2), share(size, taken) {}
    // Any thread.
    RT_SAFE [[nodiscard]] bool is_half_free() const noexcept {
      const std::uint64_t now = taken.load(std::memory_order_acquire);
      return put.load(std::memory_order_relaxed) <= now + half;
    }
    std::uint64_t half;
    std::atomic<std::uint64_t> put{0}, taken{0};
    pipeline::RingShare share;
  };
  struct Source {
    explicit Source(std::size_t chunk_bytes) noexcept : share(chunk_bytes) {}
    Share share;
    Losses lost;
  };
  struct Slot {
    explicit Slot(const SlotSizes& sizes) noexcept
        : decisions(sizes.decisions), frames(sizes.frame_bytes) {}
    Share decisions, frames;
    std::atomic<StreamLosses*> newest{nullptr};
    std::deque<StreamLosses> streams;
  };

  [[nodiscard]] StreamLosses* find(std::uint32_t stream) const noexcept;
  static void give_back(Share& share, std::size_t amount) noexcept {
    share.taken.fetch_add(amount, std::memory_order_release);
  }

  RecordRing<ChunkHeader> chunks_;
  RecordRing<FrameHeader> frames_;
  pipeline::Ring<DecisionRecord> decisions_;
  bool wants_published_ = false;
  std::deque<Source> sources_;                       // by number
  std::deque<Slot> slots_;                           // by slot
  std::vector<pipeline::StreamPosition> positions_;  // of the chunk that the recorder has
  std::atomic<std::uint64_t> newest_item_{1};        // the first of the newest chunk
  Takes takes_;
  std::mutex added_mutex_;  // of the following, and of adding to a slot
  std::vector<std::vector<std::byte>> models_;
  // The SHA-256 of all models so far: one that comes again and again, while the disk is full, takes
  // memory once.
  std::set<std::string> kept_;
  std::vector<RecordedStream> streams_;
};

}  // namespace posed::record
