// SourceBodies: the bodies of one source as streams. It builds skeletons, stages and engines from
// the source's newest description, hands the streams to the rest of the daemon, and then gives the
// reader the new bodies in one piece. A device that does not describe its bodies has one, which is
// known from the start. Cold; for the builder's thread.
#pragma once

#include <atomic>
#include <cassert>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "daemon/config/daemon_config.hpp"
#include "daemon/devices/kept_settings.hpp"
#include "daemon/devices/model_files.hpp"
#include "daemon/devices/open_source.hpp"
#include "daemon/devices/stream_host.hpp"
#include "daemon/pipeline/messages.hpp"
#include "daemon/pipeline/reader.hpp"

namespace posed::devices {

// The slots of the streams.
class StreamSlots {
 public:
  // `reserved` slots are only for streams that the config names.
  StreamSlots(std::uint32_t count, std::size_t reserved) : reserved_(reserved) {
    for (std::uint32_t slot = 0; slot < count; ++slot) free_.push_back({slot, 0});
  }

  // A free slot with its next generation, as a stream id: that of the slot that is free for the
  // longest time. Empty if none is free.
  [[nodiscard]] std::optional<std::uint32_t> next_free(bool named) {
    if (free_.size() <= (named ? 0 : reserved_)) return std::nullopt;
    const Slot slot = free_.front();
    free_.pop_front();
    assert(!named || reserved_ > 0);  // each named stream has one at a time
    if (named) --reserved_;
    return pipeline::stream_id(slot.number, slot.generation);
  }

  // The next stream in the same slot. After 65,534 of them the slot's ids come again, except the
  // first: those that had them ended long ago.
  [[nodiscard]] static std::uint32_t next(std::uint32_t stream) {
    const std::uint32_t generation = pipeline::generation_of(stream);
    return pipeline::stream_id(pipeline::slot_of(stream),
                               generation < pipeline::kMaxGeneration ? generation + 1 : 1);
  }

  // The slot's last stream has left; `named` as in next_free().
  void give_back(std::uint32_t stream, bool named) {
    if (named) ++reserved_;
    ++freed_;
    const std::uint32_t id = next(stream);
    free_.push_back({pipeline::slot_of(id), pipeline::generation_of(id)});
  }

  // How often a slot was given back.
  [[nodiscard]] std::uint64_t freed() const { return freed_; }

 private:
  struct Slot {
    std::uint32_t number;
    std::uint32_t generation;
  };
  std::deque<Slot> free_;
  std::size_t reserved_;
  std::uint64_t freed_ = 0;
};

// "<source>-<body>" in lower case; every other character than a-z, 0-9, '-' and '_' becomes '-';
// cut so that the suffix of raw input fits behind it.
[[nodiscard]] std::string plain_stream_name(const std::string& source, const std::string& body);

// Gives each body a name of its own, which it keeps when it leaves and returns.
class BodyNames {
 public:
  // `reserved` are the names of all other streams, those of their raw input included.
  explicit BodyNames(std::set<std::string> reserved) : taken_(std::move(reserved)) {}

  // `number` counts the bodies that the source calls the same, from 1. If the plain name is taken
  // the body gets "-2", "-3" and so on, in the order in which bodies appear.
  // Null once a source has named thousands of bodies, because devices can invent names without end.
  [[nodiscard]] const std::string* name_of(const std::string& source, const std::string& body,
                                           int number);

 private:
  static constexpr std::size_t kMaxKept = 4096;  // of a source
  struct Body {
    std::string source, body;
    int number;
    auto operator<=>(const Body&) const = default;
  };
  std::set<std::string> taken_;  // also the raw_name() of each
  std::map<Body, std::string> names_;
  std::map<std::string, std::size_t> kept_;  // by source
};

// What the bodies of all sources share.
struct SharedBodies {
  StreamHost& host;
  StreamSlots slots;
  BodyNames names;
  ModelFiles& models;
  const KeptSettings& kept;
  std::size_t
      max_made;  // streams of one run, beyond which it makes them slowly (source_builder.hpp)
  pipeline::PartnerStreams partners{};  // the streams that are there
  std::size_t several = 0, single = 0;  // sources with several bodies, and with one
  // The next frame and sample numbers of streams that left, by stream name; a returning stream
  // continues them.
  std::map<std::string, pipeline::NextNumbers> numbers{};
  std::atomic<bool> stopped{false};

  [[nodiscard]] bool is_stopped() const noexcept { return stopped.load(std::memory_order_acquire); }
};

class SourceBodies {
 public:
  // Both outlive the object.
  SourceBodies(SharedBodies& shared, OpenSource& source);
  ~SourceBodies();

  // For a device with one body, before all else: reserves the slot of its stream, builds the
  // stream, and makes it known to the host. The error is that of a stage.
  void reserve_only();
  Result<> build_only();
  void add_only();

  // Returns when turn() must be called next, at least `now_ns`; kForever_ns: only after a
  // description comes.
  [[nodiscard]] std::int64_t due_ns(std::int64_t now_ns) const;
  // Takes back what the reader does not use any more, and builds if it is time.
  void turn(std::int64_t now_ns);
  // The worker has ended a stream. False if it is not one of this source.
  [[nodiscard]] bool gone(std::uint32_t id);

 private:
  struct Stream {
    std::string key{};  // which of the source's bodies
    std::string name{};
    std::uint32_t id = 0;
    drivers::Body body{};
    bool named = false;  // by a [[stream]] table
    bool refused = false;
    // When it was built: the partners that its stages name, kNoStream where one was not there, and
    // what control had set.
    std::map<std::string, std::uint32_t> partners{};
    std::uint64_t changes = 0;
    bool missed_change = false;  // control set something while it was built
  };

  // How many streams this source may make without a pause, so that it takes none of another's.
  [[nodiscard]] std::size_t share() const;
  [[nodiscard]] bool may_have_slot() const;
  void take_back();
  void build(std::vector<std::byte> description);
  void use_mapping_on(drivers::SourceLayout& layout);
  void report_oddities();
  void warn(const std::string& sentence);
  [[nodiscard]] std::vector<Stream> streams_of(const std::vector<drivers::Body>& bodies,
                                               pipeline::SourceUpdate& update);
  // Whether the stream must be built again, although its body is the same.
  [[nodiscard]] bool is_outdated(const Stream& stream) const;
  [[nodiscard]] const config::StreamConfig* wanted(const std::string& body, int number) const;
  [[nodiscard]] std::optional<Stream> stream_of(const drivers::Body& body, int number,
                                                const config::StreamConfig& config);
  [[nodiscard]] bool choose_name(Stream& stream, int number, const config::StreamConfig& config);
  [[nodiscard]] bool choose_slot(Stream& stream, const Stream* earlier);
  // The stream with its engine, or with the reason why a stage refuses it.
  [[nodiscard]] NewStream make(Stream& stream, const config::StreamConfig& config);
  Result<> make_engine_of(NewStream& stream) const;
  [[nodiscard]] pipeline::ReadBody read_body(const Stream& stream) const;
  void forget(const Stream& stream);

  SharedBodies& shared_;
  OpenSource& source_;
  std::optional<NewStream> only_;  // between build_only() and add_only()
  std::vector<Stream> streams_;    // as the description in use says
  std::vector<Stream> leaving_;    // not yet ended by the worker
  std::unique_ptr<const pipeline::SourceUpdate> sent_, used_;  // under way, and in use
  std::int64_t next_ns_ = 0;                                   // not before
  std::vector<std::byte> description_;                         // in use
  std::size_t without_slot_ = 0, without_name_ = 0;            // bodies of the description in use
  std::size_t made_ = 0;                                       // streams since the start
  bool too_many_made_ = false;
  std::uint64_t freed_ = 0;     // StreamSlots::freed() when it was built
  std::uint64_t replaced_ = 0;  // descriptions, as of the last look
  std::string warned_;          // the last sentence
  std::string misfit_;          // the last one about the user's mapping
};

}  // namespace posed::devices
