// SourceBodies: the bodies of one source as streams. It builds skeletons, stages and engines from
// the source's newest description, hands the streams to the rest of the daemon, and then gives the
// reader the new bodies in one piece. Cold; for the builder's thread.
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
  const pipeline::PartnerStreams& partners;
  // With which a stream goes on that returns under its name; by the name of one that has left.
  std::map<std::string, pipeline::NextNumbers> numbers{};
  std::size_t made = 0;  // streams since the start
  std::atomic<bool> stopped{false};

  [[nodiscard]] bool is_stopped() const noexcept { return stopped.load(std::memory_order_acquire); }
};

class SourceBodies {
 public:
  // Both outlive the object.
  SourceBodies(SharedBodies& shared, BodySource& source);
  ~SourceBodies();

  // When something is to be built: `now_ns` or later; kForever_ns: nothing until something comes.
  [[nodiscard]] std::int64_t due_ns(std::int64_t now_ns) const;
  // Takes what the reader is done with, and builds if it is time.
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
  };

  [[nodiscard]] bool may_have_slot() const;
  void take_back();
  void build();
  void tell();
  void warn(const std::string& sentence);
  [[nodiscard]] std::vector<Stream> streams_of(const std::vector<drivers::Body>& bodies,
                                               pipeline::SourceUpdate& update);
  [[nodiscard]] const config::StreamConfig* wanted(const std::string& body, int number) const;
  [[nodiscard]] std::optional<Stream> stream_of(const drivers::Body& body, int number,
                                                const config::StreamConfig& config);
  [[nodiscard]] bool choose_name(Stream& stream, int number, const config::StreamConfig& config);
  [[nodiscard]] bool choose_slot(Stream& stream, const Stream* earlier);
  void add(Stream& stream, const config::StreamConfig& config);
  [[nodiscard]] Result<> make_engine_of(NewStream& stream) const;
  [[nodiscard]] double rate_of(const drivers::Body& body) const;
  [[nodiscard]] pipeline::ReadBody read_body(const Stream& stream) const;
  void forget(const Stream& stream);

  SharedBodies& shared_;
  BodySource& source_;
  std::vector<Stream> streams_;                                // as the description in use says
  std::vector<Stream> leaving_;                                // not yet ended by the worker
  std::unique_ptr<const pipeline::SourceUpdate> sent_, used_;  // under way, and in use
  std::int64_t next_ns_ = 0;                                   // not before
  std::vector<std::byte> description_;
  std::size_t without_slot_ = 0, without_name_ = 0;  // bodies of the description in use
  bool too_many_made_ = false;
  std::uint64_t freed_ = 0;     // StreamSlots::freed() when it was built
  std::uint64_t replaced_ = 0;  // descriptions, as of the last look
  std::string warned_;          // the last sentence
};

}  // namespace posed::devices
