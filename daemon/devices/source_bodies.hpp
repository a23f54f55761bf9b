// SourceBodies: the bodies of one source as streams. It builds skeletons, stages and engines from
// the source's newest description, hands the streams to the rest of the daemon, and then gives the
// reader the new bodies in one piece. A device that does not describe its bodies has one, which is
// known from the start. Cold; for the builder's thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/config/daemon_config.hpp"
#include "daemon/devices/body_names.hpp"
#include "daemon/devices/kept_settings.hpp"
#include "daemon/devices/model_files.hpp"
#include "daemon/devices/open_source.hpp"
#include "daemon/devices/stream_host.hpp"
#include "daemon/devices/stream_slots.hpp"
#include "daemon/pipeline/reader.hpp"

namespace posed::devices {

// What the bodies of all sources share.
struct SharedBodies {
  StreamHost& host;
  StreamSlots slots;
  BodyNames names;
  ModelFiles& models;
  const KeptSettings& kept;
  std::size_t max_made;                 // streams that one run of the daemon makes without a pause
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

  // When something is to be built: `now_ns` or later; kForever_ns: nothing until something comes.
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
